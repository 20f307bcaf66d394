//! The truth of a simulated log, as it is written beside the log.
//!
//! Only `identify` may look at it, and only after everything is decided. Parameters carry the names,
//! joints and units of a model file, so that the two can be compared by key.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::effects::EffectValue;
use super::joint_friction::SmoothFriction;
use super::plant::Plant;
use cft_ident_core::robot::friction::DoubleTanh;
use cft_ident_files::config::identified::friction_unit;
use cft_ident_files::config::model_file::Parameter;

/// Content of LOG.truth.toml.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TruthFile {
    /// Version of the tool.
    pub version: String,
    /// Seed of everything that chance decided.
    pub seed: u64,
    /// "cft", "single-joint", "serial" or "servo".
    pub model: String,
    /// Set-up of the CFT robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setup: Option<String>,
    /// How the run ended, with the first time of every limit reached.
    pub ending: String,
    /// Standard deviation of the noise on the logged volts, by motor coordinate \[V\].
    pub volt_noise: Vec<f64>,
    /// Standard deviation of the noise on the logged torques, by joint, N or N m.
    pub torque_noise: Vec<f64>,
    #[serde(rename = "parameter")]
    pub parameters: Vec<Parameter>,
    #[serde(default, rename = "effect", skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectValue>,
}

/// Meanings of the double-tanh parameters.
const DOUBLE_TANH: [&str; 5] = [
    "viscous friction Bv",
    "Coulomb friction Bf1",
    "Coulomb friction Bf2",
    "slope w1 of the first Coulomb term",
    "slope w2 of the second Coulomb term",
];

impl<const J: usize> Plant<J> {
    /// Every true parameter: the inertial ones, then friction and offset joint by joint.
    pub fn parameters(&self) -> Vec<Parameter> {
        let robot = &self.mechanism.robot;
        let inertial = robot.parameters().iter().zip(self.theta());
        let inertial = inertial.map(|(info, value)| Parameter {
            theta: info.theta,
            ..parameter(&info.name, None, *value, &info.unit, &info.meaning)
        });
        let mut parameters: Vec<Parameter> = inertial.collect();
        for (j, (joint, law)) in robot.joint_names().iter().zip(&self.laws).enumerate() {
            let torque = robot.joint_unit(j);
            let own = |name: &str, value: f64, meaning: &str| {
                let unit = friction_unit(robot, j, name, torque);
                parameter(name, Some(joint), value, &unit, meaning)
            };
            match law {
                SmoothFriction::DoubleTanh(law) => {
                    let named = DoubleTanh::NAMES.iter().zip(DOUBLE_TANH);
                    let rows = named.zip(law.parameters()).enumerate();
                    parameters.extend(rows.map(|(k, ((name, meaning), value))| Parameter {
                        theta: robot.friction_theta(j, k),
                        ..own(name, value, meaning)
                    }));
                }
                SmoothFriction::ViscousCoulomb { law, .. } => parameters.extend([
                    own("viscous", law.viscous, "viscous friction Fv"),
                    own("coulomb", law.coulomb, "Coulomb friction Fc"),
                ]),
            }
            if self.offset[j] != 0.0 {
                parameters.push(own("offset", self.offset[j], "torque offset"));
            }
        }
        parameters
    }
}

/// A true parameter.
pub(super) fn parameter(
    name: &str,
    joint: Option<&str>,
    value: f64,
    unit: &str,
    meaning: &str,
) -> Parameter {
    Parameter {
        name: name.to_owned(),
        theta: None,
        joint: joint.map(str::to_owned),
        value,
        consistent: None,
        std: None,
        unit: unit.to_owned(),
        meaning: meaning.to_owned(),
        verdict: None,
    }
}

impl TruthFile {
    /// The file's text, or what the TOML writer says of a number that it cannot write.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string_pretty(self)
    }

    /// The truth from the file's text, or what the TOML reader says, with line and column.
    pub fn parse(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }
}
