//! What a diagnosis finds.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;

use super::candidates::candidate::Candidate;
use super::faults::disturbance::CutDisturbance;
use super::problem::data_split::SetAside;
use super::problem::unknowns::Unknown;
use super::uncertainty::covariance;
use super::unexplained::Unexplained;
use super::unexplained::dependence::Dependence;
use super::unexplained::errors::{Errors, JointChange};
use crate::effect::AugmentedModel;

/// Part of a joint's structure that may be left where effects are named for the rest of it.
const NAMED: f64 = 0.1;

/// One accepted effect.
#[derive(Debug, Clone)]
pub struct AcceptedEffect {
    /// Its place in the final model's effects.
    pub effect: usize,
    pub candidate: Candidate,
    /// Candidates that these data do not separate from it, best first.
    pub alternatives: Vec<Candidate>,
    /// Mean relative error on the holdout before and after the step.
    pub holdout: Option<[f64; 2]>,
    /// The same joint by joint.
    pub joints: Vec<JointChange>,
}

/// How firm the name of an effect is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum StepStatus {
    /// These data separate it from all other candidates, nothing else is left that chance does not explain, and
    /// held-out data confirm it.
    Assured,
    /// One of these does not hold.
    Tentative,
    /// A curve that was measured, and no named law.
    Empirical,
}

impl AcceptedEffect {
    /// Whether held-out data confirm the step: the 95 % CI of the change of the error lies below zero
    /// on a joint, and no joint is noticeably worse.
    pub fn confirmed(&self) -> bool {
        self.joints.iter().any(JointChange::improved)
            && !self.worse_over_joints()
            && !self.joints.iter().any(JointChange::noticeably_worse)
    }

    /// Whether it makes held-out data worse as the rms over the joints.
    pub fn worse_over_joints(&self) -> bool {
        self.holdout.is_some_and(|[before, after]| after > before)
    }

    /// Whether it makes held-out data worse: as the rms over the joints, or on one of them by its
    /// whole interval.
    pub fn worsens(&self) -> bool {
        self.worse_over_joints() || self.joints.iter().any(|j| j.worsened)
    }
}

/// One turn of the search.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Turn {
    /// An effect was added.
    Added(String),
    /// An effect went: it does not stand beside the others, or its numbers do not hold with them.
    Dropped(String),
    /// Effects went for others that say the same with fewer numbers, or more.
    Replaced {
        gone: Vec<String>,
        come: Vec<String>,
    },
}

/// Errors before or after.
#[derive(Debug, Clone)]
pub struct SplitErrors {
    pub train: Errors,
    pub holdout: Option<Errors>,
}

/// The outcome.
pub struct Diagnosis {
    /// The model with what was added, all refitted; the given one where nothing was added.
    pub model: AugmentedModel,
    /// Unknowns of the final fit and their covariance; where nothing was added, of the given model's refit.
    pub unknowns: Vec<Unknown>,
    pub covariance: DMatrix<f64>,
    pub steps: Vec<AcceptedEffect>,
    /// How the search came to them.
    pub path: Vec<Turn>,
    /// Candidates of the last round, in which none was accepted.
    pub candidates: Vec<Candidate>,
    pub before: SplitErrors,
    /// The declared model refitted to these logs, with nothing added.
    pub refitted: Errors,
    pub after: SplitErrors,
    pub unexplained: Vec<Unexplained>,
    /// What the residuals of joints with structure depend on, the strongest of each joint first.
    pub dependence: Vec<Dependence>,
    /// Part of the structure of each joint's residual that is unexplained on the fitted logs.
    pub part_unexplained: Vec<f64>,
    pub set_aside: Vec<SetAside>,
    /// Disturbances that were cut out of the logs.
    pub disturbances: Vec<CutDisturbance>,
    /// Root mean square of the filtered residual per joint.
    pub residual_std: Vec<f64>,
    /// Logs that were fitted: the first ones.
    pub fitted_logs: usize,
}

impl Diagnosis {
    /// Whether some joint's residual still holds structure.
    pub fn structured(&self) -> bool {
        self.structured_joints().next().is_some()
    }

    /// Joints whose residual still holds structure.
    pub fn structured_joints(&self) -> impl Iterator<Item = usize> {
        let joints = self.unexplained.iter().enumerate();
        joints
            .filter(|(_, left)| left.is_structure())
            .map(|(j, _)| j)
    }

    /// Candidates of the last round that are significant and were not added, for they are too small or came after
    /// the last that is looked for: treat the effects that were added as approximations then.
    pub fn remainder(&self) -> impl Iterator<Item = &Candidate> {
        self.candidates.iter().filter(|c| c.significant)
    }

    /// Whether what was added leaves nothing above noise on any joint. Otherwise it lowers the
    /// error and may take the place of an effect that the catalogue does not have: joints share inertial
    /// parameters, and what is missing on one forges effects on the others.
    pub fn assured(&self) -> bool {
        !self.structured() && self.remainder().next().is_none()
    }

    /// How firm the name of a step's effect is.
    pub fn status(&self, step: &AcceptedEffect) -> StepStatus {
        if self.model.effects[step.effect].curve().is_some() {
            return StepStatus::Empirical;
        }
        match step.alternatives.is_empty() && self.assured() && step.confirmed() {
            true => StepStatus::Assured,
            false => StepStatus::Tentative,
        }
    }

    /// Whether what was added leaves at most a small part of the structure on the joints that a step's effect
    /// touches, so that there is something to its name.
    pub fn explained(&self, step: &AcceptedEffect) -> bool {
        let place = self.model.effects[step.effect].place;
        let mut open = self.structured_joints().filter(|j| place.touches(*j));
        open.all(|j| self.part_unexplained[j] <= NAMED)
    }

    /// Covariance of (shape, linear) of one effect, row-major; a shape that was not refined has none.
    pub fn covariance_of(&self, effect: usize) -> Vec<f64> {
        covariance::of_effect(&self.unknowns, &self.covariance, &self.model, effect)
    }
}
