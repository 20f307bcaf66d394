//! `cft-ident compare`: two models of one robot beside each other, and on the same logs.

mod tables;

use std::path::{Path, PathBuf};

pub use tables::{apart_table, error_table, parameter_table};

use serde_json::{Value, json};

use super::{
    CliError, Context, Outcome, arguments, files, logs_of, names_of, outputs, pages, pictures,
};
use crate::identify::{self, Compared, Curves, DIFFERENT, GivenModel, Tried};
use crate::log::{LogSpec, escape};
use crate::number;
use crate::report::figure::{CurvePoint, OverlayFigure, OverlayPanel};
use crate::report::json::Document;
use crate::report::sections::friction::{curve, speeds};

const EXAMPLE: &str = "\
Example:
  cft-ident compare model.toml refined.toml
  cft-ident compare model.toml refined.toml unseen.csv --report compare.html";

/// Set two models of one robot side by side, and on the same logs.
///
/// Differences of parameters are told in standard deviations; errors on the logs with an interval of
/// their difference. Both models are judged with the log mapping and the filter of the first.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// First model file
    #[arg(value_name = "A.toml")]
    pub a: PathBuf,
    /// Second model file
    #[arg(value_name = "B.toml")]
    pub b: PathBuf,
    /// Logs that both models are tried on; a span is chosen by LOG@0..70%
    #[arg(value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Draw the friction curves over each other; may be given more than once
    #[arg(long, value_name = "FILE.svg|.png", value_parser = arguments::picture_file)]
    pub plot: Vec<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::html_file)]
    pub report: Option<PathBuf>,
}

impl Compared {
    /// Both curves of a joint at these speeds; an empty one where a model has no friction there.
    fn at(
        &self,
        curves: &Curves,
        speeds: impl Iterator<Item = f64> + Clone,
    ) -> [Vec<CurvePoint>; 2] {
        let of = |k: usize| match &curves.laws[k] {
            None => Vec::new(),
            Some(law) => curve(
                &self.sides[k].given.file,
                law,
                &curves.joint,
                speeds.clone(),
            ),
        };
        [of(0), of(1)]
    }

    /// Friction curves over each other.
    pub fn figure(&self) -> OverlayFigure {
        let panels = self.curves.iter().map(|curves| OverlayPanel {
            joint: curves.joint.clone(),
            speed_unit: curves.speed_unit.clone(),
            torque_unit: curves.torque_unit.clone(),
            curves: self.at(curves, speeds(curves.most).collect::<Vec<_>>().into_iter()),
        });
        let range = match self.curves.first().map(|c| c.speeds_from) {
            Some("logs") => "up to the fastest of the logs",
            Some("limits") => "up to the speed limit",
            _ => "speeds assumed, no log is given",
        };
        OverlayFigure {
            title: format!("Friction of two models, {range}"),
            names: [0, 1].map(|k| format!("{}: {}", LETTERS[k], self.name(k))),
            panels: panels.collect(),
        }
    }

    /// The verdict in words.
    pub fn words(&self) -> String {
        let rated = self
            .table
            .parameters
            .iter()
            .filter(|p| p.deviation.is_some());
        let (rated, different) = (rated.count(), self.different());
        let mut text = format!(
            "{} of {rated} parameters with known uncertainty differ by more than {DIFFERENT} \
             standard deviations",
            different.len()
        );
        if let Some(most) = different.first() {
            text += &format!(
                "; the most by {} of {}",
                number::significant(most.deviation.unwrap_or(f64::NAN).abs(), 3),
                key(&most.name, most.joint.as_deref())
            );
        }
        text.push('.');
        let Some(tried) = &self.tried else {
            return text;
        };
        let told = match tried.differences.overall.sign() {
            -1 => "B is closer on these logs",
            1 => "A is closer on these logs",
            _ => "these logs do not tell which model is closer",
        };
        let error = |k: usize| number::percent(tried.validations[k].overall.mean_relative_error);
        text += &format!(
            " Over joints A is off by {}, B by {}: {told}.",
            error(0),
            error(1)
        );
        text
    }
}

const LETTERS: [&str; 2] = ["A", "B"];

fn key(name: &str, joint: Option<&str>) -> String {
    match joint {
        Some(joint) => format!("{} of {}", escape(name), escape(joint)),
        None => escape(name),
    }
}

/// The JSON fields of the command.
fn json(of: &Compared) -> Value {
    let models: Vec<Value> = of
        .sides
        .iter()
        .map(|side| {
            let from = &side.given.file.provenance;
            json!({
                "name": side.given.provenance.name,
                "version": from.version,
                "command": from.command,
                "inputs": from.inputs,
            })
        })
        .collect();
    let friction: Vec<Value> = of
        .curves
        .iter()
        .map(|curves| {
            // 50 equal steps in each direction
            let steps = (-50..=50).filter(|k| *k != 0);
            let [a, b] = of.at(curves, steps.map(|k| f64::from(k) / 50.0 * curves.most));
            let points = (0..a.len().max(b.len())).map(|i| {
                let (a, b) = (a.get(i), b.get(i));
                json!({
                    "v": a.or(b).map(|p| p.v),
                    "a": a.map(|p| p.torque),
                    "a_std": a.map(|p| p.std),
                    "b": b.map(|p| p.torque),
                    "b_std": b.map(|p| p.std),
                })
            });
            json!({
                "joint": curves.joint,
                "speed_unit": curves.speed_unit,
                "torque_unit": curves.torque_unit,
                "speeds_from": curves.speeds_from,
                "curve": points.collect::<Vec<_>>(),
            })
        })
        .collect();
    json!({
        "models": models,
        "parameters": of.table.parameters,
        "only_in_a": of.table.only_in_a,
        "only_in_b": of.table.only_in_b,
        "friction": friction,
        "logs": of.tried.as_ref().map(|tried| json_of_logs(of, tried)),
    })
}

fn json_of_logs(of: &Compared, tried: &Tried) -> Value {
    let [a, b] = &tried.validations;
    let told = a
        .joints
        .iter()
        .zip(&b.joints)
        .zip(&tried.differences.joints);
    let joints: Vec<Value> = told
        .enumerate()
        .map(|(j, ((a, b), d))| {
            let error = |e: &crate::validate::JointError| {
                json!({
                    "rmse": e.rmse,
                    "relative_error": e.relative_error,
                    "relative_error_raw": e.relative_error_raw,
                    "max_abs": e.max_abs,
                    "r2": e.r2,
                    "samples": e.samples,
                })
            };
            json!({
                "joint": a.joint,
                "unit": of.machine.file.torque_unit(j),
                "a": error(a),
                "b": error(b),
                "difference": d.difference,
                "interval_95": d.interval_95,
            })
        })
        .collect();
    let overall = tried.differences.overall;
    json!({
        "joints": joints,
        "overall": {
            "a": a.overall,
            "b": b.overall,
            "difference": overall.difference,
            "interval_95": overall.interval_95,
        },
        "processing": tried.held.summary,
    })
}

/// Runs the command.
///
/// # Errors
/// Every [`CliError`]; nothing is written then.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let logs = args.logs.iter().map(|l| l.path.as_path());
    let inputs: Vec<&Path> = logs.chain([args.a.as_path(), args.b.as_path()]).collect();
    let outputs = outputs::listed(None, &args.plot, args.report.as_deref());
    context.check_outputs(&inputs, &outputs)?;
    let given = |path: &Path| {
        let given = files::model(path)?;
        Ok::<_, CliError>(GivenModel {
            name: given.name,
            file: given.value,
            provenance: given.provenance,
        })
    };
    let models = [given(&args.a)?, given(&args.b)?];
    let of = identify::compare(models, &logs_of(&args.logs), context.control())?;
    let names: Vec<String> = args.logs.iter().map(|l| escape(&l.name())).collect();
    let title = names.join(", ");
    if of.curves.is_empty() && !args.plot.is_empty() {
        return Err(
            CliError::input("neither model has a friction law: there is nothing to draw")
                .hint("leave --plot out; --report shows the rest"),
        );
    }
    let mut read: Vec<_> = of
        .sides
        .iter()
        .map(|s| s.given.provenance.clone())
        .collect();
    if let Some(tried) = &of.tried {
        read.extend(tried.held.inputs.iter().cloned());
    }
    let document = Document::new("compare", &read, &of.warnings, &json(&of))?;
    let page = match &args.report {
        None => None,
        Some(path) => {
            let held = of.tried.as_ref().map(|t| &t.held);
            let specs: Vec<&LogSpec> = args.logs.iter().collect();
            let page = pages::Compare {
                of: &of,
                logs: &specs,
                title: &title,
                read: &read,
                look: pictures::look(&of.machine, held, &names_of(&args.logs))?,
            };
            Some((path, pages::compare(&page, context)?))
        }
    };
    context.check()?;
    if let Some((path, page)) = &page {
        outputs::write_text(path, page)?;
    }
    for path in &args.plot {
        outputs::write_picture(path, &of.figure().svg())?;
    }
    Ok(Outcome {
        text: tables::text(&of, &title),
        document,
        missed: Vec::new(),
    })
}
