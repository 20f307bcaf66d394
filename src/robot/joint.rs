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
