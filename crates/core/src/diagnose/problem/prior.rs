//! What is known of the parameters before the fit, as the friction stage left it.

use nalgebra::{DMatrix, DVector};

use super::unknowns::{Unknown, Unknowns};
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
    /// Index of an unknown in the model's own order; none for effects.
    fn place(&self, unknown: Unknown) -> Option<usize> {
        let model = &self.centre.model;
        let theta = model.theta.len();
        match unknown {
            Unknown::Theta(i) => Some(i),
            Unknown::Friction { joint, k } => {
                let before: usize = model.friction[..joint].iter().map(|f| f.parameters()).sum();
                Some(theta + before + k)
            }
            Unknown::Offset(j) => {
                let all: usize = model.friction.iter().map(|f| f.parameters()).sum();
                Some(theta + all + j)
            }
            Unknown::Linear { .. } | Unknown::Shape { .. } => None,
        }
    }

    /// How far a model is from the centre; effects have none.
    pub fn off(&self, unknowns: &Unknowns, model: &AugmentedModel) -> DVector<f64> {
        let off = unknowns.list.iter().map(|x| match self.place(*x) {
            Some(_) => value(&self.centre, *x) - value(model, *x),
            None => 0.0,
        });
        DVector::from_iterator(unknowns.len(), off)
    }

    /// Information and its pull on the present model, over the unknowns.
    pub fn over(
        &self,
        unknowns: &Unknowns,
        model: &AugmentedModel,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let u = unknowns.len();
        let places: Vec<Option<usize>> = unknowns.list.iter().map(|x| self.place(*x)).collect();
        let mut information = DMatrix::zeros(u, u);
        for (a, pa) in places.iter().enumerate() {
            for (b, pb) in places.iter().enumerate() {
                if let (Some(pa), Some(pb)) = (pa, pb) {
                    information[(a, b)] = self.rows_per_independent * self.information[(*pa, *pb)];
                }
            }
        }
        let pull = &information * self.off(unknowns, model);
        (information, pull)
    }
}

/// Value of an unknown in a model; 0 for an effect that it does not have.
pub fn value(model: &AugmentedModel, unknown: Unknown) -> f64 {
    match unknown {
        Unknown::Theta(i) => model.model.theta[i],
        Unknown::Offset(j) => model.model.offset[j],
        Unknown::Friction { joint, k } => {
            use crate::robot::model::JointFriction as F;
            match &model.model.friction[joint] {
                F::None => 0.0,
                F::DoubleTanh(law) => law.parameters()[k],
                F::ViscousCoulomb(law) => [law.viscous, law.coulomb][k],
            }
        }
        Unknown::Linear { effect, k } => model.effects.get(effect).map_or(0.0, |e| e.linear[k]),
        Unknown::Shape { effect, k } => model.effects.get(effect).map_or(0.0, |e| e.shape[k]),
    }
}
