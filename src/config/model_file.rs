//! Model files: the robot, every parameter with its uncertainty, the effects added, where it came from.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::robot_file::RobotFile;
use crate::log::Provenance;

/// What the data say about a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Relative standard deviation of at most 10 %, or a negligible parameter.
    Identified,
    /// Relative standard deviation of at most 50 %.
    Weak,
    /// The data do not determine it.
    NotIdentifiable,
    /// Only a lower bound is known: `value` is that bound.
    LowerBound,
}

/// One parameter of a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Name: `theta_1`.., or the key of a friction law, `inertia`, `offset`, ...
    pub name: String,
    /// Number in the report's Table 4, where it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theta: Option<u32>,
    /// Joint; absent for what concerns all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Value in `unit`.
    pub value: f64,
    /// Standard deviation in `unit`; absent where the data say nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// SI unit.
    pub unit: String,
    /// What it is, in words.
    #[serde(default)]
    pub meaning: String,
    /// What the data say about it; absent where it was not estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
}

impl Parameter {
    /// `name`, or `name:joint` where it belongs to a joint: unique in a model, and the name in the covariance.
    pub fn key(&self) -> String {
        match &self.joint {
            Some(joint) => format!("{}:{joint}", self.name),
            None => self.name.clone(),
        }
    }
}

/// Covariance of the parameters, in the order of `names`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Covariance {
    /// Keys of the parameters ([`Parameter::key`]).
    pub names: Vec<String>,
    /// Square and symmetric; row and column i belong to `names[i]`.
    pub matrix: Vec<Vec<f64>>,
}

/// A number of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectParameter {
    /// Value in `unit`.
    pub value: f64,
    /// Standard deviation in `unit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// Unit.
    #[serde(default)]
    pub unit: String,
}

/// An effect that was added to the declared model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Effect {
    /// Name, e.g. `ripple`.
    pub name: String,
    /// Joint; absent for what concerns all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Its numbers by key.
    #[serde(default)]
    pub parameters: BTreeMap<String, EffectParameter>,
}

/// Where a model came from. No clock time and no path: the same inputs give the same bytes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelProvenance {
    /// Version of the tool.
    pub version: String,
    /// Command that wrote the file.
    #[serde(default)]
    pub command: String,
    /// Seed, where chance played.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// The logs and models that it was made from.
    #[serde(default)]
    pub inputs: Vec<Provenance>,
}

/// A model file.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// The robot, so that no robot file is needed; its `[filter]` is the model's own processing.
    pub robot: RobotFile,
    /// Every parameter.
    pub parameters: Vec<Parameter>,
    /// Their covariance, where it was estimated.
    pub covariance: Option<Covariance>,
    /// Standard deviation of the torque residual by joint [N or Nm], for prediction bands.
    pub residual_std: BTreeMap<String, f64>,
    /// Effects added to the declared model.
    pub effects: Vec<Effect>,
    /// Where it came from.
    pub provenance: ModelProvenance,
}
