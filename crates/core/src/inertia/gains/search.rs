//! The most likely gains: Gauss-Newton on the bilinear problem, the linear unknowns solved anew for every
//! trial of the gains (Golub and Pereyra 2003, Inverse Problems 19).
//!
//! It begins from total least squares with the channels among the columns: with weights 1/(g_j std_j) the noise of the n
//! channel columns is alike, and the right singular vector of the smallest singular value holds the gains.

use nalgebra::{DMatrix, DVector};

use super::problem::GainProblem;
use crate::inertia::solution::FitError;
use crate::math::descent::IterationEnding;
use crate::math::rank;
use crate::math::rfactor::RFactor;

/// Where the search ended.
pub(super) struct GainSolution {
    pub x: DVector<f64>,
    pub residual_std: Vec<f64>,
    pub iterations: usize,
    pub ending: IterationEnding,
}

const MOST_STEPS: usize = 100;
/// Rounds of total least squares, whose weights come from the round before.
const ROUNDS: usize = 3;
/// Fall of the criterion that ends the search: a step of less than a thousandth of a deviation with 5 million rows.
const SETTLED: f64 = 1e-13;
/// Singular values of the scaled columns below this share of the largest are rounding.
pub(super) const RANK_TOLERANCE: f64 = 1e-8;

/// Searches from equal channels and from the total least squares; the more likely end stands.
pub(super) fn search(problem: &GainProblem) -> Result<GainSolution, FitError> {
    let n = problem.joints();
    let equal = DVector::from_element(n, 1.0);
    let mut starts = vec![equal];
    let mut gains: Vec<f64> = vec![1.0; n];
    let mut std = problem.channel_rms.clone();
    for _ in 0..ROUNDS {
        let found = total_least_squares(problem, &gains, &std)?;
        // a joint that the others do not tie to them has no gain here
        let largest = found.iter().fold(0.0, |a: f64, g| a.max(g.abs()));
        if found.iter().any(|g| g.abs() <= 1e-9 * largest) {
            break;
        }
        let c = DVector::from_iterator(n, found.iter().map(|g| 1.0 / g));
        std = problem.residual_std(&linear(problem, &c, &inverse(&std))?);
        starts.push(c);
        gains = found;
    }
    let starts = [starts.first(), starts.last()].into_iter().flatten();
    let mut best: Option<(f64, GainSolution)> = None;
    for c in starts {
        let found = descend(problem, c.clone())?;
        let value = criterion(problem, &found.residual_std);
        if best.as_ref().is_none_or(|(least, _)| value < *least) {
            best = Some((value, found));
        }
    }
    best.map(|(_, found)| found).ok_or(FitError::NothingExcited)
}

fn descend(problem: &GainProblem, start: DVector<f64>) -> Result<GainSolution, FitError> {
    let n = problem.joints();
    let mut std = problem.channel_rms.clone();
    let mut x = linear(problem, &levelled(start), &inverse(&std))?;
    std = problem.residual_std(&x);
    let mut value = criterion(problem, &std);
    let (mut iterations, mut ending) = (0, IterationEnding::IterationLimit);
    while iterations < MOST_STEPS && ending == IterationEnding::IterationLimit {
        iterations += 1;
        let weights = inverse(&std);
        let step = least_squares(&problem.linearised(&x, &weights), 0)?;
        let mut share = 1.0;
        let fall = loop {
            let c = x.rows(0, n) + step.rows(0, n) * share;
            let trial = linear(problem, &levelled(c), &weights)?;
            let trial_std = problem.residual_std(&trial);
            let trial_value = criterion(problem, &trial_std);
            if trial_value < value {
                let fall = value - trial_value;
                (x, std, value) = (trial, trial_std, trial_value);
                break fall;
            }
            share *= 0.5;
            if share < 1e-6 {
                break 0.0;
            }
        };
        if fall < SETTLED {
            ending = IterationEnding::Converged;
        }
    }
    Ok(GainSolution {
        x,
        residual_std: std,
        iterations,
        ending,
    })
}

/// Minus the logarithm of the likelihood over the mean number of rows, but for a constant.
fn criterion(problem: &GainProblem, std: &[f64]) -> f64 {
    let all: f64 = problem.rows.iter().sum();
    let share = |rows: &f64| rows * std.len() as f64 / all;
    let each = std.iter().zip(&problem.rows);
    each.map(|(s, rows)| share(rows) * s.ln()).sum()
}

fn inverse(std: &[f64]) -> Vec<f64> {
    std.iter().map(|s| 1.0 / s).collect()
}

/// The common factor taken out, which the parameters have too.
fn levelled(c: DVector<f64>) -> DVector<f64> {
    let norm = c.norm() / (c.len() as f64).sqrt();
    if norm > 0.0 { c / norm } else { c }
}

/// All unknowns with the gains given.
fn linear(
    problem: &GainProblem,
    c: &DVector<f64>,
    weights: &[f64],
) -> Result<DVector<f64>, FitError> {
    let n = problem.joints();
    let mut x = DVector::zeros(problem.unknowns());
    x.rows_mut(0, n).copy_from(c);
    let rest = least_squares(&problem.linearised(&x, weights), n)?;
    x += rest;
    Ok(x)
}

/// Solution of an R factor whose last column is the target, unknowns before `first` and open directions at zero.
fn least_squares(r: &DMatrix<f64>, first: usize) -> Result<DVector<f64>, FitError> {
    let u = r.ncols() - 1;
    let free = u - first;
    let scale: Vec<f64> = (first..u).map(|c| r.column(c).norm()).collect();
    let unscale = |c: usize| if scale[c] > 0.0 { 1.0 / scale[c] } else { 0.0 };
    let scaled = DMatrix::from_fn(r.nrows(), free, |a, c| r[(a, first + c)] * unscale(c));
    let svd = rank::svd(&scaled)?;
    let mut z = DVector::zeros(free);
    for k in (0..svd.s.len()).filter(|&k| svd.s[k] > RANK_TOLERANCE * svd.s[0]) {
        z += svd.v.column(k) * (svd.u.column(k).dot(&r.column(u)) / svd.s[k]);
    }
    Ok(DVector::from_fn(u, |c, _| match c.checked_sub(first) {
        Some(c) => z[c] * unscale(c),
        None => 0.0,
    }))
}

/// Gains up to a common factor by those of the step before (Gautier and Briot 2014).
fn total_least_squares(
    problem: &GainProblem,
    gains: &[f64],
    std: &[f64],
) -> Result<Vec<f64>, FitError> {
    let n = problem.joints();
    let others = problem.unknowns() - n;
    let zero = DVector::zeros(problem.unknowns());
    let mut factor = RFactor::new(others + n);
    let mut row = vec![0.0; others + n];
    for set in &problem.sets {
        for (j, r) in set.joints.iter().enumerate() {
            let weight = 1.0 / (gains[j] * std[j]).abs();
            let mut at = zero.clone();
            at[j] = 1.0;
            // with c_j = 1 the slopes are the columns themselves, and the residual is the channel
            let rows = problem.rows_of(&at, r, j, set.loaded);
            for i in 0..r.nrows() {
                row.fill(0.0);
                for c in 1..rows.slopes.ncols() {
                    row[problem.unknown(j, c) - n] = weight * rows.slopes[(i, c)];
                }
                // the noise of this column is then of size 1
                row[others + j] = weight * gains[j].abs() * rows.residual[i];
                factor.fold(&row);
            }
        }
    }
    let r = factor.r();
    let left = DMatrix::from_fn(n, n, |a, b| r[(others + a, others + b)]);
    let svd = rank::svd(&left)?;
    let last = svd.v.column(n - 1);
    Ok((0..n).map(|j| last[j] * gains[j].abs()).collect())
}
