//! `cft-ident compare`: two models of one robot beside each other, and on the same logs.

mod tables;

use std::path::{Path, PathBuf};

pub use tables::{apart_table, error_table, parameter_table};

use serde_json::{Value, json};

use super::files::Given;
use super::lsq::processing;
use super::pages::{self, Look, curve, speeds};
use super::{CliError, Context, Outcome, arguments, files, logs_of, outputs};
use crate::compare::{self, ErrorDifferences, ParameterPair, SideBySide};
use crate::config::ModelFile;
use crate::effect::AugmentedModel;
use crate::identify::{InMemory, LoggedRobot, read_whole, refined, refined_or_friction};
use crate::log::{LogSpec, escape};
use crate::motion::Parallel;
use crate::number;
use crate::report::figure::{CurvePoint, OverlayFigure, OverlayPanel};
use crate::report::json::Document;
use crate::robot::model::JointFriction;
use crate::validate::{Reconstruction, Validation};

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

/// Deviation from which on two estimates are called different: 95 % of a normal distribution.
pub const DIFFERENT: f64 = 1.96;

/// A model file with what it stands for.
pub struct Side {
    pub given: Given<ModelFile>,
    pub model: AugmentedModel,
}

/// Both models on the same logs.
pub struct Tried {
    pub held: InMemory,
    pub validations: [Validation; 2],
    pub differences: ErrorDifferences,
}

/// Result of the comparison.
pub struct Compared {
    pub machine: LoggedRobot,
    pub sides: [Side; 2],
    pub table: SideBySide,
    pub curves: Vec<Curves>,
    /// None where no log is given.
    pub tried: Option<Tried>,
    pub warnings: Vec<String>,
}

/// Friction of one joint by both models.
pub struct Curves {
    pub joint: String,
    pub speed_unit: String,
    pub torque_unit: String,
    /// Largest speed of the curves, and where it is from.
    pub most: f64,
    pub speeds_from: &'static str,
    laws: [Option<JointFriction>; 2],
}

/// A model file; without logs one of friction alone will do.
fn side(path: &Path, logs: bool) -> Result<Side, CliError> {
    let given = files::model(path)?;
    let model = match logs {
        true => refined(&given.value, &given.name)?,
        false => refined_or_friction(&given.value, &given.name)?,
    };
    Ok(Side { given, model })
}

/// Refuses two models whose parameters and torques are not of one robot.
fn one_robot([a, b]: [&Side; 2]) -> Result<(), CliError> {
    let describe = |side: &Side| {
        let (robot, file) = (&side.model.model.robot, &side.given.value.robot);
        let joints = robot.joint_names().iter().enumerate();
        let words = joints.map(|(j, name)| {
            let position = robot.joint_kind(j).position_unit();
            format!("{} ({position}, {})", escape(name), file.torque_unit(j))
        });
        words.collect::<Vec<_>>().join(", ")
    };
    let (ours, theirs) = (describe(a), describe(b));
    if ours == theirs {
        return Ok(());
    }
    Err(CliError::input(format!(
        "{} and {} are models of different robots: the joints are {ours} in the first and {theirs} \
         in the second",
        a.given.name, b.given.name
    ))
    .hint("give two models that were identified on one robot"))
}

/// What a reader has to know before believing a difference.
fn cautions([a, b]: [&Side; 2], logs: bool) -> Vec<String> {
    let mut out = Vec::new();
    let (first, second) = (&a.given.value, &b.given.value);
    let made = |file: &ModelFile| file.provenance.inputs.clone();
    let shared: Vec<String> = made(first)
        .iter()
        .filter(|i| i.samples > 0)
        .filter(|i| made(second).iter().any(|o| o.sha256 == i.sha256))
        .map(|i| escape(&i.name))
        .collect();
    if !shared.is_empty() {
        out.push(format!(
            "both models are made from {}: their errors are not independent, so differences in \
             standard deviations are a hint and no test",
            shared.join(", ")
        ));
    }
    if logs && first.robot.robot.setup != second.robot.robot.setup {
        out.push("the models are of different set-ups; the logs are read as the first says".into());
    }
    if logs && first.robot.log != second.robot.log {
        out.push("the models map logs differently; the logs are read as the first says".into());
    }
    if logs && first.robot.filter != second.robot.filter {
        out.push(
            "the models declare different filters; both are judged with that of the first".into(),
        );
    }
    out
}

/// Compares two models.
///
/// # Errors
/// Files and logs that cannot be used, and models of different robots.
pub fn compare(
    a: &Path,
    b: &Path,
    logs: &[LogSpec],
    context: &Context,
) -> Result<Compared, CliError> {
    let sides = [side(a, !logs.is_empty())?, side(b, !logs.is_empty())?];
    one_robot(sides.each_ref())?;
    let first = &sides[0].given;
    let machine = LoggedRobot::new(&first.name, first.value.robot.clone());
    let mut warnings = cautions(sides.each_ref(), !logs.is_empty());
    let tried = match logs {
        [] => None,
        logs => Some(on_logs(&machine, &sides, logs, context)?),
    };
    if let Some(tried) = &tried {
        warnings.extend(tried.held.warnings.iter().cloned());
    }
    Ok(Compared {
        table: compare::side_by_side(&sides[0].given.value, &sides[1].given.value),
        curves: curves(&machine, &sides, tried.as_ref()),
        machine,
        sides,
        tried,
        warnings,
    })
}

fn on_logs(
    machine: &LoggedRobot,
    sides: &[Side; 2],
    logs: &[LogSpec],
    context: &Context,
) -> Result<Tried, CliError> {
    let held = read_whole(machine, &logs_of(logs), context.control())?;
    let settings = machine.settings();
    let named = |error| CliError::input(format!("{}: {error}", machine.name));
    let validation = |side: &Side| {
        let mut all = Reconstruction::new(&side.model.model);
        for (segment, stretch) in held.stretches.iter().enumerate() {
            let hat = side.model.reconstruct(stretch);
            all.add_stretch(&settings, segment, stretch, &hat, &mut |_| {})
                .map_err(named)?;
        }
        Ok::<_, CliError>(all.finish(held.summary.clone()))
    };
    let validations = [validation(&sides[0])?, validation(&sides[1])?];
    context.check()?;
    let parallel = Parallel::design(&settings, held.summary.dt).map_err(named)?;
    let models = sides.each_ref().map(|side| &side.model);
    let differences = compare::differences(models, &held.stretches, &parallel).map_err(named)?;
    Ok(Tried {
        held,
        validations,
        differences,
    })
}

/// Friction of the joints where a model has some.
fn curves(machine: &LoggedRobot, sides: &[Side; 2], tried: Option<&Tried>) -> Vec<Curves> {
    let robot = &machine.robot;
    let joints = robot.joint_names().iter().enumerate();
    joints
        .filter_map(|(j, joint)| {
            let laws = sides.each_ref().map(|side| {
                let law = side.model.model.friction.get(j).copied();
                law.filter(|law| *law != JointFriction::None)
            });
            laws.iter().flatten().next()?;
            let seen = tried.and_then(|tried| {
                let all = tried.held.stretches.iter().filter_map(|s| s.v.get(j));
                let most = all.flatten().fold(0.0, |most: f64, v| most.max(v.abs()));
                (most > 0.0).then_some(most)
            });
            let limit = |side: &Side| side.given.value.robot.limits.get(joint)?.speed;
            let limit = || sides.iter().find_map(limit);
            let (most, speeds_from) = match seen {
                Some(most) => (most, "logs"),
                None => limit().map_or((1.0, "assumed"), |most| (most, "limits")),
            };
            Some(Curves {
                joint: joint.clone(),
                speed_unit: format!("{}/s", robot.joint_kind(j).position_unit()),
                torque_unit: machine.file.torque_unit(j).to_owned(),
                most,
                speeds_from,
                laws,
            })
        })
        .collect()
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
                &self.sides[k].given.value,
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

    /// Name of a model's file.
    pub fn name(&self, side: usize) -> String {
        escape(&self.sides[side].given.provenance.name)
    }

    /// Parameters that differ by more than chance explains, the largest deviation first.
    pub fn different(&self) -> Vec<&ParameterPair> {
        let beyond = |p: &&ParameterPair| p.deviation.is_some_and(|d| d.abs() > DIFFERENT);
        let mut found: Vec<&ParameterPair> = self.table.parameters.iter().filter(beyond).collect();
        let size = |p: &ParameterPair| p.deviation.unwrap_or(0.0).abs();
        found.sort_by(|x, y| size(y).total_cmp(&size(x)));
        found
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
            let from = &side.given.value.provenance;
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
        "processing": processing(&tried.held.summary),
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
    let of = compare(&args.a, &args.b, &args.logs, context)?;
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
            let logs = args.logs.iter().map(LogSpec::name);
            let look = of
                .tried
                .as_ref()
                .map(|t| Look::new(&of.machine, &t.held, logs));
            let specs: Vec<&LogSpec> = args.logs.iter().collect();
            let page = pages::Compare {
                of: &of,
                logs: &specs,
                title: &title,
                read: &read,
                look: look.transpose()?,
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
