//! What each log calls for by itself: when its joints rest, and how its positions are smoothed.
//!
//! A rule that sees one log alone: a fit of several logs does not depend on how they are grouped, and a log may be
//! reduced before the others are there.

use serde::{Deserialize, Serialize};

use cft_ident_core::motion::position_cutoff::CutoffCost;

/// What one log calls for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LogSmoothing {
    /// Speed up to which each joint rests [m/s or rad/s].
    pub rest_speed: Vec<f64>,
    /// Cut-offs of the joints' position filters [Hz]; empty where they are not found from the log.
    pub cutoffs_hz: Vec<f64>,
    /// What the cut-offs cost.
    pub costs: CutoffCosts,
}

/// What cut-offs cost every joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CutoffCosts {
    /// Nothing for a joint that never moves.
    pub(crate) of_joint: Vec<Option<JointCost>>,
    /// Whether the friction that they are about was known: in torque then, else in parts of the Coulomb level.
    pub(crate) known: Vec<bool>,
    /// That of the robot file \[Hz\].
    pub(crate) declared: Option<f64>,
    /// That of a joint for which the logs determine none \[Hz\].
    pub(crate) plain: f64,
}

/// What the cut-off of one joint costs, and the best one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct JointCost {
    pub(crate) at: CutoffCost,
    pub(crate) best: CutoffCost,
}
