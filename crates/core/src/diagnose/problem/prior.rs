//! What is known of the parameters before the fit, as the friction stage left it.

use nalgebra::{DMatrix, DVector};

use super::unknowns::{Unknown, Unknowns, value};
use crate::effect::AugmentedModel;

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
}

impl ParameterPrior {
    /// Index of an unknown in the model's own order.
    fn place(&self, unknown: Unknown) -> usize {
        let model = &self.centre.model;
        let theta = model.theta.len();
        match unknown {
            Unknown::Theta(i) => i,
            Unknown::Friction { joint, k } => {
                let before: usize = model.friction[..joint].iter().map(|f| f.parameters()).sum();
                theta + before + k
            }
            Unknown::Offset(j) => {
                let all: usize = model.friction.iter().map(|f| f.parameters()).sum();
                theta + all + j
            }
        }
    }

    /// How far a model is from the centre.
    fn off(&self, unknowns: &Unknowns, model: &AugmentedModel) -> DVector<f64> {
        let off = unknowns.list.iter();
        let off = off.map(|x| value(&self.centre, *x) - value(model, *x));
        DVector::from_iterator(unknowns.len(), off)
    }

    /// Information and its pull on the present model, over the unknowns.
    pub fn over(
        &self,
        unknowns: &Unknowns,
        model: &AugmentedModel,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let u = unknowns.len();
        let places: Vec<usize> = unknowns.list.iter().map(|x| self.place(*x)).collect();
        let information = DMatrix::from_fn(u, u, |a, b| {
            self.rows_per_independent * self.information[(places[a], places[b])]
        });
        let pull = &information * self.off(unknowns, model);
        (information, pull)
    }
}
