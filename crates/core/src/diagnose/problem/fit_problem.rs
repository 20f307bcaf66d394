//! Everything that a fit works on.

use rayon::prelude::*;

use super::data_split::DataSplit;
use super::normal_equations::InertialSums;
use super::prior::ParameterPrior;
use super::rows::{Inertial, inertial};
use super::unknowns::FreeParameters;
use crate::effect::{AugmentedModel, Cover, Torques};
use crate::motion::{MotionError, ParallelFilters, Stretch};
use crate::robot::Robot;

/// Data, which of their rows do what, and what is known and open beforehand.
pub struct FitProblem<'a> {
    pub stretches: &'a [Stretch],
    /// What the inertial parameters do along each of them.
    pub inertial: Vec<Inertial>,
    /// Their sums, of the pieces and the weights at rest as they are: to be emptied where these change.
    pub inertial_sums: InertialSums,
    pub filters: &'a ParallelFilters,
    pub split: DataSplit,
    pub open: &'a FreeParameters,
    pub prior: &'a ParameterPrior,
    pub cover: Cover,
    /// Weight of each joint's rows at rest, where its friction law jumps.
    pub rest_weight: Vec<f64>,
}

/// The filtered regressors of all stretches.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn inertial_of(
    robot: &Robot,
    stretches: &[Stretch],
    filters: &ParallelFilters,
    split: &DataSplit,
) -> Result<Vec<Inertial>, MotionError> {
    let all = stretches.par_iter().enumerate();
    all.map(|(i, stretch)| {
        let filter = filters.of(stretch);
        inertial(robot, stretch, filter, &|j| split.ignores(i, j))
    })
    .collect()
}

impl<'a> FitProblem<'a> {
    /// The same along other stretches.
    ///
    /// # Errors
    /// [`MotionError`] of the filter.
    pub fn along(&self, robot: &Robot, stretches: &'a [Stretch]) -> Result<Self, MotionError> {
        Ok(FitProblem {
            inertial: inertial_of(robot, stretches, self.filters, &self.split)?,
            inertial_sums: InertialSums::new(),
            stretches,
            split: self.split.clone(),
            cover: self.cover.clone(),
            rest_weight: self.rest_weight.clone(),
            ..*self
        })
    }

    /// Torques of a model along every stretch; none along those of held-out data.
    pub fn torques(&self, model: &AugmentedModel) -> Vec<Torques> {
        let stretches = self.stretches.par_iter().enumerate();
        let of = |(i, stretch): (usize, &Stretch)| match self.split.idle(i) {
            true => Torques::default(),
            false => model.torques(stretch),
        };
        stretches.map(of).collect()
    }
}
