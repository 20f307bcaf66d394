//! Filtered columns of a candidate over every stretch.

use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::rests::{standing, weigh};
use crate::diagnose::problem::rows::scene;
use crate::effect::{Added, AugmentedModel, Torques, shifted};
use crate::motion::MotionError;

/// `[stretch][joint][column][row]`; no columns where the joint is not touched.
pub type CandidateColumns = Vec<Vec<Vec<Vec<f64>>>>;

/// Filtered columns of an effect over every stretch.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn columns(
    model: &AugmentedModel,
    problem: &FitProblem,
    torques: &[Torques],
    effect: &Added,
) -> Result<CandidateColumns, MotionError> {
    let joints = model.model.robot.joints();
    let mut out = Vec::with_capacity(torques.len());
    for (i, (stretch, torques)) in problem.stretches.iter().zip(torques).enumerate() {
        let scene = scene(model, stretch, torques);
        let mut of_stretch = Vec::with_capacity(joints);
        for j in 0..joints {
            if !effect.place.touches(j) || problem.split.ignores(i, j) {
                of_stretch.push(Vec::new());
                continue;
            }
            let mut raw = effect.columns(&scene, j);
            for column in &mut raw {
                shifted(column, model.shift(j) / stretch.dt);
            }
            let channels: Vec<&[f64]> = raw.iter().map(Vec::as_slice).collect();
            let filter = problem.filters.of(stretch);
            let mut rows = filter.run(&channels)?;
            let still = standing(model, stretch, filter, j);
            let weight = match effect.at_rest() {
                true => problem.rest_weight[j],
                false => 0.0,
            };
            rows.iter_mut()
                .for_each(|column| weigh(column, &still, weight));
            of_stretch.push(rows);
        }
        out.push(of_stretch);
    }
    Ok(out)
}

/// Part of the columns' power that the parallel filter keeps, over the fitted stretches.
pub(crate) fn kept_by_filter(
    model: &AugmentedModel,
    problem: &FitProblem,
    torques: &[Torques],
    effect: &Added,
) -> Result<f64, MotionError> {
    let Some(j) = effect.place.joint() else {
        return Ok(1.0);
    };
    let (mut before, mut after) = (0.0, 0.0);
    for (stretch, torques) in problem.stretches.iter().zip(torques) {
        let scene = scene(model, stretch, torques);
        for mut column in effect.columns(&scene, j) {
            before += column.iter().map(|x| x * x).sum::<f64>();
            problem.filters.of(stretch).smooth(&mut column)?;
            after += column.iter().map(|x| x * x).sum::<f64>();
        }
    }
    Ok(after / before.max(f64::MIN_POSITIVE))
}
