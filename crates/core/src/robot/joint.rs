//! What a joint is, and the words that go with a parameter.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Kind of a joint: it decides the units of position and torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum JointKind {
    /// Position in m, force in N.
    Prismatic,
    /// Position in rad, torque in N m.
    Revolute,
}

impl JointKind {
    /// "N" or "Nm".
    pub const fn torque_unit(self) -> &'static str {
        match self {
            Self::Prismatic => "N",
            Self::Revolute => "Nm",
        }
    }

    /// "m" or "rad".
    pub const fn position_unit(self) -> &'static str {
        match self {
            Self::Prismatic => "m",
            Self::Revolute => "rad",
        }
    }

    /// "kg" or "kg m^2".
    pub const fn inertia_unit(self) -> &'static str {
        match self {
            Self::Prismatic => "kg",
            Self::Revolute => "kg m^2",
        }
    }

    /// Unit of an inertial parameter where torques of joints of this kind count in `torque`: as it is in N
    /// and Nm, else `torque` per acceleration, e.g. "A s^2/rad" for "kg m^2" and "A s^2/m" for "kg m".
    pub fn inertial_unit(self, si: &str, torque: &str) -> String {
        if matches!(torque, "N" | "Nm") {
            return si.to_owned();
        }
        match (self, si) {
            (Self::Revolute, "kg m^2") => format!("{torque} s^2/rad"),
            (Self::Revolute, "kg m") | (Self::Prismatic, "kg") => format!("{torque} s^2/m"),
            (Self::Revolute, "kg") => format!("{torque} s^2/m^2"),
            (Self::Prismatic, "kg m") => format!("{torque} s^2/rad"),
            (Self::Prismatic, "kg m^2") => format!("{torque} s^2 m"),
            (_, other) => other.to_owned(),
        }
    }
}

/// Name, unit and meaning of one inertial parameter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ParameterInfo {
    /// Name in files and reports.
    pub name: Cow<'static, str>,
    /// Number in the report's Table 4, where it has one.
    pub theta: Option<u32>,
    /// SI unit.
    pub unit: Cow<'static, str>,
    /// What it stands for, in link masses, centres of gravity and pseudo-inertias.
    pub meaning: Cow<'static, str>,
}
