//! `cft-ident diagnose`: what the torque residual still holds, and the effect behind it.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::diagnose_fault as fault;
use super::diagnose_text::text;
use super::{CliError, Context, Outcome, arguments, files, logs_of, outputs, pages};
use crate::diagnose::{self, Candidate, Errors, LogRole};
use crate::identify::{self, DiagnoseEnd, DiagnoseLogs, DiagnoseSettings, Diagnosed, LoggedRobot};
use crate::log::LogSpec;
use crate::number;
use crate::report::json::Document;

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

/// Parameters of an accepted effect in words: `order = 14.0 +- 0.1 1/m, ..`.
pub fn in_words(machine: &LoggedRobot, found: &Diagnosed, effect: usize) -> String {
    let words = found.told(machine, effect).into_iter().map(|t| {
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
            let parameters: serde_json::Map<String, Value> = found.told(machine, step.effect)
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
    let pair = |p: &diagnose::SplitErrors| {
        json!({
            "train": errors_json(&p.train),
            "holdout": p.holdout.as_ref().map(errors_json),
        })
    };
    let unexplained: Vec<Value> = d
        .unexplained
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
        .disturbances
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
        "verdict": found.verdict(),
        "steps": steps,
        "before": pair(&d.before),
        "after": pair(&d.after),
        "unexplained": unexplained,
        "candidates": candidates,
        "set_aside": set_aside,
        "episodes": episodes,
        "processing": found.held.summary,
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
    let (train, veto) = (logs_of(&args.logs), logs_of(&args.veto));
    let logs = DiagnoseLogs {
        train: &train,
        veto: &veto,
        holdout: &logs_of(&args.holdout),
    };
    let settings = DiagnoseSettings {
        keep: args.keep,
        ..DiagnoseSettings::default()
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
    let found = match identify::diagnose(
        &machine,
        (&name, &file),
        &logs,
        &settings,
        context.control(),
    )? {
        DiagnoseEnd::Diagnosed(found) => *found,
        DiagnoseEnd::DataFault(fault) => {
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
        outputs::write_text(path, &found.model(&machine, &file).to_toml()?)?;
        text += &format!("written: {}\n", path.display());
    }
    Ok(Outcome {
        text,
        document,
        missed: Vec::new(),
    })
}
