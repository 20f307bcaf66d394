//! Model files: the robot, every parameter with its uncertainty, the effects added, where it came from.
//! Reading and writing are in [`super::model_text`].

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::campaign::EstimatorKind;
use super::candidates::CandidateSection;
use super::held_out::{HeldOut, TorqueExcesses};
use super::limits::Limits;
use super::robot_file::{ModelKind, RobotFile};
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::verdict::IDENTIFIED;
pub use cft_ident_core::verdict::Verdict;
use cft_ident_logs::log::{Provenance, escape};

/// One parameter of a model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// The same parameter of the nearest model that can exist: torques are computed with it where it is there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub consistent: Option<f64>,
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

    /// The value that torques are computed with.
    pub fn in_use(&self) -> f64 {
        self.consistent.unwrap_or(self.value)
    }

    /// Whether its torque is not worth mentioning: rated identified though its value is uncertain.
    pub fn is_negligible(&self) -> bool {
        let uncertain = |std| std > IDENTIFIED * self.value.abs();
        self.verdict == Some(Verdict::Identified) && self.std.is_some_and(uncertain)
    }

    /// Whether it is below zero by more than two deviations where friction and inertia are positive.
    pub fn is_below_zero(&self) -> bool {
        let below = self.std.is_some_and(|std| self.value < -2.0 * std);
        below && is_positive(&self.name, self.joint.is_some())
    }

    /// Its verdict in a word, or that it is negligible; nothing where it was not estimated.
    pub fn verdict_word(&self) -> &'static str {
        match self.verdict {
            Some(_) if self.is_negligible() => "negligible",
            verdict => verdict.map_or("", Verdict::word),
        }
    }
}

/// Whether a parameter of this name is positive in every machine: inertia of a drive or of a single joint, viscous
/// and Coulomb friction of a joint.
pub fn is_positive(name: &str, of_joint: bool) -> bool {
    let of_drive = name
        .strip_prefix("Ia")
        .is_some_and(|joint| joint.parse::<u32>().is_ok());
    of_drive || of_joint && matches!(name, "viscous" | "coulomb") || name == "inertia"
}

/// Covariance of the parameters, in the order of `names`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Covariance {
    /// Keys of the parameters ([`Parameter::key`]).
    pub names: Vec<String>,
    /// Square and symmetric; row and column i belong to `names[i]`.
    pub matrix: Vec<Vec<f64>>,
}

/// A number of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// It is held at a bound of its search, for the data did not tell it: no fit moves it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub bound: bool,
}

/// The friction of a joint by its one-joint logs, before a fit of other logs refined it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrictionPrior {
    /// Joint.
    pub joint: String,
    /// Least and greatest speed of its one-joint logs [m/s or rad/s].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speeds_covered: Option<[f64; 2]>,
    /// Parameters in the order of [`DoubleTanh::NAMES`], in the units of `[[parameter]]`; absent where those of the
    /// file are meant, which nothing has refined.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values: Option<[f64; 5]>,
    /// Their covariance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 5]; 5]>,
    /// The logs that tell it.
    #[serde(default)]
    pub logs: Vec<Provenance>,
    /// The logs that refined it to the parameters of the file.
    #[serde(default)]
    pub refined_by: Vec<Provenance>,
}

/// An effect that was added to the declared model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EffectSection {
    /// Name, e.g. `ripple`.
    pub name: String,
    /// Joint; absent for what concerns all of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Part of the estimated amplitude that the values below are, by the agreement between parts of the data; absent
    /// where they are all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shrinkage: Option<f64>,
    /// The user wanted it, whatever the data say.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub accepted_by_user: bool,
    /// It is written because torques of other motions come out better with it, and is no statement on the machine.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub prediction_only: bool,
    /// Its numbers by key.
    #[serde(default)]
    pub parameters: BTreeMap<String, EffectParameter>,
}

/// A number as the data estimate it, beside a model that predicts with less of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Estimate {
    /// Key of a parameter, or name of an effect and key.
    pub name: String,
    /// Joint; absent for what concerns all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Value in `unit`.
    pub value: f64,
    /// Standard deviation in `unit`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// Unit.
    #[serde(default)]
    pub unit: String,
}

/// Mass properties of a physically consistent link: keys as in `inertial` of
/// a robot file's link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkBody {
    /// Name of the link.
    pub name: String,
    /// \[kg\]
    pub mass: f64,
    /// Centre of gravity in the link's frame \[m\].
    pub centre: [f64; 3],
    /// Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the centre of gravity, along the link's axes \[kg m^2\].
    pub inertia: [f64; 6],
}

/// Where a model came from. No clock time and no path: the same inputs give the same bytes.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelProvenance {
    /// Version of the tool.
    pub version: String,
    /// Command that wrote the file.
    #[serde(default)]
    pub command: String,
    /// Estimator of a fit, where it was another than weighted least squares.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimator: Option<EstimatorKind>,
    /// The set-up was kept as it is declared, whatever the torques said of it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub as_declared: bool,
    /// Seed, where chance played.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// The logs and models that it was made from.
    #[serde(default)]
    pub inputs: Vec<Provenance>,
}

/// What covariances have between these keys, row-major; the last one that has both counts, and 0 where none has.
fn between(covariances: [&Option<Covariance>; 2], keys: &[String]) -> Vec<f64> {
    let mut block = vec![0.0; keys.len() * keys.len()];
    for covariance in covariances.into_iter().flatten() {
        let place = |key: &String| covariance.names.iter().position(|name| name == key);
        let places: Vec<Option<usize>> = keys.iter().map(place).collect();
        for (i, row) in places.iter().enumerate() {
            for (j, column) in places.iter().enumerate() {
                if let (Some(row), Some(column)) = (*row, *column) {
                    block[i * keys.len() + j] = covariance.matrix[row][column];
                }
            }
        }
    }
    block
}

#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// The robot, so that no robot file is needed; its `[filter]` is the model's own processing.
    pub robot: RobotFile,
    pub parameters: Vec<Parameter>,
    /// Their covariance, where it was estimated.
    pub covariance: Option<Covariance>,
    /// Standard deviation of the torque residual by joint [N or Nm], for prediction bands.
    pub residual_std: BTreeMap<String, f64>,
    /// The friction by one-joint logs, joint by joint.
    pub friction_prior: Vec<FrictionPrior>,
    /// What was left of torques that were set aside, of every joint in their order; empty where nothing was.
    pub held_out: Vec<HeldOut>,
    /// How often external torques that are none go beyond a level.
    pub excesses: Option<TorqueExcesses>,
    /// Formulas of those effects that are the user's own.
    pub candidates: Vec<CandidateSection>,
    pub effects: Vec<EffectSection>,
    /// The physical numbers, where the parameters and effects above predict with less of an effect than was estimated.
    pub estimates: Vec<Estimate>,
    /// Their covariance, of those that are parameters.
    pub estimate_covariance: Option<Covariance>,
    /// Physically consistent links that give the consistent parameters.
    pub links: Vec<LinkBody>,
    /// Inertia of the drives beside them, by joint [kg m^2 or kg].
    pub drive_inertia: BTreeMap<String, f64>,
    /// Where it came from.
    pub provenance: ModelProvenance,
}

impl ModelFile {
    /// Leaves out what physical consistency put beside the plain fit.
    pub fn forget_consistent(&mut self) {
        for p in &mut self.parameters {
            p.consistent = None;
        }
        self.links.clear();
        self.drive_inertia.clear();
    }

    /// Whether physically consistent parameters stand beside those of the plain fit.
    pub fn is_consistent(&self) -> bool {
        self.parameters.iter().any(|p| p.consistent.is_some())
    }

    /// The model of the plain fit alone.
    pub fn as_fitted(&self) -> Self {
        let mut plain = self.clone();
        plain.forget_consistent();
        plain
    }

    /// The parameters as the data estimate them, each with its standard deviation. Where torques are computed with
    /// another value, because the model predicts with a part of an effect or with physically consistent parameters,
    /// `consistent` is that value.
    pub fn estimated_parameters(&self) -> Vec<Parameter> {
        let estimated = self.parameters.iter().map(|parameter| {
            let Some(estimate) = self.estimate(&parameter.name, parameter.joint.as_deref()) else {
                return parameter.clone();
            };
            Parameter {
                value: estimate.value,
                std: estimate.std,
                consistent: Some(parameter.in_use()),
                ..parameter.clone()
            }
        });
        estimated.collect()
    }

    /// The estimate of a number, a parameter or `EFFECT KEY`, where the model computes torques with another value.
    pub fn estimate(&self, name: &str, joint: Option<&str>) -> Option<&Estimate> {
        let mut all = self.estimates.iter();
        all.find(|estimate| estimate.name == name && estimate.joint.as_deref() == joint)
    }

    /// A parameter by name, of one joint or of none; `file` names the model in the error.
    pub fn parameter(
        &self,
        file: &str,
        name: &str,
        joint: Option<&str>,
    ) -> Result<&Parameter, ConfigError> {
        self.find(name, joint).ok_or_else(|| {
            let (name, command) = match joint {
                Some(joint) => (format!("{name}:{joint}"), "friction"),
                None => (name.to_owned(), "lsq"),
            };
            ConfigError::MissingParameter {
                file: file.to_owned(),
                name,
                remedy: format!(
                    "identify it with `cft-ident {command}`, or add a [[parameter]] table"
                ),
            }
        })
    }

    /// A parameter by name, of one joint or of none, where the model has it.
    pub fn find(&self, name: &str, joint: Option<&str>) -> Option<&Parameter> {
        let mut all = self.parameters.iter();
        all.find(|p| p.name == name && p.joint.as_deref() == joint)
    }

    /// Values of the inertial parameters, in the order of [`Robot::parameters`](cft_ident_core::robot::Robot::parameters).
    ///
    /// # Errors
    /// [`ConfigError::MissingParameter`] for the first that the model lacks.
    pub fn inertial(&self, file: &str) -> Result<Vec<f64>, ConfigError> {
        let robot = self.robot.robot();
        let needed = robot.parameters().iter();
        needed
            .map(|info| Ok(self.parameter(file, &info.name, None)?.in_use()))
            .collect()
    }

    /// Double-tanh friction of one joint, eq. (18).
    pub fn double_tanh(&self, file: &str, joint: &str) -> Result<DoubleTanh, ConfigError> {
        let mut values = [0.0; 5];
        for (value, name) in values.iter_mut().zip(DoubleTanh::NAMES) {
            *value = self.parameter(file, name, Some(joint))?.in_use();
        }
        Ok(DoubleTanh::from_parameters(values))
    }

    /// Viscous and Coulomb friction of one joint.
    pub fn viscous_coulomb(&self, file: &str, joint: &str) -> Result<ViscousCoulomb, ConfigError> {
        let value = |name| Ok(self.parameter(file, name, Some(joint))?.in_use());
        Ok(ViscousCoulomb {
            viscous: value("viscous")?,
            coulomb: value("coulomb")?,
        })
    }

    /// Constant torque offset of one joint [N or Nm]; 0 where the model has none.
    pub fn offset(&self, joint: &str) -> f64 {
        self.find("offset", Some(joint))
            .map_or(0.0, Parameter::in_use)
    }

    /// Covariance of the parameters with these keys ([`Parameter::key`]), row-major; 0 where unknown.
    pub fn covariance_of(&self, keys: &[String]) -> Vec<f64> {
        between([&None, &self.covariance], keys)
    }

    /// The same with the estimates' where the parameters are none.
    pub fn estimated_covariance_of(&self, keys: &[String]) -> Vec<f64> {
        between([&self.estimate_covariance, &self.covariance], keys)
    }

    /// Limits where a robot file gives none: what the logs of the model have seen.
    pub fn limit_to_seen(&self, limits: &mut Limits) {
        for held in &self.held_out {
            let limits = limits.of.entry(held.joint.clone()).or_default();
            limits.position = limits.position.or(Some(held.positions_seen));
            limits.speed = limits.speed.or(Some(held.speed_seen));
            limits.torque = limits.torque.or(Some(held.torque_seen));
            let seen = Some(held.acceleration_seen).filter(|a| a.is_finite() && *a > 0.0);
            limits.acceleration = limits.acceleration.or(seen);
        }
    }

    /// Travel of joints where a robot file gives none, for a simulation: the positions of the model's logs.
    pub fn travel_of_seen(&self, limits: &mut Limits) {
        for held in &self.held_out {
            let limits = limits.of.entry(held.joint.clone()).or_default();
            limits.position = limits.position.or(Some(held.positions_seen));
        }
    }

    /// Refuses a model of another robot than `wanted`; `file` names the model.
    ///
    /// # Errors
    /// [`ConfigError::OtherRobot`] with what differs.
    pub fn belongs_to(&self, file: &str, wanted: &RobotFile) -> Result<(), ConfigError> {
        let describe = |robot: &RobotFile| {
            let section = &robot.robot;
            match section.model {
                ModelKind::Cft => format!(
                    "cft, set-up {}, {} parameters",
                    section.setup.unwrap_or_default().name(),
                    section.parameters.unwrap_or(12)
                ),
                ModelKind::Serial => format!(
                    "serial, {} links, joints {}",
                    section.link.len(),
                    escape(&robot.joint_names().join(", "))
                ),
                ModelKind::SingleJoint => {
                    let kind = section.kind.map_or("m or rad", |kind| kind.position_unit());
                    format!(
                        "single-joint {} in {kind}",
                        escape(section.joint.as_deref().unwrap_or_default())
                    )
                }
            }
        };
        let (theirs, ours) = (describe(&self.robot), describe(wanted));
        if theirs == ours {
            return Ok(());
        }
        Err(ConfigError::OtherRobot {
            file: file.to_owned(),
            difference: format!("{theirs}, where {ours} is wanted"),
            remedy: "give the model that was identified on this robot, or the robot file that it belongs to".to_owned(),
        })
    }
}
