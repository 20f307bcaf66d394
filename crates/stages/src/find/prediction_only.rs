//! Terms that are written for prediction alone, as a document holds them.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::diagnose::Diagnosed;
use super::formulas::{EffectValueFound, JointGain, by_key, gain_of_each, values_found};
use crate::input::robot_setup::RobotSetup;
use cft_ident_core::diagnose::PredictingTerm;

/// A term that is written for prediction alone.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct PredictionOnly {
    pub effect: &'static str,
    /// Null for what concerns all joints.
    pub joint: Option<String>,
    /// Its numbers in the model that is written, by key.
    #[serde(serialize_with = "by_key")]
    #[schemars(with = "BTreeMap<String, EffectValueFound>")]
    pub parameters: Vec<(String, EffectValueFound)>,
    /// Part of the fitted amplitude that is written, 0..1: the rest may be chance.
    pub shrinkage: f64,
    /// How many deviations one number would have to be off zero to be as sure.
    pub deviations: f64,
    /// Root mean square of its whole torque at the joint where it is strongest.
    pub torque: EffectValueFound,
    /// Gain on blocks left out, joint by joint: squared error in units of the joint's residual variance.
    pub gain: Vec<JointGain>,
    /// Root mean square torque error of its joint on held-out data without it, the others kept and refitted.
    pub holdout_before: Option<f64>,
    /// The same with it.
    pub holdout_after: Option<f64>,
}

impl Diagnosed {
    /// Terms that are written for prediction alone.
    pub(super) fn prediction_only(&self, setup: &RobotSetup) -> Vec<PredictionOnly> {
        let of_term = |term: &PredictingTerm| {
            let effect = &self.diagnosis.model.effects[term.written];
            let unit = setup.torque_unit_at(effect.place);
            PredictionOnly {
                effect: effect.name(),
                joint: effect.place.name(&setup.robot),
                parameters: values_found(effect.numbers(&setup.robot, unit, None)).collect(),
                shrinkage: term.shrinkage,
                deviations: term.deviations,
                torque: EffectValueFound::of_torque(term.torque, unit),
                gain: gain_of_each(setup.robot.joint_names(), &term.gain),
                holdout_before: term.held_out.map(|h| h[0]),
                holdout_after: term.held_out.map(|h| h[1]),
            }
        };
        self.diagnosis.predicting.iter().map(of_term).collect()
    }
}
