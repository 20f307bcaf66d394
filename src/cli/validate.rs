//! `cft-ident validate`: the torque of a log that was not used, reconstructed by a model.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::lsq::processing;
use super::pages::{self, Look, held_for_pictures};
use super::{CliError, Context, Outcome, arguments, files, logs_of, outputs};
use crate::identify::{self, LoggedRobot, refined};
use crate::log::LogSpec;
use crate::number;
use crate::output::LogWriter;
use crate::report::figure::{JointTorque, TorqueFigure};
use crate::report::json::Document;
use crate::report::summary;
use crate::report::table::{hanging, unbroken};
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

/// The JSON fields of the command.
pub fn json(machine: &LoggedRobot, validation: &Validation) -> Value {
    let joints: Vec<Value> = validation
        .joints
        .iter()
        .enumerate()
        .map(|(j, e)| {
            let mut joint = json!(e);
            joint["unit"] = machine.file.torque_unit(j).into();
            joint
        })
        .collect();
    json!({
        "joints": joints,
        "overall": validation.overall,
        "processing": processing(&validation.summary),
    })
}

/// The table for a person.
pub fn text(machine: &LoggedRobot, validation: &Validation, caption: &str) -> String {
    let rows: Vec<summary::TorqueError> = validation
        .joints
        .iter()
        .enumerate()
        .map(|(j, e)| summary::TorqueError {
            joint: &e.joint,
            unit: machine.file.torque_unit(j),
            relative_error: e.relative_error,
            rmse: e.rmse,
            max_abs: e.max_abs,
            r2: e.r2,
            samples: e.samples,
        })
        .collect();
    let raw: Vec<String> = validation
        .joints
        .iter()
        .map(|e| {
            unbroken(&format!(
                "{} {}",
                e.joint,
                number::percent(e.relative_error_raw)
            ))
        })
        .collect();
    let overall = format!(
        "over joints {}; before the parallel filter: {}",
        number::percent(validation.overall.mean_relative_error),
        raw.join(", ")
    );
    format!(
        "{}\n{}",
        summary::torque_errors(caption, &rows),
        hanging("", &overall, 2)
    )
}

/// Measured and reconstructed torque over time (Figures 7 and 8 of the report).
pub fn figure(machine: &LoggedRobot, validation: &Validation, title: &str) -> TorqueFigure {
    let traces = &validation.traces;
    let n = validation.joints.len();
    let joints = validation
        .joints
        .iter()
        .enumerate()
        .map(|(j, e)| {
            let mut joint = JointTorque {
                joint: e.joint.clone(),
                unit: machine.file.torque_unit(j).to_owned(),
                t: Vec::with_capacity(traces.t.len()),
                measured: Vec::with_capacity(traces.t.len()),
                reconstructed: Vec::with_capacity(traces.t.len()),
                relative_error: e.relative_error,
                rmse: e.rmse,
            };
            for (k, t) in traces.t.iter().enumerate() {
                if k > 0 && traces.breaks.contains(&k) {
                    // a row that is not finite parts the lines at a gap
                    joint.t.push(*t);
                    joint.measured.push(f64::NAN);
                    joint.reconstructed.push(f64::NAN);
                }
                joint.t.push(*t);
                joint.measured.push(traces.measured[k * n + j]);
                joint.reconstructed.push(traces.reconstructed[k * n + j]);
            }
            joint
        })
        .collect();
    TorqueFigure {
        title: title.to_owned(),
        joints,
    }
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
    let given = files::model(&args.model)?;
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
    let validation = &found.validation;
    let title = args
        .logs
        .iter()
        .map(LogSpec::name)
        .collect::<Vec<_>>()
        .join(", ");
    let document = Document::new(
        "validate",
        &found.inputs,
        &found.warnings,
        &json(&machine, validation),
    )?;
    let text = text(
        &machine,
        validation,
        &format!("torque of {title} by {name}"),
    );
    let page = match &args.report {
        None => None,
        Some(path) => {
            let held = held_for_pictures(&machine, &logs, context)?;
            let held = held.as_ref();
            let look = held
                .map(|held| Look::new(&machine, held, args.logs.iter().map(LogSpec::name)))
                .transpose()?;
            let of = pages::Validate {
                machine: &machine,
                file: &file,
                model: &model,
                logs: &args.logs,
                found: &found,
                limit: args.max_relative_error,
                given: given.provenance,
                look,
            };
            Some((path, pages::validate(&of, context)?))
        }
    };
    context.check()?;
    if let Some((path, page)) = &page {
        outputs::write_text(path, page)?;
    }
    for path in &args.plot {
        outputs::write_picture(path, &figure(&machine, validation, &title).svg())?;
    }
    if let Some(file) = residual {
        file.commit()?;
    }
    Ok(Outcome {
        text,
        document,
        missed: missed(validation, args.max_relative_error),
    })
}
