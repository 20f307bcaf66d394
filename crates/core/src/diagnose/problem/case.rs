//! What a diagnosis is given: a model, logs, what is known and open, and what the user asks for.

use super::data_split::LogRole;
use super::prior::ParameterPrior;
use super::unknowns::FreeParameters;
use crate::effect::{AugmentedModel, Law};
use crate::judge::Numbers;
use crate::motion::{ParallelFilters, Stretch};
use crate::robot::drive::JointDrive;

/// What a diagnosis works on.
pub struct Case {
    /// The declared model as it was given.
    pub given: AugmentedModel,
    pub prior: ParameterPrior,
    pub open: FreeParameters,
    pub stretches: Vec<Stretch>,
    /// Role of each log.
    pub roles: Vec<LogRole>,
    pub filters: ParallelFilters,
    pub cutoff_hz: f64,
    /// Speed up to which each joint rests [m/s or rad/s].
    pub rest_speed: Vec<f64>,
    /// What turns each joint, as far as it is declared.
    pub drives: Vec<JointDrive>,
    /// Torque unit per joint.
    pub units: Vec<String>,
    /// Torques are means of two rows, as by a zero-order hold.
    pub averaged: bool,
    /// The inertial parameters of the given model are kept.
    pub keep: bool,
    /// Names of effects that are not tried.
    pub without: Vec<String>,
    /// Effects of the user's own, tried beside those that are known.
    pub own: Vec<&'static Law>,
    /// What the user asks for.
    pub wishes: Wishes,
    /// What decides.
    pub numbers: Numbers,
}

/// What the user asks for besides.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Wishes {
    /// The written model is halfway between the given one and that of the judge.
    pub cautious: bool,
    /// Effects that are written whatever the judge says: name, and joint where it is of one.
    pub accepted: Vec<(String, Option<String>)>,
}

impl Case {
    /// The stretches of logs with a role.
    pub(crate) fn stretches_of(&self, role: LogRole) -> Vec<Stretch> {
        let of_role = |s: &&Stretch| self.roles[s.log] == role;
        self.stretches.iter().filter(of_role).cloned().collect()
    }
}
