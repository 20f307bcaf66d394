//! What the data say about a parameter, and about a torque.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Verdict on an estimated parameter; limits on the relative standard deviation as in
/// [`verdict_of`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Relative standard deviation of at most 10 %, or negligible.
    Identified,
    /// Relative standard deviation of at most 50 %.
    Weak,
    /// The data do not determine it.
    NotIdentifiable,
    /// Only a one-sided 95 % bound is known: the value is that bound.
    LowerBound,
}

impl Verdict {
    /// The word in tables and files.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Identified => "identified",
            Verdict::Weak => "weak",
            Verdict::NotIdentifiable => "not-identifiable",
            Verdict::LowerBound => "lower-bound",
        }
    }
}

/// Largest relative standard deviation of an identified parameter.
pub const IDENTIFIED: f64 = 0.10;
/// Largest relative standard deviation of a weak parameter.
pub const WEAK: f64 = 0.50;

/// Verdict from value and standard deviation alone.
pub fn verdict_of(value: f64, std: f64) -> Verdict {
    let relative = std / value.abs();
    if relative <= IDENTIFIED {
        Verdict::Identified
    } else if relative <= WEAK {
        Verdict::Weak
    } else {
        Verdict::NotIdentifiable
    }
}

/// What is left of a joint's torque where something else acts on the arm.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TorqueOff {
    pub joint: String,
    /// Root mean square of what is left, by what the rest tells \[unit\].
    pub off: f64,
    pub unit: String,
}
