//! What an effect's size is measured by.

use crate::diagnose::problem::data_split::DataSplit;
use crate::diagnose::problem::fit::FittedModel;
use crate::effect::Place;

/// Residual and noise before anything was added, per joint.
#[derive(Debug, Clone, Copy)]
pub struct Baseline<'a> {
    /// Squared residual of the declared model over the fitted rows.
    pub declared: &'a [f64],
    /// Variance of the noise in the filtered residual.
    pub noise: &'a [f64],
}

impl Baseline<'_> {
    /// Weighted square of the declared model's residual on the joints of a place.
    pub(crate) fn declared_square(&self, at: &FittedModel, place: Place) -> f64 {
        let joints = (0..self.declared.len()).filter(|j| place.touches(*j));
        let squares = joints.map(|j| at.weights[j].powi(2) * self.declared[j]);
        squares.sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Weighted square of the noise on the joints of a place, over the fitted rows.
    pub(crate) fn noise_square(&self, at: &FittedModel, split: &DataSplit, place: Place) -> f64 {
        let joints = (0..self.noise.len()).filter(|j| place.touches(*j));
        let of_joint = |j: usize| {
            let rows = split.fitted_rows_of(j) as f64;
            // where the noise is overrated, what is left counts
            rows * (at.weights[j].powi(2) * self.noise[j]).min(1.0)
        };
        joints.map(of_joint).sum::<f64>().max(f64::MIN_POSITIVE)
    }
}
