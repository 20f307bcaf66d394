//! What the processing of positions alone puts into the residual of a model that lacks nothing: a narrow position
//! filter smears reversals, and encoders' rounding passes into speeds where friction is steep.
//!
//! The motion through a filter several times as wide keeps what the model's filter can spoil. The model's torque
//! along it, less that along the motion as it was processed, is what smearing leaves in the residual. The wide
//! motion holds noise of its own, and so the processed motion is given as much before the two are compared; what
//! noise makes of the processed motion itself is found by adding noise of the same level (Cook and Stefanski 1994). The
//! difference goes through the parallel filter as a residual does.

use nalgebra::DVector;
use rayon::prelude::*;

use crate::diagnose::problem::data_split::DataSplit;
use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::normal_equations::dot;
use crate::diagnose::problem::rests::{standing, weigh};
use crate::diagnose::problem::wide_motion::WideMotion;
use crate::effect::AugmentedModel;
use crate::motion::{MotionError, ParallelFilters, Stretch};

/// Most of an artefact of processing that a residual may hold, over its size as found.
const MOST: f64 = 2.0;

/// What processing alone leaves in the residual.
pub struct Artefact {
    /// Filtered, `[stretch][joint][row]`.
    pub rows: Vec<Vec<Vec<f64>>>,
    /// What it pulls the unknowns by.
    pub pull: DVector<f64>,
}

impl Artefact {
    /// Of a model along the logs.
    ///
    /// # Errors
    /// [`MotionError`] of the filters.
    pub fn of(
        at: &FittedModel,
        problem: &FitProblem,
        wide: &WideMotion,
    ) -> Result<Self, MotionError> {
        let pairs = problem.stretches.par_iter().zip(&wide.stretches);
        let rows = pairs.enumerate().map(|(i, (stretch, wide_stretch))| {
            let joints = stretch.joints();
            match wide_stretch {
                Some(other) if !problem.split.idle(i) => {
                    along(at, problem, i, (stretch, other), &wide.filters)
                }
                _ => Ok(vec![Vec::new(); joints]),
            }
        });
        let rows = rows.collect::<Result<Vec<_>, MotionError>>()?;
        let pull = pull(at, &problem.split, &rows);
        Ok(Artefact { rows, pull })
    }
}

/// What is to be taken from the pull of a log because processing causes it: as much of the artefact's as is most
/// like it, within bounds. `like` is the product of two pulls in the metric of the fit.
pub fn taken(
    right: &DVector<f64>,
    artefact: &DVector<f64>,
    like: impl Fn(&DVector<f64>, &DVector<f64>) -> f64,
) -> DVector<f64> {
    let own = like(artefact, artefact);
    let times = match own > 0.0 {
        true => (like(artefact, right) / own).clamp(0.0, MOST),
        false => 0.0,
    };
    right - artefact * times
}

/// The artefact along one stretch, `[joint][row]`.
fn along(
    at: &FittedModel,
    problem: &FitProblem,
    i: usize,
    (stretch, wide): (&Stretch, &Stretch),
    wide_filters: &ParallelFilters,
) -> Result<Vec<Vec<f64>>, MotionError> {
    let parallel = problem.filters.of(stretch);
    let model = &at.model;
    // the seeds differ, for the wide motion's own noise is another one
    let noisy_wide = wide_filters
        .of(wide)
        .with_added_noise(wide, i as u64, 1.0)?;
    let as_noisy = plus_difference(stretch, &noisy_wide, wide);
    let noisy = parallel.with_added_noise(stretch, 1 + i as u64, 1.0)?;
    let hats = [wide, &as_noisy, stretch, &noisy].map(|s| model.reconstruct(s));
    let raw: Vec<Vec<f64>> = (0..stretch.joints())
        .map(|j| {
            let sample = |k: usize| hats[0][j][k] - hats[1][j][k] + hats[2][j][k] - hats[3][j][k];
            (0..stretch.len()).map(sample).collect()
        })
        .collect();
    let channels: Vec<&[f64]> = raw.iter().map(Vec::as_slice).collect();
    let mut rows = parallel.run(&channels)?;
    for (j, rows) in rows.iter_mut().enumerate() {
        if problem.split.ignores(i, j) {
            rows.clear();
            continue;
        }
        weigh(
            rows,
            &at_rest(model, stretch, problem, j),
            problem.rest_weight[j],
        );
    }
    Ok(rows)
}

fn at_rest(
    model: &AugmentedModel,
    stretch: &Stretch,
    problem: &FitProblem,
    j: usize,
) -> Vec<usize> {
    standing(model, stretch, problem.filters.of(stretch), j)
}

/// A motion with the difference of two others added.
fn plus_difference(motion: &Stretch, more: &Stretch, less: &Stretch) -> Stretch {
    let mut out = motion.clone();
    let channels = [
        (&mut out.q, &more.q, &less.q),
        (&mut out.v, &more.v, &less.v),
        (&mut out.a, &more.a, &less.a),
    ];
    for (out, more, less) in channels {
        for ((out, more), less) in out.iter_mut().zip(more).zip(less) {
            for ((x, m), l) in out.iter_mut().zip(more).zip(less) {
                *x += m - l;
            }
        }
    }
    out
}

/// What rows pull the unknowns by, over the fitted pieces.
fn pull(at: &FittedModel, split: &DataSplit, rows: &[Vec<Vec<f64>>]) -> DVector<f64> {
    let unknowns = &at.base.unknowns;
    let mut pull = DVector::zeros(unknowns.len());
    for piece in split.pieces.iter().filter(|p| p.role.fitted()) {
        let columns = &at.base.stretches[piece.stretch].columns;
        for (j, own) in rows[piece.stretch].iter().enumerate() {
            if own.is_empty() {
                continue;
            }
            let weight = at.weights[j] * at.weights[j];
            let e = &own[piece.rows.clone()];
            for (column, &u) in columns[j].iter().zip(&unknowns.columns[j]) {
                pull[u] += weight * dot(&column[piece.rows.clone()], e);
            }
        }
    }
    pull
}
