//! The truth of a simulated log, as it is written beside the log.
//!
//! Only `identify` may look at it, and only after everything is decided. Parameters carry the names,
//! joints and units of a model file, so that the two can be compared by key.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::cft::CftTruth;
use super::effects::EffectValue;
use super::serial::SerialTruth;
use super::single_joint::{SingleJointFriction, SingleJointTruth};
use crate::config::model_file::Parameter;
use crate::robot::cft::{EXTENDED, JOINTS};
use crate::robot::friction::DoubleTanh;
use crate::robot::{JointKind, ParameterInfo};

/// Content of LOG.truth.toml.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TruthFile {
    /// Version of the tool.
    pub version: String,
    /// Seed of everything that chance decided.
    pub seed: u64,
    /// "cft", "single-joint" or "serial".
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

/// Units and meanings of the double-tanh parameters, for a joint that slides and one that turns.
const DOUBLE_TANH: [(&str, &str, &str); 5] = [
    ("N s/m", "Nm s/rad", "viscous friction Bv"),
    ("N", "Nm", "Coulomb friction Bf1"),
    ("N", "Nm", "Coulomb friction Bf2"),
    ("s/m", "s/rad", "slope w1 of the first Coulomb term"),
    ("s/m", "s/rad", "slope w2 of the second Coulomb term"),
];

fn parameter(name: &str, joint: Option<&str>, value: f64, unit: &str, meaning: &str) -> Parameter {
    Parameter {
        name: name.to_owned(),
        theta: None,
        joint: joint.map(str::to_owned),
        value,
        std: None,
        unit: unit.to_owned(),
        meaning: meaning.to_owned(),
        verdict: None,
    }
}

fn inertial(info: &ParameterInfo, value: f64) -> Parameter {
    Parameter {
        theta: info.theta,
        ..parameter(&info.name, None, value, &info.unit, &info.meaning)
    }
}

fn double_tanh(law: &DoubleTanh, joint: &str, kind: JointKind) -> Vec<Parameter> {
    let rows = DoubleTanh::NAMES
        .iter()
        .zip(DOUBLE_TANH)
        .zip(law.parameters());
    rows.map(|((name, (slides, turns, meaning)), value)| {
        let unit = if kind == JointKind::Prismatic {
            slides
        } else {
            turns
        };
        parameter(name, Some(joint), value, unit, meaning)
    })
    .collect()
}

impl CftTruth {
    /// Every true parameter: theta_1..theta_12, the ten that the printed structure lacks where one of
    /// them is not zero, and theta_13..theta_32 joint by joint.
    pub fn parameters(&self) -> Vec<Parameter> {
        let full = self.theta[12..].iter().any(|x| *x != 0.0);
        let shown = if full { 22 } else { 12 };
        let pairs = EXTENDED.iter().zip(self.theta).take(shown);
        let mut parameters: Vec<Parameter> =
            pairs.map(|(info, value)| inertial(info, value)).collect();
        for (j, (joint, law)) in JOINTS.iter().zip(&self.friction).enumerate() {
            let kind = if j == 0 {
                JointKind::Prismatic
            } else {
                JointKind::Revolute
            };
            for (k, mut own) in double_tanh(law, joint, kind).into_iter().enumerate() {
                own.theta = Some((13 + 4 * k + j) as u32);
                parameters.push(own);
            }
        }
        parameters
    }
}

impl<const J: usize> SerialTruth<J> {
    /// Every true parameter: base parameters, then friction and offset joint by joint.
    pub fn parameters(&self) -> Vec<Parameter> {
        let (robot, theta) = self.rigid_body();
        let infos = robot.parameters().iter().zip(theta);
        let mut parameters: Vec<Parameter> =
            infos.map(|(info, value)| inertial(info, *value)).collect();
        for joint in &self.joints {
            // the joint's own, less the inertia that stands in the base parameters
            parameters.extend(joint.parameters().into_iter().skip(1));
        }
        parameters
    }
}

impl SingleJointTruth {
    /// Every true parameter: inertia, friction, offset.
    pub fn parameters(&self) -> Vec<Parameter> {
        let (slides, name) = (self.kind == JointKind::Prismatic, self.name.as_str());
        let unit = |prismatic: &'static str, revolute: &'static str| {
            if slides { prismatic } else { revolute }
        };
        let mut parameters = vec![parameter(
            "inertia",
            None,
            self.inertia,
            unit("kg", "kg m^2"),
            unit("moving mass", "moment of inertia about the joint axis"),
        )];
        match self.friction {
            SingleJointFriction::DoubleTanh(law) => {
                parameters.extend(double_tanh(&law, name, self.kind));
            }
            SingleJointFriction::ViscousCoulomb { law, .. } => parameters.extend([
                parameter(
                    "viscous",
                    Some(name),
                    law.viscous,
                    unit("N s/m", "Nm s/rad"),
                    "viscous friction Fv",
                ),
                parameter(
                    "coulomb",
                    Some(name),
                    law.coulomb,
                    unit("N", "Nm"),
                    "Coulomb friction Fc",
                ),
            ]),
        }
        if self.offset != 0.0 {
            let torque = unit("N", "Nm");
            parameters.push(parameter(
                "offset",
                Some(name),
                self.offset,
                torque,
                "torque offset",
            ));
        }
        parameters
    }
}

impl TruthFile {
    /// The file's text.
    ///
    /// # Errors
    /// What the TOML writer says of a number that it cannot write.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string_pretty(self)
    }

    /// The truth from the file's text.
    ///
    /// # Errors
    /// What the TOML reader says, with line and column.
    pub fn parse(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::cft::Setup;

    #[test]
    fn cft_parameters_carry_the_numbers_of_the_report() {
        let truth = CftTruth::synthetic(Setup::Tuedacs);
        let parameters = truth.parameters();
        assert_eq!(parameters.len(), 32);
        let mut numbers: Vec<u32> = parameters.iter().filter_map(|p| p.theta).collect();
        numbers.sort_unstable();
        assert_eq!(numbers, (1..=32).collect::<Vec<_>>());
        let friction = truth.friction_theta();
        for p in &parameters {
            let number = p.theta.expect("every parameter has a number") as usize;
            let value = if number <= 12 {
                truth.theta[number - 1]
            } else {
                friction[number - 13]
            };
            assert_eq!(p.value, value, "theta_{number}");
        }
        let mut full = truth;
        full.theta[17] = 0.1;
        assert_eq!(full.parameters().len(), 42);
    }
}
