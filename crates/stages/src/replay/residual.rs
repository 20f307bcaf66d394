//! What the residual depends on, and the waves that a model has.

use super::LogReplay;
use cft_ident_core::diagnose::{JointEvidence, evidence, one_after_the_other};
use cft_ident_core::effect::{AugmentedModel, EffectPlace, ShapeSearch};
use cft_ident_core::motion::{MotionError, Stretch};

/// The residual of one joint.
#[derive(Debug, Clone)]
pub struct ResidualPair {
    pub before: JointEvidence,
    /// By a second model, where there is one.
    pub after: Option<JointEvidence>,
    /// Orders of the waves that the last model has at the joint [1/rev or 1/m].
    pub orders: Vec<f64>,
}

/// The residual of one or two models along the same logs.
#[derive(Debug, Clone)]
pub struct ResidualEvidence {
    /// Names of the logs.
    pub logs: Vec<String>,
    /// Where each of several logs begins on the axis of time [s], and its name.
    pub begins: Vec<(f64, String)>,
    pub joints: Vec<ResidualPair>,
}

/// The residual of the first model, and of the second where there is one, along some logs.
pub(super) fn residual(
    replay: &LogReplay,
    logs: &[usize],
    before: &AugmentedModel,
    after: Option<&AugmentedModel>,
) -> Result<ResidualEvidence, MotionError> {
    let found = after.unwrap_or(before);
    let joints = 0..replay.setup.robot.joints();
    let waves: Vec<Vec<f64>> = joints.map(|j| orders(found, j)).collect();
    let reach = waves
        .iter()
        .map(|of| of.iter().copied().fold(0.0, f64::max));
    let settings = (replay.cutoff_hz, &reach.collect::<Vec<f64>>()[..]);
    let wanted = |s: &&Stretch| logs.contains(&s.log);
    let stretches: Vec<&Stretch> = replay.stretches.iter().filter(wanted).collect();
    let of = |model| evidence(model, &stretches, &replay.filters, settings);
    let before = of(before)?;
    let after = after.map(of).transpose()?;
    let mut after = after.into_iter().flatten();
    let joints = before.into_iter().zip(waves);
    let joints = joints.map(|(before, orders)| ResidualPair {
        before,
        after: after.next(),
        orders,
    });
    Ok(ResidualEvidence {
        logs: replay.named(logs),
        begins: begins(replay, &stretches),
        joints: joints.collect(),
    })
}

/// Where logs begin on the axis of time; nothing of a single one.
fn begins(replay: &LogReplay, stretches: &[&Stretch]) -> Vec<(f64, String)> {
    let mut found = Vec::new();
    let mut log = None;
    for (stretch, late) in stretches.iter().zip(one_after_the_other(stretches)) {
        if log != Some(stretch.log) {
            log = Some(stretch.log);
            let begin = stretch.t.first().copied().unwrap_or_default();
            let name = replay.names.get(stretch.log).cloned();
            found.push((begin + late, name.unwrap_or_default()));
        }
    }
    if found.len() < 2 { Vec::new() } else { found }
}

/// Orders of the waves that a model has at a joint.
fn orders(model: &AugmentedModel, joint: usize) -> Vec<f64> {
    let effects = model.effects.iter();
    let waves = effects.filter(|e| e.law.entry.search == ShapeSearch::Orders);
    let here = waves.filter(|e| e.place == EffectPlace::Joint(joint));
    here.filter_map(|e| e.shape.first().copied()).collect()
}
