//! `cft-ident lsq`: the inertial parameters by linear least squares.

use std::path::{Path, PathBuf};

use super::held::{self, HeldRun};
use super::known_payload::KnownPayload;
use super::{
    CliError, Context, Outcome, arguments, files, logs, names_of, outputs, paths_of, pictures,
    setup, typed, written,
};
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_logs::log::LogSpec;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_report::report::stages;
use cft_ident_stages::identify::{self, Dataset, LsqSettings, RobotSetup, refined};

const EXAMPLE: &str = "\
Example:
  cft-ident lsq identification.csv -r robot.toml -m friction.toml -o m.toml
  cft-ident lsq emps_id.csv -r configs/emps.toml -o emps.toml --json -
  cft-ident lsq empty.csv -r arm.toml -o m.toml \\
    --fit-gains loaded.csv:mass=2.8+-0.05
  cft-ident lsq --static poses.csv -r arm.toml -o gravity.toml";

/// Fit the inertial parameters by linear least squares, friction taken from a model file.
///
/// Where the robot file says that friction is fitted together with the inertias, -m is left out.
#[derive(Debug, Clone, clap::Args)]
#[command(visible_alias = "fit", after_help = EXAMPLE, override_usage = "cft-ident lsq [OPTIONS] -r ROBOT.toml -o MODEL.toml LOG...")]
pub struct Args {
    /// Logs, or reduced ones (PART.cfi); a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    #[command(flatten)]
    pub leave_out: arguments::LeaveOut,
    /// Robot file, or a built-in one such as configs/cft.toml
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: String,
    /// Model file that holds the friction, as `friction` writes it
    #[arg(short, long, value_name = "FRICTION.toml")]
    pub model: Option<PathBuf>,
    /// How parameters are estimated from the rows
    #[arg(long, value_parser = arguments::estimator(), default_value = "wls")]
    pub estimator: EstimatorKind,
    /// Fit the gain of every torque channel too, from a log in which the last link carries a known mass
    /// [kg] besides those without it; with no log given, ratios of gains alone
    #[arg(hide_short_help = true, long, value_name = "LOG:mass=KG[+-STD]", num_args = 0..=1, conflicts_with = "model")]
    pub fit_gains: Option<Option<KnownPayload>>,
    /// Leave the friction of the model file as it is; its covariance stays in the deviations
    #[arg(hide_short_help = true, long, requires = "model")]
    pub hold_friction: bool,
    /// The plain fit alone: no physically consistent parameters beside it, which torques are computed with
    #[arg(hide_short_help = true, long)]
    pub unconstrained: bool,
    /// Then fit a single axis to the motion that its torques make, in windows of so many seconds that begin
    /// at measured states [default: blocks set aside choose the length]
    #[arg(hide_short_help = true, long, value_name = "SECONDS", num_args = 0..=1, require_equals = true,
          value_parser = arguments::positive, conflicts_with_all = ["model", "fit_gains"])]
    pub open_loop: Option<Option<f64>>,
    /// The logs hold poses, each reached from both sides, or a row for each pose: gravity, friction at rest and ratios
    /// of gains are fitted to their means
    #[arg(long = "static", conflicts_with_all = ["model", "fit_gains", "open_loop", "unconstrained", "estimator", "leave_out", "fix_setup", "as_declared"])]
    pub held: bool,
    /// Model file to write
    #[arg(short, long, value_name = "MODEL.toml")]
    pub output: PathBuf,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::ends_in(["html"]))]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub setup: setup::SetupArgs,
}

pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    if args.held {
        let asked = HeldRun {
            logs: &args.logs,
            robot: &args.robot,
            output: &args.output,
            report: args.report.as_deref(),
        };
        return held::run(&asked, context);
    }
    let payload = args.fit_gains.iter().flatten().map(|p| &*p.log.path);
    let outputs = outputs::listed(Some(&args.output), &[], args.report.as_deref());
    let outputs = outputs.chain(args.setup.fix_setup.as_deref());
    context.check_outputs(paths_of(&args.logs).chain(payload), outputs)?;
    let robot = files::robot(Path::new(&args.robot))?;
    let machine = RobotSetup::new(&args.robot, robot.value);
    let mut given = vec![robot.provenance];
    let friction = files::friction("lsq", args.model.as_deref(), &machine.file, context)?;
    given.extend(friction.iter().map(|model| model.provenance.clone()));
    let known = friction.as_ref().map(|model| &model.value);
    let data = Dataset::read(
        &machine,
        &logs(&args.leave_out.of(&args.logs))?,
        &context.control,
    )?;
    data.check_moving()?;
    let (data, gains, edits) = match &args.fit_gains {
        None => (data, None, Vec::new()),
        Some(payload) => {
            let payload = payload.as_ref().map(KnownPayload::known);
            let fitted = identify::fit_gains(&data, payload.as_ref(), &context.control)?;
            let data = fitted.data(&data, &context.control)?;
            (data, Some(fitted.gains), fitted.edits)
        }
    };
    let settings = LsqSettings {
        estimator: args.estimator,
        consistent: !args.unconstrained && args.open_loop.is_none(),
        friction: known,
        hold_friction: args.hold_friction,
        open_loop: args.open_loop,
        gains: gains.as_ref(),
    };
    let robot = Path::new(&args.robot);
    let checked = setup::checked(data, (robot, &edits), &args.setup, context)?;
    let data = &checked.setup.data;
    let (machine, logs) = (&data.setup, &data.logs);
    let mut found = identify::lsq(data, &settings, &context.control)?;
    let setup = &checked.setup;
    setup.put_before(&mut found.setup, &mut found.notes);
    let mut model = found.model(machine, known.map(|given| &given.file));
    if args.open_loop.is_some() && !args.unconstrained {
        identify::project(&mut model)?;
    }
    let document = JsonDocument::new("lsq", &found.inputs, &found.notes, &found)?;
    let names = names_of(&args.logs);
    let of = stages::lsq::LsqReport {
        setup: machine,
        found: &found,
        file: &model,
        path: &typed::quoted(&args.output.to_string_lossy()),
        logs: &names,
        typed: &typed_logs(&args.logs),
    };
    let mut report = stages::lsq::lsq(&of);
    if let Some(path) = &args.report {
        let smoothed = machine.smoothed_as(&found.position_cutoffs);
        let in_memory = match data.reduced.is_empty() {
            false => None,
            true => pictures::in_memory(&smoothed, logs, context)?,
        };
        let numbers = refined(&model, &args.output.to_string_lossy())?;
        let of_model = (&model, &numbers);
        let replayed = pictures::replayed(&smoothed, in_memory.as_ref(), &names, of_model, &[])?;
        let files = args.logs.iter().filter(|l| !identify::is_reduced(&l.path));
        let quality = pictures::inspected(files, machine, context)?;
        let (mut page, replayed) = (report.page(), replayed.as_ref());
        stages::lsq::pictures(&mut page, &of, replayed, &given, &quality, &context.command);
        context.check()?;
        context.write_text(path, &report.html())?;
    }
    context.check()?;
    checked.write(context)?;
    files::write_model(&args.output, &model, context)?;
    written(&mut report, &args.output);
    Ok(Outcome::new(report.text_for(context.screen), document))
}

/// Logs as a shell takes them; of many, and of reduced ones, which hold no rows to diagnose, a word.
fn typed_logs(logs: &[LogSpec]) -> String {
    if logs.len() > typed::MAX_LOGS || logs.iter().any(|log| identify::is_reduced(&log.path)) {
        return "LOG".to_owned();
    }
    typed::logs(logs.iter().map(LogSpec::to_string))
}
