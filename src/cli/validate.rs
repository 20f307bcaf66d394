//! `cft-ident validate`: the torque of a log that was not used, reconstructed by a model.

use std::path::{Path, PathBuf};

use super::{CliError, Context, Outcome, arguments, files, logs_of, names_of, outputs, pictures};
use crate::identify::{self, LoggedRobot, refined};
use crate::log::LogSpec;
use crate::number;
use crate::output::LogWriter;
use crate::report::json::Document;
use crate::report::stages;
use crate::validate::{Reconstructed, Validation};

const EXAMPLE: &str = "\
Example:
  cft-ident validate unseen.csv -m model.toml --plot unseen.svg
  cft-ident validate unseen.csv -m model.toml --max-relative-error 0.02";

/// Reconstruct the torque of logs that were not used, and say how far it is off.
///
/// The model file carries its robot and the processing that it was made with.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// End with status 1 when a joint's relative error is above X, a fraction
    #[arg(long, value_name = "X", value_parser = arguments::positive)]
    pub max_relative_error: Option<f64>,
    /// Write measured and reconstructed torque and the residual
    #[arg(short, long, value_name = "RESIDUAL.csv|.mcap", value_parser = arguments::log_file)]
    pub output: Option<PathBuf>,
    /// Draw measured and reconstructed torque; may be given more than once
    #[arg(long, value_name = "FILE.svg|.png", value_parser = arguments::picture_file)]
    pub plot: Vec<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::html_file)]
    pub report: Option<PathBuf>,
}

/// Joints that miss a limit on the relative error.
pub fn missed(validation: &Validation, limit: Option<f64>) -> Vec<String> {
    let Some(limit) = limit else {
        return Vec::new();
    };
    validation
        .joints
        .iter()
        // an error that is not a number is no error within the limit
        .filter(|e| e.relative_error.is_nan() || e.relative_error > limit)
        .map(|e| {
            format!(
                "{}: relative error {} is above {}",
                e.joint,
                number::percent(e.relative_error),
                number::percent(limit)
            )
        })
        .collect()
}

/// Columns of the residual file: measured, reconstructed and residual torque of every joint.
fn columns(joints: &[String]) -> Vec<String> {
    let kinds = ["tau", "tau_hat", "residual"];
    let named = kinds
        .iter()
        .flat_map(|kind| joints.iter().map(move |joint| format!("{kind}_{joint}")));
    std::iter::once("t".to_owned()).chain(named).collect()
}

fn residual_row(r: &Reconstructed) -> impl Iterator<Item = f64> {
    let residual = r.measured.iter().zip(r.reconstructed).map(|(a, b)| a - b);
    let torques = r.measured.iter().chain(r.reconstructed).copied();
    std::iter::once(r.t).chain(torques).chain(residual)
}

/// Runs the command.
///
/// # Errors
/// Every [`CliError`]; nothing is written then.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs: Vec<&Path> = args
        .logs
        .iter()
        .map(|l| l.path.as_path())
        .chain([args.model.as_path()])
        .collect();
    let outputs = outputs::listed(args.output.as_deref(), &args.plot, args.report.as_deref());
    context.check_outputs(&inputs, &outputs)?;
    let given = files::model(&args.model, context)?;
    let (name, file) = (given.name, given.value);
    let model = refined(&file, &name)?;
    let machine = LoggedRobot::new(&name, file.robot.clone());
    let mut residual = match &args.output {
        None => None,
        Some(path) => Some(LogWriter::create(
            path,
            &columns(machine.robot.joint_names()),
        )?),
    };
    let mut failed = None;
    let logs = logs_of(&args.logs);
    let found = identify::validate(
        &machine,
        &model,
        &logs,
        context.control(),
        &mut |r, origin| {
            if let Some(file) = &mut residual
                && failed.is_none()
            {
                file.set_origin(origin);
                failed = file.row(residual_row(r)).err();
            }
        },
    )?;
    if let Some(error) = failed {
        return Err(error.into());
    }
    let names = names_of(&args.logs);
    let document = Document::new("validate", &found.inputs, &found.warnings, &found)?;
    let of = stages::validate::Validate {
        machine: &machine,
        file: &file,
        model: &model,
        logs: &names,
        found: &found,
        limit: args.max_relative_error,
        given: &given.provenance,
    };
    let mut report = stages::validate::validate(&of);
    if args.report.is_some() {
        let in_memory = pictures::in_memory(&machine, &logs, context)?;
        let look = pictures::look(&machine, in_memory.as_ref(), &names)?;
        let quality = pictures::inspected(&args.logs, &machine, context)?;
        let mut page = report.page();
        stages::validate::pictures(&mut page, &of, look.as_ref(), &quality, context.command())
            .map_err(CliError::input)?;
    }
    context.check()?;
    if let Some(path) = &args.report {
        context.write_text(path, &report.html())?;
    }
    for path in &args.plot {
        let figure = stages::validate::figure(&found.validation, &names.join(", "));
        context.write_picture(path, &figure.svg())?;
    }
    if let Some(file) = residual {
        context.files().add_log(file)?;
    }
    Ok(Outcome {
        text: report.text_for(context.detail()),
        document,
        missed: missed(&found.validation, args.max_relative_error),
    })
}
