//! What was identified as plain numbers with names and units: the JSON document and the model file are made of it.

use std::collections::BTreeMap;

use cft_ident_core::verdict::Verdict;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::candidate::DriveEffect;

/// A number of a drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DriveParameter {
    /// `stiffness`, `damping`, `coulomb`, `armature`, ..
    pub name: String,
    /// Its joint; absent (null in JSON) for what concerns all.
    pub joint: Option<String>,
    pub value: f64,
    /// Standard deviation by the jackknife; absent where no data determine it.
    pub std: Option<f64>,
    pub relative_std: Option<f64>,
    /// 95 % confidence interval.
    pub interval_95: Option<[f64; 2]>,
    pub unit: String,
    pub meaning: String,
    pub verdict: Verdict,
}

/// A number that follows from the others and from what is declared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GivenParameter {
    pub name: String,
    pub joint: String,
    pub value: f64,
    pub unit: String,
    /// What it holds with.
    pub given: String,
}

/// An amplitude of a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepAmplitude {
    pub value: f64,
    pub std: Option<f64>,
    pub unit: String,
}

/// A gain with its standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GainSe {
    pub value: f64,
    pub se: f64,
}

/// How sure a step is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DriveStepStatus {
    Confirmed,
    Indicated,
    Seen,
}

/// An effect that was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DriveStep {
    pub effect: DriveEffect,
    /// Null where it concerns all joints.
    pub joint: Option<String>,
    /// Amplitudes as estimated, by joint where there are several.
    pub parameters: BTreeMap<String, StepAmplitude>,
    pub status: DriveStepStatus,
    /// Whether it stands in the model.
    pub written: bool,
    /// Why not.
    pub reason: Option<String>,
    /// sqrt F: amplitude over its deviation.
    pub deviations: f64,
    /// Deviations that chance hardly reaches with so many numbers and blocks; null where there are too few blocks.
    pub needed: Option<f64>,
    /// s.
    pub shrinkage: f64,
    /// Part of the robust squared error of blocks left out that it takes.
    pub gain: GainSe,
    /// Effects that these data do not separate from it.
    pub alternatives: Vec<DriveEffect>,
}

/// An effect that was tried and brought nothing to blocks left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TriedEffect {
    pub effect: DriveEffect,
    pub gain: GainSe,
}

/// Errors of rolled-out positions of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointPositionError {
    pub joint: String,
    /// Mean size [rad].
    pub mae: f64,
    /// Root of the mean square [rad].
    pub rmse: f64,
}

/// Errors of rolled-out positions of a log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LogPositionError {
    pub name: String,
    /// Its place among the logs of its use.
    #[serde(skip)]
    pub number: usize,
    /// Mean size [rad].
    pub mae: f64,
}

/// Errors of rolled-out positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DrivePositionError {
    /// Mean size over all samples.
    pub mae: f64,
    /// Root of the mean square over all samples.
    pub rmse: f64,
    /// Mean over time of the sum of squares over joints [rad^2].
    pub score: f64,
    pub unit: String,
    pub joints: Vec<JointPositionError>,
    pub logs: Vec<LogPositionError>,
}

/// Errors by what logs were used for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PositionErrorsByUse {
    pub train: DrivePositionError,
    /// Held-out logs; null without.
    pub holdout: Option<DrivePositionError>,
    /// Held-out logs, each by a fit without the logs of its motion; null without.
    pub holdout_motion_unseen: Option<DrivePositionError>,
}

/// A sentence about the result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DriveVerdict {
    pub kind: VerdictKind,
    pub text: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VerdictKind {
    EffectsFound,
    NothingMissing,
}

/// What the drives are declared as.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DeclaredDrive {
    /// `volts` or `torque`.
    pub kind: String,
    pub joints: Vec<String>,
    /// Supply at which torques hold [V].
    pub supply: Option<f64>,
    /// Duty per radian and unit of kp.
    pub firmware_gain: Option<f64>,
    pub duty_max: Option<f64>,
    /// Whether every torque is a ratio to the inertia.
    pub ratios: bool,
    /// Speed of the Stribeck effect of each joint [rad/s].
    pub stribeck_speed: Vec<f64>,
}

/// The document of `drive`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DriveResult {
    pub drive: DeclaredDrive,
    pub verdict: DriveVerdict,
    pub parameters: Vec<DriveParameter>,
    /// Single numbers, with what they hold with.
    pub given: Vec<GivenParameter>,
    pub steps: Vec<DriveStep>,
    /// Effects that were tried beside the model and not taken.
    pub tried: Vec<TriedEffect>,
    pub before: PositionErrorsByUse,
    pub after: PositionErrorsByUse,
    /// Blocks of the jackknife, and what they are.
    pub blocks: usize,
    pub blocks_are: String,
}
impl DriveResult {
    /// A parameter of a joint, or of the machine.
    pub fn find(&self, name: &str, joint: Option<&str>) -> Option<f64> {
        let mut all = self.parameters.iter();
        let found = all.find(|p| p.name == name && p.joint.as_deref() == joint)?;
        Some(found.value)
    }
}
