//! `cft-ident friction`: the friction of single joints from one-joint logs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde_json::{Value, json};

use super::machine::Machine;
use super::{CliError, Context, Outcome, arguments, files, outputs, pages};
use crate::config::ModelFile;
use crate::config::identified::{friction_meaning, friction_unit};
use crate::config::model_file::{ModelProvenance, Parameter};
use crate::friction::estimate::{JointEstimate, Nis, Options, curve_std, estimate};
use crate::friction::excitation::{FrictionError, moving_joint};
use crate::friction::inputs::Inputs;
use crate::friction::passes::{Ending, GivenNoise};
use crate::friction::prepare::{SensorModel, SmoothedMotion, prepare, resolution};
use crate::log::{LogSpec, Provenance, did_you_mean};
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

/// Friction of every joint that the logs move.
pub struct Identified {
    /// Joint index and estimate, in joint order.
    pub joints: Vec<(usize, JointEstimate)>,
    pub inputs: Vec<Provenance>,
    pub warnings: Vec<String>,
}

/// Estimates the friction from one-joint logs; several logs of one joint are used together.
pub fn identify(
    machine: &Machine,
    logs: &[LogSpec],
    joint: Option<&str>,
    context: &Context,
) -> Result<Identified, CliError> {
    let names = machine.robot.joint_names();
    let named = match joint {
        None => None,
        Some(name) => Some(names.iter().position(|n| n == name).ok_or_else(|| {
            let known = names.join(", ");
            let near = did_you_mean(name, &known);
            CliError::usage(format!("the robot has no joint `{name}`"))
                .hint(format!("{near}its joints are {known}"))
        })?),
    };
    let bar = context.progress("reading logs", None);
    let ranges = machine.ranges();
    let mut groups: BTreeMap<usize, Group> = BTreeMap::new();
    let (mut inputs, mut warnings) = (Vec::new(), Vec::new());
    for spec in logs {
        let log = machine.motions(spec, context)?;
        inputs.push(log.provenance);
        warnings.extend(log.warnings);
        let moving = match named {
            Some(j) => j,
            None => moving_joint(names, &log.motions, &ranges)
                .map_err(|e| CliError::undetermined(format!("{}: {e}", spec.name())))?,
        };
        let group = groups.entry(moving).or_default();
        group.held |= log.held;
        group.motions.extend(log.motions);
        group.narrower.extend(log.narrower);
        group.logs.push(spec.name());
    }
    drop(bar);
    let bar = context.progress("friction filter", Some(groups.len() as u64));
    let parameter_names: Vec<String> = machine
        .robot
        .parameters()
        .iter()
        .map(|p| p.name.to_string())
        .collect();
    // joints do not know of one another: they run in parallel, and are collected in joint order
    let found: Vec<Result<(usize, JointEstimate), CliError>> = groups
        .into_par_iter()
        .map(|(j, group)| {
            context.check()?;
            let estimate = one_joint(machine, j, &group, &parameter_names)?;
            bar.advance(1);
            Ok((j, estimate))
        })
        .collect();
    let joints = found.into_iter().collect::<Result<Vec<_>, _>>()?;
    context.check()?;
    let of_joints = joints.iter();
    warnings.extend(of_joints.flat_map(|(j, e)| joint_warnings(&names[*j], e)));
    Ok(Identified {
        joints,
        inputs,
        warnings,
    })
}

/// Logs of one joint.
#[derive(Default)]
struct Group {
    motions: Vec<SmoothedMotion>,
    narrower: Vec<SmoothedMotion>,
    held: bool,
    logs: Vec<String>,
}

fn one_joint(
    machine: &Machine,
    j: usize,
    group: &Group,
    parameter_names: &[String],
) -> Result<JointEstimate, CliError> {
    let name = &machine.robot.joint_names()[j];
    let place = group.logs.join(", ");
    let undetermined = |e: FrictionError| CliError::undetermined(format!("{place}: {e}"));
    let noise = machine.file.noise.joint.get(name);
    let given = noise.and_then(|n| n.position_resolution);
    let resolution = given.unwrap_or_else(|| resolution(&group.motions, machine.robot.joints(), j));
    let variance = |q: &[f64]| -> f64 {
        let known = match given {
            Some(_) => None,
            None => machine.robot.transmission().encoder_variance(j, q),
        };
        known.unwrap_or(resolution * resolution / 12.0)
    };
    let sensors = SensorModel {
        variance: &variance,
        zero_order_hold: group.held,
    };
    let prepared = prepare(&machine.robot, j, &group.motions, &sensors).ok_or_else(|| {
        undetermined(FrictionError::StandsStill {
            joint: name.clone(),
        })
    })?;
    let options = Options {
        start: start_of(machine, name),
        noise: GivenNoise {
            torque: noise.and_then(|n| n.torque_std),
            position_factor: None,
        },
        ..Options::default()
    };
    let inputs = Inputs {
        robot: &machine.robot,
        joint: j,
        motions: &group.motions,
        narrower: &group.narrower,
        sensors: &sensors,
    };
    estimate(name, parameter_names, &prepared, Some(&inputs), &options).map_err(undetermined)
}

/// The user's starting values, where all five are given.
fn start_of(machine: &Machine, joint: &str) -> Option<DoubleTanh> {
    let s = machine.file.friction.joint.get(joint)?;
    Some(DoubleTanh {
        viscous: s.viscous?,
        coulomb_1: s.coulomb_1?,
        coulomb_2: s.coulomb_2?,
        slope_1: s.slope_1?,
        slope_2: s.slope_2?,
    })
}

/// What a reader of the estimate should know.
fn joint_warnings(joint: &str, e: &JointEstimate) -> Vec<String> {
    let mut out = Vec::new();
    if e.ending != Ending::Converged {
        out.push(format!(
            "{joint}: the search ended without converging ({:?})",
            e.ending
        ));
    }
    let Nis {
        mean,
        lower_95,
        upper_95,
        ..
    } = e.nis;
    if mean > upper_95 {
        out.push(format!(
            "{joint}: mean NIS {mean:.2} is above its bounds {lower_95:.2}..{upper_95:.2}: the innovations are alike for many samples, so something acts that the model lacks"
        ));
    } else if mean < lower_95 {
        out.push(format!(
            "{joint}: mean NIS {mean:.2} is below its bounds {lower_95:.2}..{upper_95:.2}: innovations cancel over many samples, as where positions are finer than the encoder's step^2/12 or were filtered before they were logged"
        ));
    }
    if e.widening > 1.5 {
        out.push(format!(
            "{joint}: the innovations are coloured, so the model lacks something; the standard deviations hold a factor {:.1} for it",
            e.widening.sqrt()
        ));
    }
    for (k, value) in e.values.iter().enumerate() {
        match value.verdict {
            Verdict::LowerBound => out.push(format!(
                "{joint}: {} is only known to be above {} (95 %): these data do not pass slowly enough through zero speed to bound it from above",
                DoubleTanh::NAMES[k],
                number::significant(value.value, 3)
            )),
            Verdict::NotIdentifiable => out.push(format!(
                "{joint}: these data cannot determine {}; log slower reversals and more speeds",
                DoubleTanh::NAMES[k]
            )),
            Verdict::Identified | Verdict::Weak => {}
        }
    }
    out
}

/// The parameters of one joint as a model file holds them. A slope with a bound keeps the value of
/// highest likelihood, which the torque is computed with; its meaning names the bound.
pub fn file_parameters(machine: &Machine, j: usize, e: &JointEstimate) -> Vec<Parameter> {
    let joint = &machine.robot.joint_names()[j];
    let torque_unit = machine.file.torque_unit(j);
    let law = e.law.parameters();
    (0..5)
        .map(|k| {
            let name = DoubleTanh::NAMES[k];
            let v = &e.values[k];
            let mut meaning = friction_meaning(name).to_owned();
            if v.verdict == Verdict::LowerBound {
                meaning += &format!("; only known to be above {:e} (95 %)", v.value);
            }
            Parameter {
                name: name.to_owned(),
                theta: machine.robot.friction_theta(j, k),
                joint: Some(joint.clone()),
                value: law[k],
                std: (v.std.is_finite()).then_some(v.std),
                unit: friction_unit(&machine.robot, j, name, torque_unit),
                meaning,
                verdict: Some(v.verdict),
            }
        })
        .collect()
}

/// Writes the estimates into a model, in place of what it has of these joints.
pub fn into_model(machine: &Machine, found: &Identified, model: &mut ModelFile) {
    for (j, e) in &found.joints {
        let joint = &machine.robot.joint_names()[*j];
        model.replace_joint(joint, file_parameters(machine, *j, e));
        let keys: Vec<String> = DoubleTanh::NAMES
            .iter()
            .map(|n| format!("{n}:{joint}"))
            .collect();
        model.replace_covariance(&keys, &|a, b| e.covariance[a][b]);
    }
}

/// An empty model of the robot.
pub fn new_model(machine: &Machine, command: &str, inputs: &[Provenance]) -> ModelFile {
    ModelFile {
        robot: machine.file.clone(),
        parameters: Vec::new(),
        covariance: None,
        residual_std: BTreeMap::new(),
        effects: Vec::new(),
        links: Vec::new(),
        drive_inertia: BTreeMap::new(),
        provenance: ModelProvenance {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            seed: None,
            inputs: inputs.to_vec(),
        },
    }
}

/// The JSON fields of the command.
pub fn json(machine: &Machine, found: &Identified) -> Value {
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
pub fn text(machine: &Machine, found: &Identified) -> String {
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
pub fn figure(machine: &Machine, found: &Identified) -> FrictionFigure {
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
    let machine = Machine::new(&args.robot, robot.value);
    let mut given = vec![robot.provenance];
    let old = match &args.model {
        None => None,
        Some(path) => {
            let model = files::model_of(path, &machine.file)?;
            given.push(model.provenance);
            Some(model.value)
        }
    };
    let found = identify(&machine, &args.logs, args.joint.as_deref(), context)?;
    let mut model = new_model(&machine, "friction", &found.inputs);
    if let Some(old) = old {
        model.parameters = old.parameters;
        model.covariance = old.covariance;
        model.residual_std = old.residual_std;
        model.effects = old.effects;
    }
    into_model(&machine, &found, &mut model);
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
