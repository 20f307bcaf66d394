//! Between model files and models with effects, and logs as stretches in memory.

use super::machine::{Machine, run_error, summary_warnings};
use super::{CliError, Context};
use crate::config::ModelFile;
use crate::config::model_file::{Effect, EffectParameter};
use crate::effect::{Added, EffectError, Refined, Told};
use crate::log::{Instant, LogSpec, Provenance, did_you_mean};
use crate::motion::{Stretch, Summary, stretches};
use crate::robot::model::Model;

/// The model of a file with its effects; `name` names the file in errors.
pub fn refined(file: &ModelFile, name: &str) -> Result<Refined, CliError> {
    with_effects(file, name, file.model(name)?)
}

/// The same of a file that may hold friction alone, with inertias of 0 then: for what asks for no torque.
pub fn refined_or_friction(file: &ModelFile, name: &str) -> Result<Refined, CliError> {
    with_effects(file, name, file.model_or_friction(name)?)
}

fn with_effects(file: &ModelFile, name: &str, model: Model) -> Result<Refined, CliError> {
    let effects = file
        .effects
        .iter()
        .map(|e| {
            let values = e
                .parameters
                .iter()
                .map(|(k, p)| (k.clone(), p.value))
                .collect();
            Added::of_keys(&model.robot, &e.name, e.joint.as_deref(), &values).map_err(|error| {
                let told = CliError::input(format!("{name}: {error}"));
                let near = match &error {
                    EffectError::Unknown { name, known } => did_you_mean(name, known),
                    EffectError::Joint { joint, known, .. } => did_you_mean(joint, known),
                    _ => String::new(),
                };
                told.hint(format!(
                    "{near}correct the [[effect]] table, or take it out"
                ))
            })
        })
        .collect::<Result<_, _>>()?;
    Ok(Refined { model, effects })
}

/// An effect as a model file holds it.
pub fn in_file(effect: &Added, machine: &Machine, told: &[Told]) -> Effect {
    Effect {
        name: effect.kind.name.to_owned(),
        joint: effect.place.name(&machine.robot),
        parameters: told
            .iter()
            .map(|t| {
                let parameter = EffectParameter {
                    value: t.value,
                    std: t.std,
                    unit: t.unit.clone(),
                };
                (t.key.clone(), parameter)
            })
            .collect(),
    }
}

/// Most samples that are held in memory, over all logs: 2 GB for a robot of seven joints.
const MOST_SAMPLES: usize = 9_000_000;

/// Logs in memory, as stretches at full rate.
pub struct Held {
    pub stretches: Vec<Stretch>,
    pub inputs: Vec<Provenance>,
    pub warnings: Vec<String>,
    pub summary: Summary,
    /// Instant from which the times of the first log are counted.
    pub origin: Instant,
    /// Torques are means of two rows: they are held from row to row.
    pub averaged: bool,
}

/// Reads logs whole for the pictures of a report; `None` where they are too long for that, which
/// is no reason to lose the report.
///
/// # Errors
/// Those of [`hold`].
pub fn held_for_pictures(
    machine: &Machine,
    logs: &[&LogSpec],
    context: &Context,
) -> Result<Option<Held>, CliError> {
    match hold_most(machine, logs, context)? {
        Ok(held) => Ok(Some(held)),
        Err(_) => Ok(None),
    }
}

/// Reads logs whole, smoothed as the model declares.
///
/// # Errors
/// A log that cannot be read, logs sampled unlike, or more samples than memory is meant to hold.
pub fn hold(machine: &Machine, logs: &[&LogSpec], context: &Context) -> Result<Held, CliError> {
    hold_most(machine, logs, context)?
}

/// The same, what cannot be held apart from what cannot be read.
fn hold_most(
    machine: &Machine,
    logs: &[&LogSpec],
    context: &Context,
) -> Result<Result<Held, CliError>, CliError> {
    let n = machine.robot.joints();
    let settings = machine.settings();
    let bar = context.progress("reading", Some(logs.len() as u64));
    let (mut all, mut inputs, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    let mut last: Option<Summary> = None;
    let mut origin = None;
    let mut samples = 0;
    let mut averaged = false;
    for (index, spec) in logs.iter().enumerate() {
        let mut log = machine.open(spec, context)?;
        origin = origin.or_else(|| Some(log.origin()));
        averaged |= log.is_centred();
        let (found, summary) = stretches(index, n, &settings, &mut |block| log.read(block))
            .map_err(|e| run_error(spec, e))?;
        samples += found.iter().map(Stretch::len).sum::<usize>();
        if samples > MOST_SAMPLES {
            return Ok(Err(CliError::input(format!(
                "{}: {samples} samples are more than the {MOST_SAMPLES} that are held in memory",
                spec.name()
            ))
            .hint("choose spans of the logs, as in LOG@0..20%")));
        }
        if let Some(before) = &last
            && (before.dt / summary.dt - 1.0).abs() > 0.02
        {
            return Ok(Err(CliError::input(format!(
                "{}: sampled at {:.6} s, the log before it at {:.6} s",
                spec.name(),
                summary.dt,
                before.dt
            ))
            .hint("logs of one run are sampled alike; work on them one by one")));
        }
        warnings.extend(log.warnings());
        warnings.extend(summary_warnings(spec, &summary));
        inputs.push(log.provenance()?);
        all.extend(found);
        last = Some(summary);
        bar.advance(1);
    }
    let (Some(summary), Some(origin)) = (last, origin) else {
        return Err(CliError::usage("no log is given"));
    };
    Ok(Ok(Held {
        stretches: all,
        inputs,
        warnings,
        summary,
        origin,
        averaged,
    }))
}
