//! `cft-ident friction`: the friction of single joints from one-joint logs.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::{CliError, Context, Outcome, arguments, files, logs_of, outputs, pages};
use crate::config::identified::friction_unit;
use crate::friction::estimate::curve_std;
use crate::identify::{self, FrictionSettings, IdentifiedFriction, LoggedRobot, new_model};
use crate::log::LogSpec;
use crate::math::descent::Ending;
use crate::number;
use crate::report::figure::{CurvePoint, FrictionFigure, FrictionPanel};
use crate::report::json::Document;
use crate::report::summary;
use crate::robot::friction::DoubleTanh;
use crate::verdict::Verdict;

const EXAMPLE: &str = "\
Example:
  cft-ident friction q1.csv q2.csv q4.csv q5.csv -r configs/cft.toml -o f.toml
  cft-ident friction q4.csv -r configs/cft.toml --joint q4 -m f.toml -o g.toml";

/// Estimate the friction of single joints by a continuous-discrete extended Kalman filter.
///
/// Each log is a one-joint experiment: the joint moves over its range at several speeds and with
/// reversals, the others stay nearly still. Several logs of one joint are used together.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE, override_usage = "cft-ident friction [OPTIONS] -r ROBOT.toml -o MODEL.toml LOG...")]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Robot file, or a built-in one such as configs/cft.toml
    #[arg(short, long, value_name = "ROBOT.toml")]
    pub robot: String,
    /// The joint that the logs move [default: found from the data]
    #[arg(long, value_name = "NAME")]
    pub joint: Option<String>,
    /// Model whose other joints are kept
    #[arg(short, long, value_name = "OLD.toml")]
    pub model: Option<PathBuf>,
    /// Model file to write
    #[arg(short, long, value_name = "MODEL.toml")]
    pub output: PathBuf,
    /// Draw the friction curves; may be given more than once
    #[arg(long, value_name = "FILE.svg|.png", value_parser = arguments::picture_file)]
    pub plot: Vec<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::html_file)]
    pub report: Option<PathBuf>,
    /// Seed of the starting points
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

/// The JSON fields of the command.
pub fn json(machine: &LoggedRobot, found: &IdentifiedFriction) -> Value {
    let joints: Vec<Value> = found
        .joints
        .iter()
        .map(|(j, e)| {
            let mut parameters = serde_json::Map::new();
            for (k, name) in DoubleTanh::NAMES.iter().enumerate() {
                let v = &e.values[k];
                let known = v.verdict != Verdict::NotIdentifiable;
                parameters.insert(
                    (*name).to_owned(),
                    json!({
                        "value": known.then_some(v.value),
                        "std": known.then_some(v.std),
                        "unit": friction_unit(&machine.robot, *j, name, machine.file.torque_unit(*j)),
                        "theta": machine.robot.friction_theta(*j, k),
                        "verdict": v.verdict,
                    }),
                );
            }
            json!({
                "joint": machine.robot.joint_names()[*j],
                "converged": e.ending == Ending::Converged,
                "ending": e.ending,
                "starts": e.starts,
                "parameters": parameters,
                "nuisance": e.nuisance,
                "speeds_covered": e.speeds.covered,
                "curve": e.curve,
                "plateaus": e.plateaus,
                "nis": e.nis,
                "noise": {"torque_std": e.torque_noise, "position_variance_factor": e.position_factor},
                "widening": e.widening,
                "rmse": e.rmse,
                "relative_error": e.relative_error,
                "samples": e.samples,
            })
        })
        .collect();
    json!({ "joints": joints })
}

/// The tables for a person.
pub fn text(machine: &LoggedRobot, found: &IdentifiedFriction) -> String {
    let mut out = String::new();
    for (j, e) in &found.joints {
        let joint = &machine.robot.joint_names()[*j];
        let units: Vec<String> = DoubleTanh::NAMES
            .iter()
            .map(|n| friction_unit(&machine.robot, *j, n, machine.file.torque_unit(*j)))
            .collect();
        let rows: Vec<summary::Parameter> = (0..5)
            .map(|k| {
                let v = &e.values[k];
                let known = v.verdict != Verdict::NotIdentifiable;
                summary::Parameter {
                    joint,
                    name: DoubleTanh::NAMES[k],
                    theta: machine.robot.friction_theta(*j, k),
                    value: if known { v.value } else { f64::NAN },
                    std: if known { v.std } else { f64::NAN },
                    unit: &units[k],
                    verdict: v.verdict.word(),
                    truth: None,
                }
            })
            .collect();
        let caption = format!(
            "friction of {joint}: speeds {} to {} {}/s, residual {} ({})",
            number::significant(e.speeds.covered[0], 2),
            number::significant(e.speeds.covered[1], 3),
            machine.robot.joint_kind(*j).position_unit(),
            number::percent(e.relative_error),
            format_args!(
                "{} {}, NIS {:.2}",
                number::significant(e.rmse, 3),
                machine.file.torque_unit(*j),
                e.nis.mean
            ),
        );
        out += &format!("{}\n", summary::parameters(&caption, &rows));
    }
    out
}

/// Velocities at which a curve is drawn, from the most negative to the most positive: in equal
/// ratios, for the law bends close to 0, and in equal steps.
fn speeds_to_draw([low, high]: [f64; 2]) -> impl Iterator<Item = f64> {
    const POINTS: usize = 80;
    let slowest = (0.1 * low).max(1e-4 * high);
    let share = |k: usize| k as f64 / (POINTS - 1) as f64;
    let ratios = (0..POINTS).map(|k| slowest * (high / slowest).powf(share(k)));
    let steps = (0..POINTS).map(|k| low + (high - low) * share(k));
    let mut speeds: Vec<f64> = ratios.chain(steps).collect();
    speeds.sort_by(f64::total_cmp);
    let down: Vec<f64> = speeds.iter().rev().map(|v| -v).collect();
    down.into_iter().chain([0.0]).chain(speeds)
}

/// The friction curves with their bands and the plateau map.
pub fn figure(machine: &LoggedRobot, found: &IdentifiedFriction) -> FrictionFigure {
    let panels = found
        .joints
        .iter()
        .map(|(j, e)| FrictionPanel {
            joint: machine.robot.joint_names()[*j].clone(),
            note: format!("NIS {:.2}", e.nis.mean),
            speed_unit: format!("{}/s", machine.robot.joint_kind(*j).position_unit()),
            torque_unit: machine.file.torque_unit(*j).to_owned(),
            curve: speeds_to_draw(e.speeds.covered)
                .map(|v| CurvePoint {
                    v,
                    torque: e.law.torque(v),
                    std: curve_std(&e.law, &e.covariance, v),
                })
                .collect(),
            covered: vec![
                [-e.speeds.covered[1], -e.speeds.covered[0]],
                e.speeds.covered,
            ],
            plateaus: e
                .plateaus
                .iter()
                .map(|p| CurvePoint {
                    v: p.v,
                    torque: p.torque,
                    std: p.std,
                })
                .collect(),
            truth: Vec::new(),
        })
        .collect();
    FrictionFigure {
        title: "Friction by the Kalman filter".into(),
        panels,
    }
}

/// Runs the command.
///
/// # Errors
/// Every [`CliError`]; nothing is written then.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let inputs: Vec<&Path> = args.logs.iter().map(|l| l.path.as_path()).collect();
    let outputs = outputs::listed(Some(&args.output), &args.plot, args.report.as_deref());
    context.check_outputs(&inputs, &outputs)?;
    let robot = files::robot(Path::new(&args.robot))?;
    let machine = LoggedRobot::new(&args.robot, robot.value);
    let mut given = vec![robot.provenance];
    let old = match &args.model {
        None => None,
        Some(path) => {
            let model = files::model_of(path, &machine.file)?;
            given.push(model.provenance);
            Some(model.value)
        }
    };
    let settings = FrictionSettings {
        joint: args.joint.clone(),
    };
    let logs = logs_of(&args.logs);
    let found = identify::friction(&machine, &logs, &settings, context.control())?;
    let mut model = new_model(&machine, "friction", &found.inputs);
    if let Some(old) = old {
        model.parameters = old.parameters;
        model.covariance = old.covariance;
        model.residual_std = old.residual_std;
        model.effects = old.effects;
    }
    found.write_into(&machine, &mut model);
    let document = Document::new(
        "friction",
        &found.inputs,
        &found.warnings,
        &json(&machine, &found),
    )?;
    let mut text = text(&machine, &found);
    if let Some(path) = &args.report {
        let page = pages::FrictionFit {
            machine: &machine,
            found: &found,
            file: &model,
            logs: &args.logs,
            given,
        };
        let page = pages::friction_fit(&page, context)?;
        context.check()?;
        outputs::write_text(path, &page)?;
    }
    context.check()?;
    for path in &args.plot {
        outputs::write_picture(path, &figure(&machine, &found).svg())?;
    }
    outputs::write_text(&args.output, &model.to_toml()?)?;
    text += &format!("written: {}\n", args.output.display());
    Ok(Outcome {
        text,
        document,
        missed: Vec::new(),
    })
}
