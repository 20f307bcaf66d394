//! `cft-ident identify`: the whole way from logs to a validated model.

use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde_json::{Value, json};

use super::pages::{self, Look, held_for_pictures};
use super::{
    CliError, Context, Outcome, campaign, diagnose, diagnose_fault, diagnose_text, friction,
    logs_of, lsq, validate,
};
use crate::config::model_file::Parameter;
use crate::config::{self, Campaign, ModelFile};
use crate::identify::{
    self, DiagnoseEnd, DiagnoseLogs, DiagnoseSettings, ErrorKind, FrictionSettings, LoggedRobot,
    LsqSettings, new_model, refined,
};
use crate::log::{LogSpec, Provenance};
use crate::output::write_whole;
use crate::report::json::Document;
use crate::report::summary;
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
    let mut inputs: Vec<Provenance> = Vec::new();
    let mut text = String::new();

    // friction of single joints, where there are logs of it
    let one_joint = logs(base, &roles.friction)?;
    let found = match one_joint.as_slice() {
        [] => None,
        some => Some(identify::friction(
            &machine,
            &logs_of(some),
            &FrictionSettings::default(),
            context.control(),
        )?),
    };
    let mut friction_json = Value::Null;
    let known = match &found {
        None => None,
        Some(found) => {
            let mut model = new_model(&machine, "identify", &found.inputs);
            found.write_into(&machine, &mut model);
            write(folder, "friction.toml", &model.to_toml()?, &mut files)?;
            let figure = friction::figure(&machine, found).svg();
            write(folder, "friction.svg", &figure, &mut files)?;
            friction_json = friction::json(&machine, found);
            warnings.extend(found.warnings.iter().cloned());
            inputs.extend(found.inputs.iter().cloned());
            Some(model)
        }
    };

    // inertias
    let settings = LsqSettings {
        estimator: campaign.settings.estimator,
        consistent: campaign.settings.feasible,
        friction: known.as_ref().map(|model| ("friction.toml", model)),
    };
    let together = logs_of(&logs(base, &roles.identification)?);
    let fitted = identify::lsq(&machine, &together, &settings, context.control())?;
    let model = fitted.model(&machine, known.as_ref());
    write(folder, "model.toml", &model.to_toml()?, &mut files)?;
    warnings.extend(fitted.warnings.iter().cloned());
    inputs.extend(fitted.inputs.iter().cloned());

    // torque on logs that were not used
    let unseen = logs(base, &roles.validation)?;
    let mut validated = None;
    let mut validate_json = Value::Null;
    let mut missed = Vec::new();
    let mut errors = String::from("no validation log: the errors on unseen data are not known\n");
    let numbers = refined(&model, "model.toml")?;
    if !unseen.is_empty() {
        let found = identify::validate(
            &machine,
            &numbers,
            &logs_of(&unseen),
            context.control(),
            &mut |_, _| {},
        )?;
        let names: Vec<String> = unseen.iter().map(LogSpec::name).collect();
        let title = names.join(", ");
        let figure = validate::figure(&machine, &found.validation, &title).svg();
        write(folder, "validation.svg", &figure, &mut files)?;
        validate_json = validate::json(&machine, &found.validation);
        errors = validate::text(
            &machine,
            &found.validation,
            &format!("torque on unseen data ({title})"),
        );
        missed = validate::missed(&found.validation, campaign.settings.max_relative_error);
        warnings.extend(found.warnings.iter().cloned());
        inputs.extend(found.inputs.iter().cloned());
        validated = Some(found);
    }

    // what the declared model lacks; the validation logs decide nothing
    let mut refined_model = None;
    let mut diagnose_json = Value::Null;
    let mut lacking = String::new();
    let (mut diagnosed, mut at_fault) = (None, None);
    let mut training = logs(base, &roles.identification)?;
    // friction is fitted again beside an effect, from the logs that it came from
    training.extend(one_joint.iter().cloned());
    let (fitted_to, decided) = (logs_of(&training), logs_of(&unseen));
    let roles = DiagnoseLogs {
        train: &fitted_to,
        veto: &[],
        holdout: &decided,
    };
    let settings = DiagnoseSettings::default();
    match identify::diagnose(
        &machine,
        ("model.toml", &model),
        &roles,
        &settings,
        context.control(),
    ) {
        Ok(DiagnoseEnd::DataFault(fault)) => {
            diagnose_json = diagnose_fault::json(&fault);
            lacking = diagnose_fault::text(&fault);
            at_fault = Some(fault);
        }
        Ok(DiagnoseEnd::Diagnosed(found)) => {
            diagnose_json = diagnose::json(&machine, &found);
            lacking = diagnose_text::text(&machine, &found, "model.toml");
            if !found.diagnosis.steps.is_empty() {
                let refined = found.model(&machine, &model);
                write(folder, "refined.toml", &refined.to_toml()?, &mut files)?;
                refined_model = Some(refined);
            }
            diagnosed = Some(found);
        }
        // logs too short to look for effects are no reason to lose the fit
        Err(error) if error.kind() == ErrorKind::Undetermined => {
            warnings.push(format!("no diagnosis: {}", CliError::from(error)));
        }
        Err(error) => return Err(error.into()),
    }

    // only now, with everything decided, may the truth be looked at
    let truth = match &campaign.truth {
        None => None,
        Some(path) => Some(load_truth(&base.join(path))?),
    };
    text += &parameters(refined_model.as_ref().unwrap_or(&model), truth.as_ref());
    text += &lsq::quality(&machine, &fitted);
    text.push('\n');
    text += &errors;
    text.push('\n');
    text += &lacking;
    let truth_json = match &truth {
        None => Value::Null,
        Some(truth) => comparison(refined_model.as_ref().unwrap_or(&model), truth),
    };
    let held = match diagnosed {
        None if !unseen.is_empty() => held_for_pictures(&machine, &logs_of(&unseen), context)?,
        _ => None,
    };
    let look = held.as_ref().map(|held| {
        let names = unseen.iter().map(LogSpec::name);
        Look::new(&machine, held, names)
    });
    let campaign_text = toml::to_string(campaign).unwrap_or_default();
    let page = pages::Identify {
        machine: &machine,
        campaign: (name, &campaign_text),
        friction: found.as_ref(),
        fitted: &fitted,
        declared: &model,
        refined: refined_model.as_ref(),
        numbers: &numbers,
        validated: validated.as_ref(),
        diagnosed: diagnosed.as_deref(),
        fault: at_fault.as_ref(),
        look: look.transpose()?,
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
        "friction": friction_json,
        "lsq": lsq::json(&machine, &fitted),
        "validate": validate_json,
        "diagnose": diagnose_json,
        "truth": truth_json,
        "files": files,
    });
    let document = Document::new("identify", &inputs, &warnings, &result)?;
    write_whole(&folder.join("result.json"), |f| {
        f.write_all(document.text().as_bytes())
    })?;
    Ok(Outcome {
        text,
        document,
        missed,
    })
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
