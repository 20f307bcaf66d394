//! What a diagnosis is given: a model, logs, what is known and open, and what the user asks for.

use nalgebra::DMatrix;

use super::data_split::{DataSplit, LogRole};
use super::formula_numbers::FormulaNumbers;
use super::prior::ParameterPrior;
use super::unknowns::{DiagnosisUnknowns, FreeParameters};
use crate::effect::{AugmentedModel, Law, ModelEffect};
use crate::judge::Numbers;
use crate::motion::{ParallelFilters, Stretch};
use crate::robot::drive::JointDrive;

/// What a diagnosis works on.
pub struct DiagnosisCase {
    /// The declared model as it was fitted: what effects are looked for beside.
    pub given: AugmentedModel,
    /// The given model as torques are computed with it.
    pub in_use: AugmentedModel,
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
    /// Covariance of the inertial parameters of the given model, where these are kept.
    pub kept: Option<DMatrix<f64>>,
    /// Effects of the user's own, tried beside those that are known.
    pub own: Vec<&'static Law>,
    /// What the user asks for.
    pub wishes: DiagnosisOptions,
    /// What decides.
    pub numbers: Numbers,
    /// What decides on formulas.
    pub formula: FormulaNumbers,
}

/// What the user asks for besides.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DiagnosisOptions {
    /// Effects that are written whatever the judge says: name, and joint where it is of one.
    pub accepted: Vec<(String, Option<String>)>,
    /// A formula of what is left is looked for.
    pub search: bool,
}

impl DiagnosisOptions {
    /// Whether it is the formula that is searched, of some joint: `formula:JOINT`.
    pub(crate) fn is_formula(&self, (name, _): &(String, Option<String>)) -> bool {
        self.search && name == FORMULA
    }

    /// Whether the formula of a joint is to be written.
    pub(crate) fn wants_formula(&self, joint: &str) -> bool {
        let own = |w: &&(String, Option<String>)| w.1.as_deref() == Some(joint);
        self.accepted.iter().filter(own).any(|w| self.is_formula(w))
    }
}

/// As the user calls a formula that was searched.
const FORMULA: &str = "formula";

/// Name of the formula of a joint.
pub fn formula_name(joint: &str) -> String {
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
    let plain = joint.chars().map(|c| if is_name(c) { c } else { '_' });
    format!("formula-{}", plain.collect::<String>())
}

impl DiagnosisCase {
    /// The declared unknowns.
    pub fn unknowns(&self) -> DiagnosisUnknowns {
        DiagnosisUnknowns::of(&self.given, &self.open, self.kept.is_some())
    }

    /// Stretches, their filters, and the speeds up to which joints rest.
    pub(crate) fn rows(&self) -> (&[Stretch], &ParallelFilters, &[f64]) {
        (&self.stretches, &self.filters, &self.rest_speed)
    }

    pub(crate) fn split(&self) -> DataSplit {
        let robot = &self.given.model.robot;
        let filters = (&self.filters, self.cutoff_hz);
        DataSplit::of(robot, &self.stretches, &self.roles, filters)
    }

    /// Whether an effect is the one that is named, at the joint that is named.
    pub(crate) fn is_named(
        &self,
        effect: &ModelEffect,
        (name, joint): &(String, Option<String>),
    ) -> bool {
        effect.name() == name && effect.place.name(&self.given.model.robot) == *joint
    }

    /// The stretches of logs with a role.
    pub(crate) fn stretches_of(&self, role: LogRole) -> Vec<Stretch> {
        let of_role = |s: &&Stretch| self.roles[s.log] == role;
        self.stretches.iter().filter(of_role).cloned().collect()
    }
}
