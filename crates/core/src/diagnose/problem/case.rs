//! What a diagnosis is given: a model, logs, what is known and open, and how sure it must be.

use super::data_split::LogRole;
use super::prior::ParameterPrior;
use super::unknowns::FreeParameters;
use super::wide_motion::WideMotion;
use crate::effect::{AugmentedModel, Law, Torques};
use crate::motion::{ParallelFilters, Stretch};
use crate::robot::drive::JointDrive;

/// What a diagnosis works on.
pub struct Case {
    /// The declared model as it was given.
    pub given: AugmentedModel,
    pub prior: ParameterPrior,
    pub open: FreeParameters,
    pub stretches: Vec<Stretch>,
    /// Their motion through a wider filter, from which what processing adds is found; none where that is not
    /// asked for.
    pub wide: Option<WideMotion>,
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
    /// The given model is kept within its covariance.
    pub keep: bool,
    /// Names of effects that are not tried.
    pub without: Vec<String>,
    /// Effects of the user's own, tried beside those that are known.
    pub own: Vec<&'static Law>,
    pub limits: SelectionLimits,
}

/// Limits that a candidate must keep. All tests must agree.
#[derive(Debug, Clone, Copy)]
pub struct SelectionLimits {
    /// Chance of one false effect or more among all candidates, where nothing is missing.
    pub false_alarm: f64,
    /// Least share of the effect's torque that nothing declared can explain.
    pub unique_share: f64,
    /// Least fraction of cross-validated squared error removed.
    pub cv_gain: f64,
    /// Least cross-validated gain in its own standard errors.
    pub cv_certainty: f64,
    /// Largest squared error on the veto pieces, over that without the effect; a standard error of their
    /// difference comes on top.
    pub veto_ratio: f64,
    /// Least part of the declared model's squared residual, on the joints concerned, that it
    /// removes: below it an effect may be there and does not matter.
    pub worth: f64,
    /// Least power that it removes, over that of the noise.
    pub over_noise: f64,
    /// Most effects that are added; with none the given model is fitted and nothing is looked for.
    pub steps: usize,
    /// Whether standard deviations are worked out, which takes several fits, and what the residual depends on; without
    /// them the deviations are not a number.
    pub deviations: bool,
}

impl Default for SelectionLimits {
    fn default() -> Self {
        SelectionLimits {
            false_alarm: 0.01,
            unique_share: 0.001,
            cv_gain: 0.003,
            cv_certainty: 1.0,
            veto_ratio: 1.002,
            worth: 0.01,
            over_noise: 0.1,
            steps: 8,
            deviations: true,
        }
    }
}

impl Case {
    /// The stretches of logs with a role.
    pub(crate) fn stretches_of(&self, role: LogRole) -> Vec<Stretch> {
        let of_role = |s: &&Stretch| self.roles[s.log] == role;
        self.stretches.iter().filter(of_role).cloned().collect()
    }

    /// Those of the stretches' torques that belong to logs that are fitted.
    pub(crate) fn fitted_torques<'a>(
        &self,
        all: &'a [Torques],
    ) -> impl Iterator<Item = &'a Torques> {
        let pairs = self.stretches.iter().zip(all);
        let fitted = pairs.filter(|(s, _)| self.roles[s.log] == LogRole::Train);
        fitted.map(|(_, torques)| torques)
    }
}
