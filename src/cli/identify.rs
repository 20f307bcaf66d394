//! `cft-ident identify`: the whole way from logs to a validated model.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use schemars::JsonSchema;
use serde::Serialize;

use super::beside_truth::{BesideTruth, load_truth, true_value};
use super::named::{self, IdentifyTarget, is_urdf};
use super::stage_folder::StageFolder;
use super::{
    CliError, Context, Outcome, campaign, file_name, held_out, logs_of, names_of, new, pictures,
    setup, typed, validate,
};
use cft_ident_files::config::campaign::CampaignSettings;
use cft_ident_files::config::{self, CampaignFile};
use cft_ident_logs::log::LogSpec;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::sections::residual;
use cft_ident_report::report::stages;
use cft_ident_report::report::stages::identify::ShownLogs;
use cft_ident_stages::identify::{
    self, Dataset, DiagnoseEnd, DiagnosisResult, FilteredMotion, IdentifiedDynamics,
    IdentifiedFriction, IdentifyError, IdentifySettings, Log, LogData, RobotSetup, StageEnd,
    Validated,
};
use cft_ident_stages::replay::ReplayedDiagnosis;
use cft_ident_stages::setup::Finding;

const EXAMPLE: &str = "\
Example:
  cft-ident identify
  cft-ident identify ur10
  cft-ident identify log.mcap arm.urdf -o run
  cft-ident identify campaign.toml -o runs/monday";

/// Run everything: friction, inertias, validation, diagnosis, and one report.
///
/// Name a robot (URDF or robot file) and its logs, in any order: columns are mapped, a part is held out, and every guess
/// is listed with the line to change. A campaign file alone says all of it. The name of an example (ur10, tx40, bldc)
/// stands for its files. Without a name the CFT robot is simulated, and the result is compared with the truth.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Robot and logs, or a campaign or an example
    ///
    /// A robot is a URDF, a robot file, or a built-in one such as configs/ur10.toml; LOG@0..70% is a part of a log.
    #[arg(value_name = "ROBOT|LOG|NAME")]
    pub files: Vec<LogSpec>,
    /// The robot, as a URDF of any name
    #[arg(long, value_name = "FILE")]
    pub urdf: Option<PathBuf>,
    /// A log of any name; may be given more than once
    #[arg(long, value_name = "LOG")]
    pub log: Vec<LogSpec>,
    /// Link of the URDF where the chain ends, if it branches
    #[arg(long, value_name = "LINK")]
    pub tip: Option<String>,
    /// Rate of logs that have no column of times
    #[arg(long, value_name = "HZ", value_parser = new::rate)]
    pub rate: Option<f64>,
    /// Topic of the robot in a recording of several machines
    #[arg(long, value_name = "NAME")]
    pub topic: Option<String>,
    /// Folder to write into [default: cft-ident-run, or the file's name with .run]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Seed of the simulation and of the starting points [default: the campaign's]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Leave the friction of the one-joint logs as it is in the fit of the inertias
    #[arg(long)]
    pub hold_friction: bool,
    #[command(flatten)]
    pub setup: setup::SetupArgs,
}

/// Folder where none is named.
const FOLDER: &str = "cft-ident-run";
/// Seed where none is named.
const SEED: u64 = 1;
/// The stages in their order.
const STAGES: [&str; 6] = [
    "set-up",
    "friction",
    "inertias",
    "held-out data",
    "missing effects",
    "report",
];
/// A campaign that is being identified.
struct IdentifyJob {
    name: String,
    campaign: CampaignFile,
    /// Folder from which the campaign names its logs.
    base: PathBuf,
    setup: RobotSetup,
    /// The robot file.
    robot: PathBuf,
    /// Its text, where it was drafted here.
    draft: Option<String>,
    /// Its text, where it comes with the tool.
    shipped: Option<&'static str>,
    guesses: Vec<String>,
    warnings: Vec<String>,
    /// Logs that were read already.
    read: Vec<LogData>,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let named = named::named(&args.files, (args.urdf.as_deref(), &args.log), context)?;
    let folder = args.output.clone().unwrap_or_else(|| match &named {
        IdentifyTarget::BuiltIn => PathBuf::from(FOLDER),
        // beside the campaign; a robot may lie anywhere
        IdentifyTarget::Robot(file, _) => {
            let name = file.file_stem().unwrap_or_default();
            PathBuf::from(name).with_extension("run")
        }
        IdentifyTarget::Campaign(file) => file.with_extension("run"),
    });
    if let IdentifyTarget::Campaign(file) = &named {
        // read again below: no folder is made for a campaign that cannot be run
        named::campaign(file)?;
    }
    context.files.make_folder(&folder).map_err(|e| {
        CliError::output(format!("cannot make the folder {}: {e}", folder.display()))
            .hint("name another one with -o")
    })?;
    let work = match &named {
        IdentifyTarget::Robot(robot, logs) => {
            IdentifyJob::of_robot((robot.as_path(), logs.as_slice()), args, &folder, context)?
        }
        IdentifyTarget::Campaign(file) => IdentifyJob::of_campaign(file, Vec::new())?,
        IdentifyTarget::BuiltIn => {
            let (_, warnings) = campaign::simulate(&folder, args.seed.unwrap_or(SEED), context)?;
            IdentifyJob::of_campaign(&folder.join("campaign.toml"), warnings)?
        }
    };
    let mut outcome = execute(work, &folder, args, context)?;
    outcome.text += &format!(
        "written to {0}/; open {0}/report.html in a browser\n",
        folder.display()
    );
    Ok(outcome)
}

impl IdentifyJob {
    fn of_campaign(file: &Path, warnings: Vec<String>) -> Result<Self, CliError> {
        let campaign = CampaignFile::load(file)?;
        let base = file.parent().unwrap_or(Path::new("")).to_path_buf();
        let robot = resolve(&base, &campaign.robot);
        Ok(Self {
            name: file_name(file),
            setup: RobotSetup::load(&robot.to_string_lossy())?,
            campaign,
            base,
            robot,
            draft: None,
            shipped: None,
            guesses: Vec::new(),
            warnings,
            read: Vec::new(),
        })
    }

    fn of_robot(
        (file, all): (&Path, &[LogSpec]),
        args: &Args,
        folder: &Path,
        context: &Context,
    ) -> Result<Self, CliError> {
        let Some(first) = all.first() else {
            return Err(CliError::input("no log is named"));
        };
        let (mut robot, mut draft, mut guesses) = (file.to_path_buf(), None, Vec::new());
        let (mut warnings, mut shipped) = (Vec::new(), None);
        let setup = match is_urdf(file) {
            false => {
                // one that comes with the tool is written beside its model, to be changed there
                shipped = config::embedded(file).filter(|_| !file.exists());
                RobotSetup::load(&file.to_string_lossy())?
            }
            true => {
                robot = folder.join("robot.toml");
                let asked = new::Args {
                    name: robot.clone(),
                    urdf: Some(file.to_path_buf()),
                    tip: args.tip.clone(),
                    log: Some(first.clone()),
                    rate: args.rate,
                    topic: args.topic.clone(),
                };
                let found = new::describe(&asked, &robot, context)?;
                guesses = found.guesses();
                warnings = found.warnings;
                draft = Some(found.text);
                RobotSetup::new(&robot.to_string_lossy(), found.file)
            }
        };
        let data = Dataset::read(&setup, &logs_of(all), &context.control)?;
        data.check_moving()?;
        let motion_of = |specs: &[LogSpec], beside: Option<&FilteredMotion>| {
            let of = logs_of(specs);
            let parts = LogData::read_all(&setup, &of, &[&data.logs], &context.control);
            let motion = match parts {
                Ok(parts) => FilteredMotion::of_logs(&setup, &parts, beside, &context.control),
                Err(error) => Err(error),
            };
            match motion {
                // the whole log is read by now: what keeps a part from a fit is its place
                Err(error) if !matches!(error, IdentifyError::Interrupted) => Ok(None),
                motion => Ok(motion?),
            }
        };
        let logs = held_out::parted(all, &motion_of)?;
        if logs.validation.is_empty() {
            let text = "no part of a log is held out, for none is long enough for the filter and moves where the rest does: the error on data that were not fitted is that of blocks set aside";
            warnings.push(text.to_owned());
        }
        let of = file_name(file);
        Ok(Self {
            name: format!("{of} with {}", names_of(all).join(", ")),
            campaign: CampaignFile {
                robot: of,
                truth: None,
                logs,
                settings: CampaignSettings {
                    seed: args.seed,
                    ..CampaignSettings::default()
                },
            },
            base: PathBuf::new(),
            setup,
            robot,
            draft,
            shipped,
            guesses,
            warnings,
            read: data.logs,
        })
    }
}

/// A path of a campaign file: relative to the file's folder, or a file that comes with the tool.
fn resolve(base: &Path, path: &str) -> PathBuf {
    let beside = base.join(path);
    match !beside.exists() && config::embedded(Path::new(path)).is_some() {
        true => PathBuf::from(path),
        false => beside,
    }
}

fn logs(
    base: &Path,
    specs: &[String],
    started: &BTreeMap<String, f64>,
) -> Result<Vec<LogSpec>, CliError> {
    let log = |text: &String| {
        let mut spec = LogSpec::from_str(text)?;
        let name = spec.path.to_string_lossy();
        spec.started_s = started.get(name.as_ref()).copied().unwrap_or(0.0);
        spec.path = base.join(&spec.path);
        Ok(spec)
    };
    specs.iter().map(log).collect()
}

fn execute(
    work: IdentifyJob,
    folder: &Path,
    args: &Args,
    context: &Context,
) -> Result<Outcome, CliError> {
    let (campaign, base) = (&work.campaign, &*work.base);
    let (mut guesses, mut warnings) = (work.guesses, work.warnings);
    let roles = &campaign.logs;
    let mut out = StageFolder::new(folder, context);
    let one_joint = logs(base, &roles.friction, &roles.started)?;
    let mut training = logs(base, &roles.identification, &roles.started)?;
    let unseen = logs(base, &roles.validation, &roles.started)?;
    let title = names_of(&unseen).join(", ");
    let (of_friction, fitted_logs) = (logs_of(&one_joint), logs_of(&training));
    let fitted = typed::logs(training.iter().map(LogSpec::to_string));
    training.extend(one_joint.iter().cloned());
    let mut with_draft = args.setup.clone();
    if work.draft.is_some() && !with_draft.as_declared {
        // what was guessed of the columns gives way to what the torques say
        with_draft.fix_setup = Some(work.robot.clone());
    }
    let stages = context.stages(&STAGES);
    stages.begin("set-up");
    let control = &context.control;
    let data = Dataset::read_beside(&work.setup, &logs_of(&training), &work.read, control)?;
    let checked = setup::checked(data, (&work.robot, &[]), &with_draft, context)?;
    warnings.extend(checked.setup.notes.iter().map(ToString::to_string));
    match (work.draft, &checked.new_file) {
        (Some(text), None) => out.write("robot.toml", &text)?,
        (Some(_), Some((_, text))) => {
            let head = "the torques contradict the names of the columns, and were followed";
            let refusals = checked.setup.report.refusals();
            guesses.extend(refusals.map(|found| format!("{head}: {}", found.in_words())));
            out.write("robot.toml", text)?;
        }
        (None, _) => checked.write(context)?,
    }
    if let Some(text) = work.shipped {
        out.write("robot.toml", text)?;
    }
    let known = checked.setup.data;
    let setup = known.setup.clone();
    let read = |logs: &[Log]| -> Result<Vec<LogData>, CliError> {
        let beside: &[&[LogData]] = &[&known.logs];
        Ok(LogData::read_all(&setup, logs, beside, &context.control)?)
    };
    let data = Dataset {
        one_joint: read(&of_friction)?,
        held_out: read(&logs_of(&unseen))?,
        ..Dataset::new(&setup, &read(&fitted_logs)?)
    };
    let settings = IdentifySettings {
        estimator: campaign.settings.estimator,
        consistent: !campaign.settings.unconstrained,
        hold_friction: args.hold_friction,
    };
    stages.begin(match one_joint.is_empty() {
        true => "inertias",
        false => "friction",
    });
    let found = identify::identify(&data, &settings, control, &mut |end| {
        match end {
            StageEnd::Friction(..) => stages.begin("inertias"),
            StageEnd::Dynamics(..) if unseen.is_empty() => stages.begin("missing effects"),
            StageEnd::Dynamics(..) => stages.begin("held-out data"),
            StageEnd::Validated(_) => stages.begin("missing effects"),
            StageEnd::Refined(_) => {}
        }
        keep(end, &setup, &title, &mut out)
    })?;
    stages.begin("report");
    warnings.extend(found.notes.iter().map(ToString::to_string));
    let (mut diagnosis, mut replayed_diagnosis) = (None, None);
    match &found.diagnosed {
        Ok(DiagnoseEnd::DataFault(fault)) => diagnosis = Some(fault.result()),
        Ok(DiagnoseEnd::Diagnosed(diagnosed)) => {
            diagnosis = Some(diagnosed.result(&setup));
            let refined = found.refined.as_ref().unwrap_or(&found.model);
            let replayed = ReplayedDiagnosis::new(&setup, diagnosed, refined);
            replayed_diagnosis = Some(replayed.map_err(CliError::input)?);
        }
        Err(error) => warnings.push(format!("no diagnosis: {}", CliError::from(error))),
    }

    // only now, with everything decided, may the truth be looked at
    let truth = campaign.truth.as_ref();
    let truth = truth.map(|path| load_truth(&base.join(path))).transpose()?;
    let unseen_names = names_of(&unseen);
    let written = match found.refined {
        Some(_) => "refined.toml",
        None => "model.toml",
    };
    // no file of a result says where on this machine it was made
    let written = match folder.is_absolute() {
        true => PathBuf::from(written),
        false => folder.join(written),
    };
    let of = stages::identify::IdentifyReport {
        setup: &setup,
        campaign: &work.name,
        found: &found,
        unseen: &unseen_names,
        truth: &|p| true_value(truth.as_ref(), p),
        limit: campaign.settings.max_relative_error,
        guesses: &guesses,
        path: &typed::quoted(&written.to_string_lossy()),
        logs: &fitted,
    };
    let mut report = stages::identify::identify(&of);
    let numbers = (&found.model, &found.numbers);
    let replayed = match &replayed_diagnosis {
        None if !unseen.is_empty() => {
            let logs = &data.held_out;
            let smoothed = setup.smoothed_for(logs, &found.numbers, control)?;
            let in_memory = pictures::in_memory(&smoothed, logs, context)?;
            pictures::replayed(&smoothed, in_memory.as_ref(), &unseen_names, numbers, &[])?
        }
        _ => None,
    };
    let shown = match (&replayed_diagnosis, &replayed) {
        (Some(replayed), _) => ShownLogs::Diagnosis(replayed),
        (None, Some(replayed)) => ShownLogs::Model(replayed),
        (None, None) => ShownLogs::Nothing,
    };
    // the logs of the set-up have the one-joint logs among them
    let all = training.iter().chain(&unseen);
    let origin = stages::identify::CampaignOrigin {
        campaign: &by_names(campaign),
        inputs: &found.inputs,
        warnings: &warnings,
        quality: &pictures::inspected(all, &setup, context)?,
        command: &context.command,
    };
    let mut page = report.page();
    stages::identify::pictures(&mut page, &of, shown, &origin);
    context.check()?;
    if let Some(replayed) = &replayed_diagnosis {
        let picture = residual::figure(&setup, &replayed.residual).svg();
        out.write("residual.svg", &picture)?;
    }
    out.write("report.html", &report.html())?;
    out.write("summary.txt", &report.text())?;
    out.files.push("result.json".into());
    let latest = found.refined.as_ref().unwrap_or(&found.model);
    let result = StageResults {
        setup: &checked.setup.report.findings,
        guesses: (!guesses.is_empty()).then_some(&guesses[..]),
        friction: found.friction.as_ref().map(|(laws, _)| laws),
        lsq: &found.dynamics,
        validate: found.validated.as_ref(),
        diagnose: diagnosis,
        truth: truth.as_ref().map(|truth| BesideTruth::of(latest, truth)),
        files: out.files,
    };
    let document = JsonDocument::new("identify", &found.inputs, &warnings, &result)?;
    context.write_text(&folder.join("result.json"), &document.text())?;
    let (limit, validated) = (campaign.settings.max_relative_error, &found.validated);
    let missed = validated
        .as_ref()
        .map(|found| validate::missed(found.judged(), limit));
    Ok(Outcome {
        missed: missed.unwrap_or_default(),
        ..Outcome::new(report.text_for(context.screen), document)
    })
}

/// A campaign as text, its files by their names alone.
fn by_names(campaign: &CampaignFile) -> String {
    let mut named = campaign.clone();
    let logs = &mut named.logs;
    let roles = [
        &mut logs.friction,
        &mut logs.identification,
        &mut logs.validation,
    ];
    for log in roles.into_iter().flatten() {
        if let Ok(spec) = LogSpec::from_str(log) {
            let span = spec.span.label().map(|span| format!("@{span}"));
            *log = spec.name() + &span.unwrap_or_default();
        }
    }
    toml::to_string(&named).unwrap_or_default()
}

/// The results of all stages.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Identified")]
pub struct StageResults<'a> {
    /// What the check of the set-up found.
    setup: &'a [Finding],
    /// What was guessed of the robot file, each with the line to change; null where nothing was.
    guesses: Option<&'a [String]>,
    /// Null where there is no one-joint log.
    friction: Option<&'a IdentifiedFriction>,
    lsq: &'a IdentifiedDynamics,
    /// Null where there is no validation log.
    validate: Option<&'a Validated>,
    /// Null where the logs are too short to look for effects.
    diagnose: Option<DiagnosisResult>,
    /// Of simulated logs.
    truth: Option<BesideTruth>,
    /// Files that were written, in their order.
    files: Vec<String>,
}

/// Writes what a stage leaves; `unseen` names the validation logs.
fn keep(
    end: StageEnd,
    setup: &RobotSetup,
    unseen: &str,
    out: &mut StageFolder,
) -> Result<(), CliError> {
    match end {
        StageEnd::Friction(found, model) => {
            out.write_model("friction.toml", model)?;
            out.write(
                "friction.svg",
                &stages::friction::figure(setup, found).svg(),
            )
        }
        StageEnd::Dynamics(_, model) => out.write_model("model.toml", model),
        StageEnd::Validated(found) => {
            let figure = stages::validate::figure(&found.validation, unseen).svg();
            out.write("validation.svg", &figure)
        }
        StageEnd::Refined(model) => out.write_model("refined.toml", model),
    }
}
