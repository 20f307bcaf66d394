//! What is known of the parameters before the fit, as the friction stage left it.

use nalgebra::{DMatrix, DVector};

use super::unknowns::{DiagnosisUnknowns, Unknown, value_of};
use crate::effect::AugmentedModel;
use crate::robot::model::JointFriction;

/// What is known of parameters before: their values and how firmly, in units of independent rows.
#[derive(Debug, Clone)]
pub struct ParameterPrior {
    /// The model about which it is centred.
    pub centre: AugmentedModel,
    /// Information (inverse covariance) in the order of [`crate::robot::model::Model::gradient`],
    /// row-major.
    pub information: DMatrix<f64>,
    /// Rows that count as one independent row.
    pub rows_per_independent: f64,
    /// How many times as firm as its information it stands against the data; 1 but for what is held.
    pub firmness: f64,
}

impl ParameterPrior {
    /// Rows that its information counts in.
    pub(crate) fn rows(&self) -> f64 {
        self.firmness * self.rows_per_independent
    }

    /// Index of an unknown in the model's own order.
    fn place(&self, unknown: Unknown) -> usize {
        let model = &self.centre.model;
        let behind = |joints: &[JointFriction]| {
            let friction: usize = joints.iter().map(|f| f.parameters()).sum();
            model.theta.len() + friction
        };
        match unknown {
            Unknown::Theta(i) => i,
            Unknown::Friction { joint, k } => behind(&model.friction[..joint]) + k,
            Unknown::Offset(j) => behind(&model.friction) + j,
        }
    }

    /// Information and its pull on the present model, over the unknowns.
    pub(crate) fn over(
        &self,
        unknowns: &DiagnosisUnknowns,
        model: &AugmentedModel,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let u = unknowns.len();
        let places: Vec<usize> = unknowns.list.iter().map(|x| self.place(*x)).collect();
        let information = DMatrix::from_fn(u, u, |a, b| {
            self.rows() * self.information[(places[a], places[b])]
        });
        let off = unknowns.list.iter();
        let off = off.map(|x| value_of(&self.centre, *x) - value_of(model, *x));
        let pull = &information * DVector::from_iterator(u, off);
        (information, pull)
    }

    /// What it takes for values of the unknowns about a model, in weighted squares.
    pub(crate) fn cost(
        &self,
        unknowns: &DiagnosisUnknowns,
        (model, values): (&AugmentedModel, &DVector<f64>),
    ) -> f64 {
        let (information, _) = self.over(unknowns, model);
        let off =
            |(x, value): (&Unknown, &f64)| value_of(model, *x) + value - value_of(&self.centre, *x);
        let off = unknowns.list.iter().zip(values).map(off);
        let off = DVector::from_iterator(unknowns.len(), off);
        off.dot(&(information * &off))
    }
}
