//! The joint fit of everything: Gauss-Newton on the filtered rows, linear parameters exactly in one
//! step, with the friction stage's covariance as a prior.

use nalgebra::{DMatrix, DVector};

use super::data_split::{DataSplit, RowRole};
use super::fit_problem::FitProblem;
use super::normal_equations::{Base, PieceSums};
use super::unknowns::{Unknown, Unknowns, step};
use crate::effect::AugmentedModel;
use crate::math::descent::{StepControl, Trial, descend};
use crate::math::rank_revealing::RankRevealingInverse;
use crate::motion::MotionError;

/// A fitted model with the linear system at its solution.
pub struct FittedModel {
    pub model: AugmentedModel,
    pub base: Base,
    /// 1 / residual rms of each joint.
    pub weights: Vec<f64>,
    /// Weighted normal matrix of the fitted rows, prior included.
    pub normal: DMatrix<f64>,
    /// Prior information over the unknowns.
    pub information: DMatrix<f64>,
    /// Pull of data and prior together; none at the solution.
    pub pull: DVector<f64>,
    /// Weighted squared residual of the fitted rows.
    pub square: f64,
}

/// Most Gauss-Newton steps; nearly linear problems take two or three.
const STEPS: usize = 12;
/// First steps, in which the shapes of effects are fixed and the weights follow the residual.
const EARLY: usize = 2;
/// Lengths that a step is tried with.
const LENGTHS: u32 = 6;
/// A step that promises less than this share of the squares is the last.
const SETTLED: f64 = 1e-9;

/// Fits all unknowns of a model from where it stands.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn fit(start: &AugmentedModel, problem: &FitProblem) -> Result<FittedModel, MotionError> {
    gauss_newton(evaluate(start.clone(), problem, None)?, problem, None)
}

/// Fits a fitted model to another problem in the weights that it has; what these data did not determine stays.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn refit(at: &FittedModel, problem: &FitProblem) -> Result<FittedModel, MotionError> {
    let begun = at.with(at.model.clone(), problem)?;
    let known = RankRevealingInverse::of(&at.normal);
    gauss_newton(begun, problem, Some(&known))
}

/// Gauss-Newton steps to the least square; `known` says what stays where it is, and that the weights do.
fn gauss_newton(
    begun: FittedModel,
    problem: &FitProblem,
    known: Option<&RankRevealingInverse>,
) -> Result<FittedModel, MotionError> {
    let control = StepControl::halving(LENGTHS);
    let most = STEPS * LENGTHS as usize;
    let ((at, _), ..) = descend((begun, 0), &control, most, &mut |(at, k), length| {
        // an effect that has just come meets parameters fitted without it: its coefficients first
        let list = &at.base.unknowns.list;
        let early = |i: usize| *k < EARLY && matches!(list[i], Unknown::Shape { .. });
        let redundant = |i: usize| known.is_some_and(|inverse| inverse.redundant(i));
        let (delta, gain) = at.newton(&|i| early(i) || redundant(i));
        let scaled: Vec<f64> = delta.iter().map(|d| length * d).collect();
        let mut model = at.model.clone();
        step(&mut model, &at.base.unknowns, &scaled, &problem.cover);
        let tried = at.with(model, problem)?;
        let highest = at.objective(problem) * (1.0 + 1e-12);
        let lower = tried.objective(problem) <= highest;
        let last = gain <= SETTLED * at.square.max(f64::MIN_POSITIVE) || k + 1 == STEPS;
        Ok::<_, MotionError>(match (lower, *k < EARLY) {
            (false, _) => Trial::Rejected,
            (true, true) if known.is_none() => Trial::Accepted((tried.reweighted(problem), k + 1)),
            (true, false) if last => Trial::Last((tried, k + 1)),
            (true, _) => Trial::Accepted((tried, k + 1)),
        })
    })?;
    Ok(at)
}

/// The rows and sums of a model as it stands.
fn evaluate(
    model: AugmentedModel,
    problem: &FitProblem,
    weights: Option<&[f64]>,
) -> Result<FittedModel, MotionError> {
    let unknowns = Unknowns::of(&model, problem.open, &problem.cover);
    let base = Base::of(
        &model,
        unknowns,
        (problem.stretches, &problem.inertial),
        (problem.filters, &problem.rest_weight),
        (&problem.split, &problem.inertial_sums),
    )?;
    let weights = match weights {
        Some(w) => w.to_vec(),
        None => weights_of(&base, problem),
    };
    Ok(FittedModel::of_sums(model, base, weights, problem))
}

fn weights_of(base: &Base, problem: &FitProblem) -> Vec<f64> {
    let rms = base.residual_rms(&problem.split).into_iter();
    rms.map(|s| if s > 0.0 { 1.0 / s } else { 0.0 }).collect()
}

impl FittedModel {
    /// A model whose rows are summed.
    pub(crate) fn of_sums(
        model: AugmentedModel,
        base: Base,
        weights: Vec<f64>,
        problem: &FitProblem,
    ) -> Self {
        let total = base.total(&problem.split, &weights, &RowRole::fitted);
        let (information, pull) = problem.prior.over(&base.unknowns, &model);
        FittedModel {
            normal: total.normal + &information,
            pull: pull + total.score,
            information,
            square: total.square,
            weights,
            model,
            base,
        }
    }

    /// Another model in the weights of this one.
    ///
    /// # Errors
    /// [`MotionError`] of the filter.
    pub fn with(
        &self,
        model: AugmentedModel,
        problem: &FitProblem,
    ) -> Result<FittedModel, MotionError> {
        evaluate(model, problem, Some(&self.weights))
    }

    fn reweighted(self, problem: &FitProblem) -> Self {
        let weights = weights_of(&self.base, problem);
        FittedModel::of_sums(self.model, self.base, weights, problem)
    }

    /// Weighted squares and the prior's share.
    fn objective(&self, problem: &FitProblem) -> f64 {
        let off = problem.prior.off(&self.base.unknowns, &self.model);
        self.square + (off.transpose() * &self.information * &off)[(0, 0)]
    }

    /// The step to the minimum of the linearised problem, and the squares that it promises to remove. What is
    /// declared comes first among the unknowns, so that an effect is redundant, and not the declared model.
    fn newton(&self, fixed: &dyn Fn(usize) -> bool) -> (DVector<f64>, f64) {
        let (mut normal, mut pull) = (self.normal.clone(), self.pull.clone());
        for i in (0..pull.len()).filter(|i| fixed(*i)) {
            normal.row_mut(i).fill(0.0);
            normal.column_mut(i).fill(0.0);
            pull[i] = 0.0;
        }
        let delta = RankRevealingInverse::of(&normal).solve(&pull);
        let gain = delta.dot(&pull);
        (delta, gain)
    }

    /// The least that the objective comes to from here by a linear step, with one unknown fixed.
    pub(crate) fn least_with_fixed(&self, problem: &FitProblem, fixed: Option<usize>) -> f64 {
        self.objective(problem) - self.newton(&|i| Some(i) == fixed).1
    }

    /// Squared residual of the fitted rows in given weights.
    pub(crate) fn square_with(&self, weights: &[f64], split: &DataSplit) -> f64 {
        self.squares_of(weights, split, &RowRole::fitted)
            .iter()
            .sum()
    }

    /// Squared residual of each veto piece in given weights.
    pub(crate) fn veto_squares(&self, weights: &[f64], split: &DataSplit) -> Vec<f64> {
        self.squares_of(weights, split, &|role| role == RowRole::Veto)
    }

    /// Squared residual of each wanted piece in given weights.
    fn squares_of(
        &self,
        weights: &[f64],
        split: &DataSplit,
        wanted: &dyn Fn(RowRole) -> bool,
    ) -> Vec<f64> {
        let square = |sums: &Vec<PieceSums>| -> f64 {
            let joints = sums.iter().zip(weights);
            joints.map(|(s, w)| w * w * s.square).sum()
        };
        let pieces = split.pieces.iter().zip(&self.base.sums);
        let wanted = pieces.filter(|(p, _)| wanted(p.role));
        wanted.map(|(_, sums)| square(sums)).collect()
    }
}
