//! What a diagnosis is given: a model, logs, what is known and open, and what the user asks for.

use std::fmt;

use nalgebra::DMatrix;

use super::data_split::{DataSplit, LogRole};
use super::formula_numbers::FormulaNumbers;
use super::prediction_numbers::PredictionNumbers;
use super::prior::ParameterPrior;
use super::unknowns::{DiagnosisUnknowns, FreeParameters};
use crate::effect::{AugmentedModel, Law, ModelEffect, ShapeSearch};
use crate::judge::Numbers;
use crate::motion::{ParallelFilters, Stretch};
use crate::number;
use crate::robot::Robot;
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
    /// What decides on terms that are written for prediction alone.
    pub prediction: PredictionNumbers,
}

/// An effect that is written whatever the judge says.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AcceptedEffect {
    pub name: String,
    /// Its joint, where it is of one.
    pub joint: Option<String>,
    /// What tells it from others of its name there: the order of a wave.
    pub shape: Vec<(String, f64)>,
}

impl AcceptedEffect {
    /// `NAME`, `NAME:JOINT`, or either with `:KEY=VALUE` of a shape.
    pub fn named(text: &str) -> Self {
        let valued = |text: &str| {
            let (key, value) = text.split_once('=')?;
            Some((key.to_owned(), value.parse::<f64>().ok()?))
        };
        let (plain, shape) = match text.rsplit_once(':') {
            Some((plain, last)) if valued(last).is_some() => (plain, valued(last)),
            _ => (text, None),
        };
        let (name, joint) = match plain.split_once(':') {
            Some((name, joint)) => (name, Some(joint.to_owned())),
            None => (plain, None),
        };
        AcceptedEffect {
            name: name.to_owned(),
            joint,
            shape: shape.into_iter().collect(),
        }
    }

    /// The one that names an effect of a robot and no other that its law allows beside it.
    pub fn of(effect: &ModelEffect, robot: &Robot) -> Self {
        let waves = effect.law.entry.search == ShapeSearch::Orders;
        let shape = effect.law.shape.iter().zip(&effect.shape);
        AcceptedEffect {
            name: effect.name().to_owned(),
            joint: effect.place.name(robot),
            shape: shape
                .filter(|_| waves)
                .map(|(key, x)| ((*key).to_owned(), *x))
                .collect(),
        }
    }

    /// Whether it names an effect.
    pub(crate) fn is(&self, effect: &ModelEffect, robot: &Robot) -> bool {
        let own = |key: &str| effect.law.shape.iter().position(|own| *own == key);
        let mut shape = self.shape.iter();
        effect.name() == self.name
            && effect.place.name(robot) == self.joint
            && shape.all(|(key, x)| own(key).is_some_and(|k| is_same_order(effect.shape[k], *x)))
    }
}

impl fmt::Display for AcceptedEffect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.name)?;
        if let Some(joint) = &self.joint {
            write!(f, ":{joint}")?;
        }
        for (key, x) in &self.shape {
            write!(f, ":{key}={}", number::significant(*x, 4))?;
        }
        Ok(())
    }
}

/// Part by which two orders differ at least.
const MIN_ORDER_DIFFERENCE: f64 = 0.02;

/// Whether two orders are those of one wave.
pub(crate) fn is_same_order(a: f64, b: f64) -> bool {
    (a - b).abs() < MIN_ORDER_DIFFERENCE * b.abs()
}

/// What the user asks for besides.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DiagnosisOptions {
    /// Effects that are written whatever the judge says.
    pub accepted: Vec<AcceptedEffect>,
    /// A formula of what is left is looked for.
    pub search: bool,
    /// Nothing is written for prediction alone.
    pub named_only: bool,
}

impl DiagnosisOptions {
    /// Whether it is the formula that is searched, of some joint: `formula:JOINT`.
    pub(crate) fn is_formula(&self, wanted: &AcceptedEffect) -> bool {
        self.search && wanted.name == FORMULA
    }

    /// Whether the formula of a joint is to be written.
    pub(crate) fn wants_formula(&self, joint: &str) -> bool {
        let own = |w: &&AcceptedEffect| w.joint.as_deref() == Some(joint);
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

    /// The stretches of logs with a role.
    pub(crate) fn stretches_of(&self, role: LogRole) -> Vec<Stretch> {
        let of_role = |s: &&Stretch| self.roles[s.log] == role;
        self.stretches.iter().filter(of_role).cloned().collect()
    }
}
