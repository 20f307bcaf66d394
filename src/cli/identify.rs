//! `cft-ident identify`: the whole way from logs to a validated model.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde_json::{Value, json};

use super::{
    CliError, Context, Outcome, campaign, diagnose, diagnose_fault, diagnose_text, logs_of,
    names_of, pages, pictures, validate,
};
use crate::config::model_file::Parameter;
use crate::config::{self, Campaign, ModelFile};
use crate::identify::{
    self, Campaigned, DiagnoseEnd, IdentifySettings, LoggedRobot, RoleLogs, StageEnd,
};
use crate::log::LogSpec;
use crate::output::write_whole;
use crate::report::json::Document;
use crate::report::{Report, stages, summary};
use crate::simulate::TruthFile;
use crate::verdict::Verdict;

const EXAMPLE: &str = "\
Example:
  cft-ident identify
  cft-ident identify campaign.toml -o runs/monday";

/// Run a whole campaign: friction, inertias, validation, and a summary.
///
/// Without a file the built-in campaign of the CFT robot is simulated first, and the result is
/// compared with its truth at the end.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Campaign file: robot, logs by role, settings
    #[arg(value_name = "CAMPAIGN.toml")]
    pub campaign: Option<PathBuf>,
    /// Folder to write into [default: runs/ and the campaign's name]
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Seed of the simulation and of the starting points [default: the campaign's]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
}

/// Folder where none is named.
const FOLDER: &str = "cft-ident-run";
/// Seed where none is named.
const SEED: u64 = 1;

/// Runs the command.
///
/// # Errors
/// Every [`CliError`]; what was finished before stands in the folder, whole.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let folder = args.output.clone().unwrap_or_else(|| match &args.campaign {
        None => PathBuf::from(FOLDER),
        Some(file) => file.with_extension("run"),
    });
    if let Some(file) = &args.campaign {
        // read again below: no folder is made for a campaign that cannot be run
        Campaign::load(file)?;
    }
    std::fs::create_dir_all(&folder).map_err(|e| {
        CliError::output(format!("cannot make the folder {}: {e}", folder.display()))
            .hint("name another one with -o")
    })?;
    let mut warnings = Vec::new();
    let file = match &args.campaign {
        Some(file) => file.clone(),
        None => {
            warnings = campaign::simulate(&folder, args.seed.unwrap_or(SEED), context)?;
            folder.join("campaign.toml")
        }
    };
    let campaign = Campaign::load(&file)?;
    let base = file.parent().unwrap_or(Path::new("")).to_path_buf();
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let mut outcome = execute((&name, &campaign), &base, &folder, context, warnings)?;
    outcome.text += &format!(
        "written to {0}/; open {0}/report.html in a browser\n",
        folder.display()
    );
    Ok(outcome)
}

/// A path of a campaign file: relative to the file's folder, or a file that comes with the tool.
fn resolve(base: &Path, path: &str) -> PathBuf {
    let beside = base.join(path);
    if !beside.exists() && config::embedded(Path::new(path)).is_some() {
        PathBuf::from(path)
    } else {
        beside
    }
}

fn logs(base: &Path, specs: &[String]) -> Result<Vec<LogSpec>, CliError> {
    specs
        .iter()
        .map(|text| {
            let mut spec = LogSpec::from_str(text)?;
            spec.path = base.join(&spec.path);
            Ok(spec)
        })
        .collect()
}

fn execute(
    (name, campaign): (&str, &Campaign),
    base: &Path,
    folder: &Path,
    context: &Context,
    mut warnings: Vec<String>,
) -> Result<Outcome, CliError> {
    let robot = resolve(base, &campaign.robot);
    let machine = LoggedRobot::load(&robot.to_string_lossy())?;
    let roles = &campaign.logs;
    let mut files: Vec<String> = Vec::new();
    let one_joint = logs(base, &roles.friction)?;
    let mut training = logs(base, &roles.identification)?;
    let unseen = logs(base, &roles.validation)?;
    let title = names_of(&unseen).join(", ");
    let role_logs = RoleLogs {
        friction: logs_of(&one_joint),
        identification: logs_of(&training),
        validation: logs_of(&unseen),
    };
    training.extend(one_joint.iter().cloned());
    let settings = IdentifySettings {
        estimator: campaign.settings.estimator,
        consistent: campaign.settings.feasible,
        ..IdentifySettings::default()
    };
    let control = context.control();
    let Campaigned {
        friction: of_joints,
        dynamics,
        model,
        numbers,
        validated,
        diagnosed: last,
        refined,
        inputs,
        warnings: told,
    } = identify::identify(&machine, &role_logs, &settings, control, &mut |end| {
        keep(end, &machine, &title, folder, &mut files)
    })?;
    let of_joints = of_joints.as_ref().map(|(found, _)| found);
    warnings.extend(told);
    let (mut diagnosed, mut at_fault) = (None, None);
    let (diagnose_json, lacking) = match last {
        Ok(DiagnoseEnd::DataFault(fault)) => {
            let told = (diagnose_fault::json(&fault), diagnose_fault::text(&fault));
            at_fault = Some(fault);
            told
        }
        Ok(DiagnoseEnd::Diagnosed(found)) => {
            let told = (
                diagnose::json(&machine, &found),
                diagnose_text::text(&machine, &found, "model.toml"),
            );
            diagnosed = Some(found);
            told
        }
        Err(error) => {
            warnings.push(format!("no diagnosis: {}", CliError::from(error)));
            (Value::Null, String::new())
        }
    };

    // only now, with everything decided, may the truth be looked at
    let truth = match &campaign.truth {
        None => None,
        Some(path) => Some(load_truth(&base.join(path))?),
    };
    let errors = match &validated {
        None => "no validation log: the errors on unseen data are not known\n".to_owned(),
        Some(found) => {
            let mut report = Report::new("");
            let caption = format!("torque on unseen data ({title})");
            stages::validate::told(&mut report.terminal(), &found.validation, &caption);
            report.text()
        }
    };
    let latest = refined.as_ref().unwrap_or(&model);
    let parameters = parameters(latest, truth.as_ref());
    let mut report = Report::new("");
    stages::lsq::fit_quality(&mut report.terminal(), &dynamics);
    let quality = report.text();
    let text = format!("{parameters}{quality}\n{errors}\n{lacking}");
    let truth_json = match &truth {
        None => Value::Null,
        Some(truth) => comparison(latest, truth),
    };
    let held = match diagnosed {
        None if !unseen.is_empty() => {
            pictures::in_memory(&machine, &role_logs.validation, context)?
        }
        _ => None,
    };
    let campaign_text = toml::to_string(campaign).unwrap_or_default();
    let page = pages::Identify {
        machine: &machine,
        campaign: (name, &campaign_text),
        friction: of_joints,
        fitted: &dynamics,
        declared: &model,
        refined: refined.as_ref(),
        numbers: &numbers,
        validated: validated.as_ref(),
        diagnosed: diagnosed.as_deref(),
        fault: at_fault.as_ref(),
        look: pictures::look(&machine, held.as_ref(), &names_of(&unseen))?,
        unseen: &unseen,
        logs: one_joint.iter().chain(&training).chain(&unseen).collect(),
        truth: &|p| true_value(truth.as_ref(), p),
        limit: campaign.settings.max_relative_error,
        inputs: &inputs,
        warnings: &warnings,
    };
    let residuals = match &diagnosed {
        None => String::new(),
        Some(found) => {
            let figure = pages::diagnose_figure(&machine, found)?.svg();
            write(folder, "residual.svg", &figure, &mut files)?;
            figure
        }
    };
    let page = pages::identify(&page, &residuals, context)?;
    context.check()?;
    write(folder, "report.html", &page, &mut files)?;
    write(folder, "summary.txt", &text, &mut files)?;
    files.push("result.json".into());
    let result = json!({
        "friction": of_joints,
        "lsq": dynamics,
        "validate": validated,
        "diagnose": diagnose_json,
        "truth": truth_json,
        "files": files,
    });
    let document = Document::new("identify", &inputs, &warnings, &result)?;
    write_whole(&folder.join("result.json"), |f| {
        f.write_all(document.text().as_bytes())
    })?;
    let missed = validated
        .as_ref()
        .map(|found| validate::missed(&found.validation, campaign.settings.max_relative_error));
    Ok(Outcome {
        text,
        document,
        missed: missed.unwrap_or_default(),
    })
}

/// Writes what a stage leaves; `unseen` names the validation logs.
fn keep(
    end: StageEnd,
    machine: &LoggedRobot,
    unseen: &str,
    folder: &Path,
    files: &mut Vec<String>,
) -> Result<(), CliError> {
    match end {
        StageEnd::Friction(found, model) => {
            write(folder, "friction.toml", &model.to_toml()?, files)?;
            let figure = stages::friction::figure(machine, found).svg();
            write(folder, "friction.svg", &figure, files)
        }
        StageEnd::Dynamics(_, model) => write(folder, "model.toml", &model.to_toml()?, files),
        StageEnd::Validated(found) => {
            let figure = stages::validate::figure(&found.validation, unseen).svg();
            write(folder, "validation.svg", &figure, files)
        }
        StageEnd::Refined(model) => write(folder, "refined.toml", &model.to_toml()?, files),
    }
}

fn write(folder: &Path, name: &str, text: &str, files: &mut Vec<String>) -> Result<(), CliError> {
    write_whole(&folder.join(name), |f| f.write_all(text.as_bytes()))?;
    files.push(name.to_owned());
    Ok(())
}

/// Reads the truth of simulated logs.
fn load_truth(path: &Path) -> Result<TruthFile, CliError> {
    let unusable = |e: &dyn std::fmt::Display| {
        CliError::input(format!("{}: {e}", path.display())).hint(
            "leave `truth` out of the campaign file, or name a .truth.toml that simulate wrote",
        )
    };
    let text = std::fs::read_to_string(path).map_err(|e| unusable(&e))?;
    toml::from_str(&text).map_err(|e| unusable(&e.message()))
}

/// The truth of a parameter, where it is known.
fn true_value(truth: Option<&TruthFile>, parameter: &Parameter) -> Option<f64> {
    truth?
        .parameters
        .iter()
        .find(|p| p.name == parameter.name && p.joint == parameter.joint)
        .map(|p| p.value)
}

/// Every parameter of the model, beside its truth where that is known.
fn parameters(model: &ModelFile, truth: Option<&TruthFile>) -> String {
    let rows: Vec<summary::Parameter> = model
        .parameters
        .iter()
        .map(|p| {
            let unknown = p.verdict == Some(Verdict::NotIdentifiable);
            summary::Parameter {
                joint: p.joint.as_deref().unwrap_or(""),
                name: &p.name,
                theta: p.theta,
                value: if unknown { f64::NAN } else { p.value },
                std: p.std.filter(|_| !unknown).unwrap_or(f64::NAN),
                unit: &p.unit,
                verdict: p.verdict.map_or("", Verdict::word),
                truth: true_value(truth, p),
            }
        })
        .collect();
    format!("{}\n", summary::parameters("identified parameters", &rows))
}

/// Parameters against their truth.
fn comparison(model: &ModelFile, truth: &TruthFile) -> Value {
    let rows: Vec<Value> = model
        .parameters
        .iter()
        .filter_map(|p| {
            let true_value = true_value(Some(truth), p)?;
            let off = p.std.map(|std| (p.value - true_value) / std);
            Some(json!({
                "name": p.name,
                "joint": p.joint,
                "theta": p.theta,
                "value": p.value,
                "std": p.std,
                "truth": true_value,
                "standard_deviations_off": off,
            }))
        })
        .collect();
    json!({ "parameters": rows, "effects": truth.effects })
}
