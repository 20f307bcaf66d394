//! How sure the gains are, and which functions of them the rows leave open.
//!
//! Deviations come from leaving out one stretch of time after the other, each as long as residuals are
//! correlated (the jackknife of groups: Bell and McCaffrey 2002, Survey Methodology 28; one Gauss-Newton step
//! each). A gain often rests on few moments of a log, whose residuals the fit has made small: what the sandwich
//! of [`crate::inertia::covariance`] takes from them is too sure, and leaving them out is not.

use nalgebra::{DMatrix, DVector};

use super::GainFit;
use super::problem::GainProblem;
use super::search::{GainSolution, RANK_TOLERANCE};
use crate::inertia::covariance::{at_least, bandwidth};
use crate::inertia::solution::FitError;
use crate::math::rank;

/// Share of a gradient that may lie in an open direction: rounding, far from the tolerance of the rank.
const OPEN: f64 = 1e-4;

/// Inverse of the weighted normal matrix, and the directions that it leaves open.
struct NormalInverse {
    /// Directions that the rows determine, in which the normal matrix is 1, unknowns x their number.
    sure: DMatrix<f64>,
    /// Columns in scaled unknowns.
    open: DMatrix<f64>,
    scale: Vec<f64>,
}

impl NormalInverse {
    fn of(problem: &GainProblem, x: &DVector<f64>, weights: &[f64]) -> Result<Self, FitError> {
        let r = problem.linearised(x, weights);
        let u = r.ncols() - 1;
        let scale: Vec<f64> = (0..u).map(|c| r.column(c).norm()).collect();
        let unscale = |c: usize| if scale[c] > 0.0 { 1.0 / scale[c] } else { 0.0 };
        let scaled = DMatrix::from_fn(r.nrows(), u, |a, c| r[(a, c)] * unscale(c));
        let svd = rank::svd(&scaled)?;
        let kept = |k: &usize| svd.s[*k] > RANK_TOLERANCE * svd.s[0];
        let (sure, open): (Vec<usize>, Vec<usize>) = (0..svd.s.len()).partition(kept);
        let entry = |a: usize, c: usize| svd.v[(a, sure[c])] * unscale(a) / svd.s[sure[c]];
        Ok(NormalInverse {
            sure: DMatrix::from_fn(u, sure.len(), entry),
            open: svd.v.select_columns(&open),
            scale,
        })
    }

    /// Whether a function of this gradient is determined by the rows.
    fn determines(&self, gradient: &DVector<f64>) -> bool {
        // an unknown of a zero column is determined by nothing
        let sure = gradient.iter().zip(&self.scale);
        if sure.clone().any(|(g, s)| *g != 0.0 && *s <= 0.0) {
            return false;
        }
        let scaled = sure.map(|(g, s)| if *s > 0.0 { g / s } else { 0.0 });
        let scaled = DVector::from_iterator(gradient.len(), scaled);
        self.open.tr_mul(&scaled).norm() <= OPEN * scaled.norm()
    }
}

/// One block of time: its stretch, its score, and its weighted slopes in the directions that are reported.
struct BlockMoment {
    stretch: usize,
    score: DVector<f64>,
    normal: DMatrix<f64>,
}

fn moments(
    problem: &GainProblem,
    x: &DVector<f64>,
    weights: &[f64],
    sure: &DMatrix<f64>,
) -> Vec<BlockMoment> {
    let (mut out, mut shift) = (Vec::new(), 0);
    for set in &problem.sets {
        for block in &set.factors.blocks {
            let mut score = DVector::zeros(problem.unknowns());
            let mut normal = DMatrix::zeros(sure.ncols(), sure.ncols());
            for (j, r) in block.r.iter().enumerate() {
                let rows = problem.rows_of(x, r, j, set.loaded);
                let own = rows.slopes.tr_mul(&rows.residual);
                let places: Vec<usize> = (0..own.len()).map(|c| problem.unknown(j, c)).collect();
                for (c, s) in places.iter().zip(&own) {
                    score[*c] += weights[j] * weights[j] * s;
                }
                let slopes = rows.slopes * sure.select_rows(&places) * weights[j];
                normal += slopes.tr_mul(&slopes);
            }
            out.push(BlockMoment {
                stretch: shift + block.stretch,
                score,
                normal,
            });
        }
        shift += set.factors.blocks.last().map_or(0, |b| b.stretch) + 1;
    }
    out
}

/// What keeps the rest of a log apart from singular where one stretch determines all of a direction.
const LEFT: f64 = 1e-9;

/// Covariance of all unknowns.
fn covariance(
    problem: &GainProblem,
    x: &DVector<f64>,
    weights: &[f64],
    solved: &NormalInverse,
) -> DMatrix<f64> {
    let u = problem.unknowns();
    let sure = &solved.sure;
    let n = problem.joints() as f64;
    let rows = problem.rows.iter().sum::<f64>() / n;
    let freedom = rows / (rows - u as f64 / n).max(1.0);
    // weights are one over each joint's own noise: the normal matrix is the middle as well
    let textbook = sure * sure.transpose() * freedom;
    let moments = moments(problem, x, weights, sure);
    let scores = moments.iter().map(|m| (m.stretch, m.score.clone()));
    let scores: Vec<(usize, DVector<f64>)> = scores.collect();
    let sets = problem.sets.iter();
    let seconds = sets.fold(f64::INFINITY, |s, set| s.min(set.factors.block_seconds));
    let length = bandwidth(&scores, u, seconds).ceil() as usize + 1;
    let mut spread = DMatrix::zeros(u, u);
    let mut groups = 0;
    for stretch in moments.chunk_by(|a, b| a.stretch == b.stretch) {
        for group in stretch.chunks(length) {
            let mut left = DMatrix::identity(sure.ncols(), sure.ncols()) * (1.0 + LEFT);
            let mut score = DVector::zeros(u);
            for moment in group {
                left -= &moment.normal;
                score += &moment.score;
            }
            let Some(step) = left.lu().solve(&sure.tr_mul(&score)) else {
                continue;
            };
            let step = sure * step;
            spread.ger(1.0, &step, &step, 1.0);
            groups += 1;
        }
    }
    let share = 1.0 - 1.0 / f64::from(groups.max(1));
    at_least(spread * share, &textbook)
}

/// Rates the end of the search.
pub(super) fn certain(problem: &GainProblem, found: GainSolution) -> Result<GainFit, FitError> {
    let n = problem.joints();
    let weights: Vec<f64> = found.residual_std.iter().map(|s| 1.0 / s).collect();
    let solved = NormalInverse::of(problem, &found.x, &weights)?;
    let covariance = covariance(problem, &found.x, &weights, &solved);
    let x = &found.x;
    // of ln |c_j|, and with a payload of ln |c_j mu|
    let gradient = |j: usize| {
        let mut g = DVector::zeros(x.len());
        g[j] = 1.0 / x[j];
        if problem.loads() > 0 {
            g[problem.mass()] = 1.0 / x[problem.mass()];
        }
        g
    };
    let gradients: Vec<DVector<f64>> = (0..n).map(gradient).collect();
    let variance = |g: &DVector<f64>| g.dot(&(&covariance * g));
    let (gradients, reference) = match problem.loads() {
        0 => {
            let (reference, beside) = beside_one(&gradients, &solved, &variance);
            (beside, Some(reference))
        }
        _ => (gradients, None),
    };
    let mass = match reference {
        None => x[problem.mass()],
        Some(_) => 1.0,
    };
    let between = |a: usize, b: usize| gradients[a].dot(&(&covariance * &gradients[b]));
    let sure = |g: &DVector<f64>| g.iter().all(|x| x.is_finite()) && solved.determines(g);
    Ok(GainFit {
        channel: (0..n).map(|j| x[j] * mass).collect(),
        covariance: DMatrix::from_fn(n, n, between),
        determined: gradients.iter().map(sure).collect(),
        reference,
        residual_std: found.residual_std,
        iterations: found.iterations,
        ending: found.ending,
    })
}

/// The joint beside which most others are determined, and best; and the gradients of their differences to it.
fn beside_one(
    gradients: &[DVector<f64>],
    solved: &NormalInverse,
    variance: &dyn Fn(&DVector<f64>) -> f64,
) -> (usize, Vec<DVector<f64>>) {
    let beside = |reference: usize| -> Vec<DVector<f64>> {
        let all = gradients.iter();
        all.map(|g| g - &gradients[reference]).collect()
    };
    let rated = |reference: usize| {
        let mut differences = beside(reference);
        differences.retain(|g| solved.determines(g));
        let spread: f64 = differences.iter().map(variance).sum();
        (differences.len(), spread)
    };
    let best = (0..gradients.len())
        .map(|j| (rated(j), j))
        .max_by(|((a, x), i), ((b, y), j)| a.cmp(b).then(y.total_cmp(x)).then(j.cmp(i)));
    let reference = best.map_or(0, |(_, j)| j);
    (reference, beside(reference))
}
