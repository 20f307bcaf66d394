//! Covariance under correlated residuals, and what the known friction adds.
//!
//! Filtered residuals are correlated over many rows: the textbook covariance, which counts rows as
//! independent, is far too small. The middle of the sandwich is the long-run covariance of the
//! score, from block factors with Bartlett's weights (Newey and West 1987, Econometrica 55) and the
//! bandwidth of Andrews (1991, Econometrica 59). The friction's parameters enter through
//! b = tau - F(v): d theta/d theta_f = -A^-1 X' W G.

use nalgebra::{DMatrix, DVector};

use super::accumulate::{BlockFactors, JointFactor};
use super::columns::{GRADIENT, KnownFriction, RegressorColumns};
use super::solution::{FitInputs, WeightedSolution};
use crate::math::long_run::long_run;

/// What a fit's unknowns scatter by.
pub(super) struct FitCovariances {
    pub sandwich: DMatrix<f64>,
    /// With what the known friction adds.
    pub total: DMatrix<f64>,
    pub textbook: DMatrix<f64>,
    /// d theta / d(known friction) of each joint.
    pub sensitivity: Vec<Option<DMatrix<f64>>>,
}

pub(super) fn covariance(
    factors: &BlockFactors,
    joints: &[DMatrix<f64>],
    solution: &WeightedSolution,
    inputs: FitInputs,
    residual: &[f64],
) -> FitCovariances {
    let columns = &factors.columns;
    let weights = inputs.weights;
    let u = columns.unknowns();
    let rows = factors.rows_per_joint();
    let known = inputs.prior.map_or(DMatrix::zeros(u, u), |prior| {
        let rows = prior.rows.columns(0, u);
        rows.tr_mul(&rows) * prior.variance
    });
    // textbook: each joint's residual variance over its weighted normal matrix
    let mut meat = DMatrix::zeros(u, u);
    for (j, r) in joints.iter().enumerate() {
        let own = columns.unknowns_of(j);
        let x = r.columns(0, own);
        let normal = x.tr_mul(&x) * (weights[j].powi(4) * residual[j] * residual[j]);
        for a in 0..own {
            for b in 0..own {
                meat[(columns.unknown(j, a), columns.unknown(j, b))] += normal[(a, b)];
            }
        }
    }
    let freedom = rows / (rows - u as f64 / columns.joints as f64).max(1.0);
    let textbook = &solution.inverse * (meat + &known) * &solution.inverse * freedom;

    // score of every block, summed over joints: residuals of joints are correlated with one another
    let scores = scores(factors, &solution.theta, weights);
    let long = long_run(&scores, u, bandwidth(&scores, u, factors.block_seconds));
    let sandwich = &solution.inverse * (long + known) * &solution.inverse * freedom;
    // Correlation can only take certainty away here: where the estimate of the middle comes out
    // below the textbook's, the latter is the better one.
    let sandwich = at_least(sandwich, &textbook);

    let mut total = sandwich.clone();
    let mut sensitivity = Vec::with_capacity(columns.joints);
    for (j, r) in joints.iter().enumerate() {
        let Some(known) = &columns.known[j] else {
            sensitivity.push(None);
            continue;
        };
        let xg = factors.parts(r, j).with_gradient();
        let (s, added) = by_friction(columns, known, (j, weights[j]), &solution.inverse, &xg);
        total += added;
        sensitivity.push(Some(s));
    }
    FitCovariances {
        sandwich,
        total,
        textbook,
        sensitivity,
    }
}

/// d theta / d(known friction of joint j), by X'G of its rows, whose weight is given; and what that adds to the covariance.
pub(super) fn by_friction(
    columns: &RegressorColumns,
    known: &KnownFriction,
    (j, weight): (usize, f64),
    inverse: &DMatrix<f64>,
    xg: &DMatrix<f64>,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut global = DMatrix::zeros(columns.unknowns(), GRADIENT);
    for c in 0..xg.nrows() {
        for k in 0..GRADIENT {
            global[(columns.unknown(j, c), k)] = weight * weight * xg[(c, k)];
        }
    }
    let s = -(inverse * global);
    let covariance = DMatrix::from_fn(GRADIENT, GRADIENT, |a, b| known.covariance[a][b]);
    let added = &s * covariance * s.transpose();
    (s, added)
}

/// Score of every block at theta with its stretch, summed over joints.
fn scores(
    factors: &BlockFactors,
    theta: &DVector<f64>,
    weights: &[f64],
) -> Vec<(usize, DVector<f64>)> {
    let columns = &factors.columns;
    let mut out = Vec::new();
    for block in &factors.blocks {
        let first = out.len();
        let stretches = match &block.scores {
            None => vec![block.stretch],
            Some(scores) => scores.blocks.iter().map(|b| b.stretch).collect(),
        };
        let none = || DVector::zeros(columns.unknowns());
        out.extend(stretches.into_iter().map(|stretch| (stretch, none())));
        for (j, weight) in weights.iter().enumerate() {
            let own = factors.own_unknowns(theta, j);
            let each = match &block.scores {
                None => vec![factors.parts(&block.r[j], j).score(&own)],
                Some(scores) => {
                    let JointFactor { x, t, .. } = factors.parts(&block.r[j], j);
                    let (x, t) = (x.into_owned(), t.into_owned());
                    scores.at_theta(j, (&x, &t), &own).collect()
                }
            };
            for ((_, g), s) in out[first..].iter_mut().zip(&each) {
                columns.add_own(j, weight * weight, s, g);
            }
        }
    }
    out
}

/// Time over whose sums of scores correlation is taken [s]; filters alone make shorter ones alike.
const NEIGHBOUR_SECONDS: f64 = 0.25;
/// Least number of such neighbours that count as correlated, and least time where a block is longer than they are [s].
const LEAST_LAG: f64 = 4.0;
const LEAST_SECONDS: f64 = 1.25;

/// Andrews' automatic bandwidth for Bartlett's kernel, in blocks of `block_seconds`, from first-order autoregressions
/// of each score, equal weights after normalisation. Sums begin at every block, so that it does not matter
/// where the first one does.
pub fn bandwidth(scores: &[(usize, DVector<f64>)], u: usize, block_seconds: f64) -> f64 {
    let k = (NEIGHBOUR_SECONDS / block_seconds).round().max(1.0) as usize;
    let n = scores.len() as f64 / k as f64;
    let (mut c0, mut c1) = (DVector::<f64>::zeros(u), DVector::<f64>::zeros(u));
    let sum = |part: &[(usize, DVector<f64>)]| {
        let mut sum = DVector::<f64>::zeros(u);
        part.iter().for_each(|(_, score)| sum += score);
        sum
    };
    for pair in scores.windows(2 * k) {
        if pair[0].0 == pair[2 * k - 1].0 {
            let (a, b) = (sum(&pair[..k]), sum(&pair[k..]));
            c0 += a.component_mul(&a);
            c1 += a.component_mul(&b);
        }
    }
    let (mut above, mut below) = (0.0, 0.0);
    for (c0, c1) in c0.iter().zip(&c1).filter(|(c0, _)| **c0 > 0.0) {
        let rho = (c1 / c0).clamp(-0.97, 0.97);
        above += 4.0 * rho * rho / ((1.0 - rho).powi(6) * (1.0 + rho).powi(2));
        below += 1.0 / (1.0 - rho).powi(4);
    }
    if below <= 0.0 {
        return 0.0;
    }
    let lag = 1.1447 * (above / below * n).cbrt();
    // the parallel filter alone correlates neighbouring blocks; and a fifth of the record is the
    // longest correlation that it can still show
    let least = match block_seconds > NEIGHBOUR_SECONDS {
        true => (LEAST_SECONDS / block_seconds - 1.0).clamp(0.0, LEAST_LAG),
        false => LEAST_LAG,
    };
    let lag = lag.max(least).min(n / 5.0);
    (lag + 1.0) * k as f64 - 1.0
}

/// Scales rows and columns of a covariance so that no variance is below that of `floor`.
pub(super) fn at_least(mut c: DMatrix<f64>, floor: &DMatrix<f64>) -> DMatrix<f64> {
    let up = |i: usize| match (c[(i, i)], floor[(i, i)]) {
        (have, need) if have > 0.0 && have < need => (need / have).sqrt(),
        _ => 1.0,
    };
    let up: Vec<f64> = (0..c.nrows()).map(up).collect();
    for i in 0..c.nrows() {
        for j in 0..c.ncols() {
            c[(i, j)] *= up[i] * up[j];
        }
    }
    c
}
