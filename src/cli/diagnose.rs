//! `cft-ident diagnose`: what the torque residual still holds, and the effect behind it.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::diagnose_fault::{self as fault, DataFault};
use super::diagnose_prior::{information, moved_alone, open};
use super::diagnose_text::text;
use super::lsq::processing;
use super::{CliError, Context, Outcome, arguments, files, outputs, pages};
use crate::config::ModelFile;
use crate::diagnose::{
    self, Candidate, Case, DiagnoseError, Diagnosis, Errors, Limits, LogRole, Prior, Unknown,
};
use crate::effect::{AugmentedModel, EffectNumber};
use crate::identify::{InMemory, Log, LoggedRobot, in_file, new_model, read_whole, refined};
use crate::log::LogSpec;
use crate::motion::Parallel;
use crate::number;
use crate::report::json::Document;
use crate::robot::friction::{DoubleTanh, ViscousCoulomb};
use crate::robot::model::JointFriction;
use crate::verdict::{IDENTIFIED, Verdict, verdict_of};

const EXAMPLE: &str = "\
Example:
  cft-ident diagnose identification.csv -m model.toml --holdout unseen.csv
  cft-ident diagnose loaded.csv -m refined.toml --keep -o loaded.toml";

/// Trace the torque residual to effects that the model lacks, add them, and refit.
///
/// Errors are reported before and after on data that decided nothing: the --holdout logs, or blocks
/// that are set aside.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = EXAMPLE)]
pub struct Args {
    /// Logs; a span is chosen by LOG@0..70% or LOG@15.2..23s
    #[arg(required = true, value_name = "LOG")]
    pub logs: Vec<LogSpec>,
    /// Model file
    #[arg(short, long, value_name = "MODEL.toml")]
    pub model: PathBuf,
    /// Log that may veto a step, in place of blocks that are set aside; may be given more than once
    #[arg(long, value_name = "LOG")]
    pub veto: Vec<LogSpec>,
    /// Log that is evaluated once, after everything is decided; may be given more than once
    #[arg(long, value_name = "LOG")]
    pub holdout: Vec<LogSpec>,
    /// Hold the given model within its covariance: finds payload, gain and tilt
    #[arg(long)]
    pub keep: bool,
    /// Refined model file to write
    #[arg(short, long, value_name = "REFINED.toml")]
    pub output: Option<PathBuf>,
    /// Draw the residual before and after; may be given more than once
    #[arg(long, value_name = "FILE.svg|.png", value_parser = arguments::picture_file)]
    pub plot: Vec<PathBuf>,
    /// Write a report with verdict, numbers and pictures, as one page
    #[arg(long, value_name = "FILE.html", value_parser = arguments::html_file)]
    pub report: Option<PathBuf>,
}

/// What a stage ends with.
pub enum Found {
    /// A diagnosis.
    Diagnosed(Box<Diagnosed>),
    /// A fault of the data, which comes before any physics.
    DataFault(DataFault),
}

/// Result of the stage.
pub struct Diagnosed {
    pub diagnosis: Diagnosis,
    pub held: InMemory,
    /// Names of the logs, in order.
    pub logs: Vec<String>,
    /// The model as it was given.
    pub given: AugmentedModel,
    pub parallel: Parallel,
    pub cutoff_hz: f64,
}

/// Logs by what they are for.
pub struct Logs<'a> {
    pub train: &'a [LogSpec],
    pub veto: &'a [LogSpec],
    pub holdout: &'a [LogSpec],
}

/// Diagnoses a model on logs.
pub fn diagnose(
    machine: &LoggedRobot,
    file: &ModelFile,
    name: &str,
    logs: &Logs,
    keep: bool,
    context: &Context,
) -> Result<Found, CliError> {
    let given = refined(file, name)?;
    for spec in logs.train {
        if let Some(fault) = machine.fault(&spec.into(), context.control())? {
            return Ok(Found::DataFault(DataFault {
                kind: fault.kind.word().to_owned(),
                channel: fault.channel,
                effect: format!("{}: {}", spec.name(), fault.effect),
                remedy: fault.remedy,
            }));
        }
    }
    let groups = [
        (logs.train, LogRole::Train),
        (logs.veto, LogRole::Veto),
        (logs.holdout, LogRole::Holdout),
    ];
    let specs: Vec<&LogSpec> = groups.iter().flat_map(|(logs, _)| logs.iter()).collect();
    let roles: Vec<LogRole> = groups
        .iter()
        .flat_map(|(logs, role)| logs.iter().map(|_| *role))
        .collect();
    let read: Vec<Log> = specs.iter().map(|spec| Log::from(*spec)).collect();
    let mut held = read_whole(machine, &read, context.control())?;
    let settings = machine.settings();
    let parallel = Parallel::design(&settings, held.summary.dt)
        .map_err(|e| CliError::input(format!("{name}: {e}")))?;
    let open = open(machine, file, &given);
    let rate = 1.0 / (held.summary.dt * parallel.decimation as f64);
    let alone = moved_alone(&given, &held.stretches, &roles);
    let prior = Prior {
        information: information(file, &given, &open, keep, &alone),
        centre: given.clone(),
        rows_per_independent: (rate / (2.0 * settings.cutoff_hz)).max(1.0),
    };
    let case = Case {
        given,
        prior,
        open,
        stretches: std::mem::take(&mut held.stretches),
        roles,
        parallel,
        cutoff_hz: settings.cutoff_hz,
        units: (0..machine.robot.joints())
            .map(|j| machine.file.torque_unit(j).to_owned())
            .collect(),
        averaged: held.averaged,
        keep,
        without: Vec::new(),
        limits: Limits::default(),
    };
    let bar = context.progress("search", None);
    let diagnosis = match diagnose::diagnose(
        &case,
        &mut |step| context.note(&format!("added {step}")),
        &|| context.interrupted(),
    ) {
        Ok(diagnosis) => diagnosis,
        Err(DiagnoseError::Channels(found)) => {
            return Ok(Found::DataFault(fault::wrong_channel(machine, found)));
        }
        Err(DiagnoseError::Interrupted) => return Err(CliError::interrupted()),
        Err(DiagnoseError::Motion(e)) => return Err(CliError::input(e)),
        Err(e) => return Err(CliError::undetermined(e)),
    };
    drop(bar);
    held.stretches = case.stretches;
    let (given, parallel) = (case.given, case.parallel);
    let logs: Vec<String> = specs.iter().map(|s| s.name()).collect();
    for aside in &diagnosis.set_aside {
        if aside.role == LogRole::Holdout {
            let text = format!(
                "{}: {:.2}..{:.2} s set aside as the holdout",
                logs[aside.log], aside.from_s, aside.to_s
            );
            context.note(&text);
        }
    }
    Ok(Found::Diagnosed(Box::new(Diagnosed {
        diagnosis,
        held,
        logs,
        given,
        parallel,
        cutoff_hz: case.cutoff_hz,
    })))
}

/// Parameters of an accepted effect with their standard deviations.
pub fn told(machine: &LoggedRobot, diagnosis: &Diagnosis, effect: usize) -> Vec<EffectNumber> {
    let added = &diagnosis.model.effects[effect];
    let joint = added.place.joint().unwrap_or(0);
    let covariance = diagnosis.covariance_of(effect);
    added.numbers(
        &machine.robot,
        machine.file.torque_unit(joint),
        Some(&covariance),
    )
}

/// The same in words: `order = 14.0 +- 0.1 1/m, ..`.
pub fn in_words(machine: &LoggedRobot, diagnosis: &Diagnosis, effect: usize) -> String {
    let words = told(machine, diagnosis, effect).into_iter().map(|t| {
        let value = match t.std {
            Some(std) if std > 0.0 => number::plus_minus(t.value, std),
            _ => number::significant(t.value, 4),
        };
        format!("{} = {value} {}", t.key, t.unit)
            .trim_end()
            .to_owned()
    });
    words.collect::<Vec<_>>().join(", ")
}

/// Whether there is a verdict of effects, of nothing, or of structure without a name.
pub fn verdict(diagnosis: &Diagnosis) -> &'static str {
    let named = |step| diagnosis.explained(step);
    if diagnosis.steps.iter().any(named) {
        "effects-found"
    } else if diagnosis.structured() {
        "unexplained-residual"
    } else {
        "nothing-missing"
    }
}

/// The refined model as a file.
pub fn into_model(machine: &LoggedRobot, file: &ModelFile, found: &Diagnosed) -> ModelFile {
    let diagnosis = &found.diagnosis;
    let mut model = new_model(machine, "diagnose", &found.held.inputs);
    model.parameters.clone_from(&file.parameters);
    let robot = &machine.robot;
    let fitted = &diagnosis.model.model;
    let mut keys = Vec::new();
    let mut places = Vec::new();
    let mut widened = Vec::new();
    let mut undetermined = Vec::new();
    for (i, unknown) in diagnosis.unknowns.iter().enumerate() {
        let (name, joint, value) = match *unknown {
            Unknown::Theta(k) => (
                robot.parameters()[k].name.to_string(),
                None,
                fitted.theta[k],
            ),
            Unknown::Offset(j) => ("offset".to_owned(), Some(j), fitted.offset[j]),
            Unknown::Friction { joint, k } => match &fitted.friction[joint] {
                JointFriction::None => continue,
                JointFriction::DoubleTanh(law) => (
                    DoubleTanh::NAMES[k].to_owned(),
                    Some(joint),
                    law.parameters()[k],
                ),
                JointFriction::ViscousCoulomb(law) => (
                    ViscousCoulomb::NAMES[k].to_owned(),
                    Some(joint),
                    [law.viscous, law.coulomb][k],
                ),
            },
            Unknown::Linear { .. } | Unknown::Shape { .. } => continue,
        };
        let joint = joint.map(|j| robot.joint_names()[j].clone());
        let there =
            |p: &&mut crate::config::model_file::Parameter| p.name == name && p.joint == joint;
        if let Some(p) = model.parameters.iter_mut().find(there) {
            let variance = diagnosis.covariance[(i, i)];
            let found = if variance < 0.0 { 0.0 } else { variance.sqrt() };
            if !found.is_finite() {
                // others stand in for it in these logs
                p.value = value;
                p.std = None;
                p.verdict = Some(Verdict::NotIdentifiable);
                undetermined.push(p.key());
                continue;
            }
            // what smoothing and the encoders' steps did to the given model, they do to this one
            let std = found.max(p.std.unwrap_or(0.0));
            // a parameter without a torque worth mentioning is known well enough as it is
            let negligible = p.verdict == Some(Verdict::Identified)
                && p.std.is_some_and(|s| s > IDENTIFIED * p.value.abs());
            widened.push(if found > 0.0 { std / found } else { 1.0 });
            p.value = value;
            p.std = Some(std);
            if !negligible {
                p.verdict = Some(verdict_of(value, std));
            }
            keys.push(p.key());
            places.push(i);
        }
    }
    model.forget_covariance(&undetermined);
    model.replace_covariance(&keys, &|a, b| {
        widened[a] * widened[b] * diagnosis.covariance[(places[a], places[b])]
    });
    for (joint, std) in robot.joint_names().iter().zip(&diagnosis.residual_std) {
        model.residual_std.insert(joint.clone(), *std);
    }
    model.effects = (0..diagnosis.model.effects.len())
        .map(|i| {
            in_file(
                &diagnosis.model.effects[i],
                machine,
                &told(machine, diagnosis, i),
            )
        })
        .collect();
    model
}

fn errors_json(errors: &Errors) -> Value {
    json!({"joints": errors.joints, "overall": errors.overall})
}

fn candidate_json(machine: &LoggedRobot, c: &Candidate) -> Value {
    json!({
        "effect": c.effect.name(),
        "joint": c.effect.place.name(&machine.robot),
        "family": c.effect.family().name(),
        "score": c.score.as_ref().map(|s| s.cv_gain),
        "unique_share": c.score.as_ref().map(|s| s.unique_share),
        "delta_bic": c.score.as_ref().map(|s| s.delta_bic),
        "p_value": c.score.as_ref().map(|s| s.p_value),
        "accepted": c.accepted,
        "significant": c.significant,
        "reason": c.reason,
    })
}

/// The JSON fields of the command.
pub fn json(machine: &LoggedRobot, found: &Diagnosed) -> Value {
    let d = &found.diagnosis;
    let robot = &machine.robot;
    let steps: Vec<Value> = d
        .steps
        .iter()
        .map(|step| {
            let effect = &d.model.effects[step.effect];
            let parameters: serde_json::Map<String, Value> = told(machine, d, step.effect)
                .into_iter()
                .map(|t| (t.key, json!({"value": t.value, "std": t.std, "unit": t.unit})))
                .collect();
            let alternatives: Vec<&str> =
                step.alternatives.iter().map(|c| c.effect.name()).collect();
            let score = step.candidate.score.as_ref();
            json!({
                "effect": effect.name(),
                "family": effect.family().name(),
                "joint": effect.place.name(robot),
                "parameters": parameters,
                "alternatives": alternatives,
                "assured": d.assured(),
                "separate_command": (!alternatives.is_empty())
                    .then(|| super::separate::command(effect, robot))
                    .flatten(),
                "separate_by": if alternatives.is_empty() { Value::Null } else { effect.law.entry.separate_by.into() },
                "unique_share": score.map(|s| s.unique_share),
                "delta_bic": score.map(|s| s.delta_bic),
                "cv_gain": score.map(|s| s.cv_gain),
                "effective_samples": score.map(|s| s.effective_rows),
                "holdout_before": step.holdout.map(|h| h[0]),
                "holdout_after": step.holdout.map(|h| h[1]),
                "holdout_worsened": step.holdout.is_some_and(|h| h[1] > h[0]),
            })
        })
        .collect();
    let pair = |p: &diagnose::Pair| {
        json!({
            "train": errors_json(&p.train),
            "holdout": p.holdout.as_ref().map(errors_json),
        })
    };
    let unexplained: Vec<Value> = d
        .left
        .iter()
        .zip(robot.joint_names())
        .map(|(l, joint)| json!({"joint": joint, "share": l.share, "over_floor": l.over_floor}))
        .collect();
    let mut candidates: Vec<Value> = d
        .steps
        .iter()
        .map(|s| candidate_json(machine, &s.candidate))
        .collect();
    candidates.extend(d.candidates.iter().map(|c| candidate_json(machine, c)));
    let set_aside: Vec<Value> = d
        .set_aside
        .iter()
        .map(|a| {
            json!({
                "log": found.logs[a.log],
                "use": if a.role == LogRole::Veto { "veto" } else { "holdout" },
                "from_s": a.from_s,
                "to_s": a.to_s,
            })
        })
        .collect();
    let episodes: Vec<Value> = d
        .episodes
        .iter()
        .map(|e| {
            json!({
                "effect": crate::effect::disturbance::ENTRY.name,
                "family": crate::effect::disturbance::ENTRY.family().name(),
                "joint": robot.joint_names()[e.joint],
                "log": found.logs[e.log],
                "from_s": e.from_s,
                "to_s": e.to_s,
                "over": e.over,
            })
        })
        .collect();
    json!({
        "verdict": verdict(d),
        "steps": steps,
        "before": pair(&d.before),
        "after": pair(&d.after),
        "unexplained": unexplained,
        "candidates": candidates,
        "set_aside": set_aside,
        "episodes": episodes,
        "processing": processing(&found.held.summary),
    })
}

/// Runs the command.
///
/// # Errors
/// Every [`CliError`]; nothing is written then.
pub fn run(args: &Args, context: &Context) -> Result<Outcome, CliError> {
    let logs = args.logs.iter().chain(&args.veto).chain(&args.holdout);
    let inputs: Vec<&Path> = logs
        .map(|l| l.path.as_path())
        .chain([args.model.as_path()])
        .collect();
    let outputs = outputs::listed(args.output.as_deref(), &args.plot, args.report.as_deref());
    context.check_outputs(&inputs, &outputs)?;
    let given = files::model(&args.model)?;
    let (name, file) = (given.name, given.value);
    let machine = LoggedRobot::new(&name, file.robot.clone());
    let logs = Logs {
        train: &args.logs,
        veto: &args.veto,
        holdout: &args.holdout,
    };
    let of = pages::Diagnose {
        machine: &machine,
        file: &file,
        given: given.provenance,
        logs: args
            .logs
            .iter()
            .chain(&args.veto)
            .chain(&args.holdout)
            .collect(),
    };
    let found = match diagnose(&machine, &file, &name, &logs, args.keep, context)? {
        Found::Diagnosed(found) => *found,
        Found::DataFault(fault) => {
            if let Some(path) = &args.report {
                let page = pages::data_fault(&of, &fault, context)?;
                outputs::write_text(path, &page)?;
            }
            return Ok(Outcome {
                text: fault::text(&fault),
                document: Document::new("diagnose", &[], &[], &fault::json(&fault))?,
                missed: Vec::new(),
            });
        }
    };
    let document = Document::new(
        "diagnose",
        &found.held.inputs,
        &found.held.warnings,
        &json(&machine, &found),
    )?;
    let mut text = text(&machine, &found, &name);
    context.check()?;
    if !args.plot.is_empty() || args.report.is_some() {
        let figure = pages::diagnose_figure(&machine, &found)?.svg();
        for path in &args.plot {
            outputs::write_picture(path, &figure)?;
        }
        if let Some(path) = &args.report {
            let page = pages::diagnose(&of, &found, &figure, context)?;
            outputs::write_text(path, &page)?;
        }
    }
    if let Some(path) = &args.output {
        outputs::write_text(path, &into_model(&machine, &file, &found).to_toml()?)?;
        text += &format!("written: {}\n", path.display());
    }
    Ok(Outcome {
        text,
        document,
        missed: Vec::new(),
    })
}
