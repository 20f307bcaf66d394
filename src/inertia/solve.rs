//! The fit itself: column-normalised least squares (41) on the sums, weighted by each joint's
//! noise, with rank, condition numbers and a covariance that correlated residuals do not break.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::accumulate::{Parts, Sums};
use super::columns::GRADIENT;
use crate::math::rank;
use crate::math::rfactor::RFactor;

/// Which rows count how much.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// Rows weighted by each joint's residual of an ordinary fit (two steps).
    #[default]
    Wls,
    /// Eq. (41) as it stands.
    Ols,
}

/// Why no fit came out.
#[derive(Debug, Clone, thiserror::Error)]
pub enum FitError {
    #[error(
        "{rows} rows are left after filtering and decimation, too few for {unknowns} unknowns: \
         give a longer log, a lower decimation or a higher cut-off"
    )]
    TooFewRows { rows: u64, unknowns: usize },
    #[error(
        "no column of the regressor is excited by these logs: every joint stands still, or its torque is zero"
    )]
    NothingExcited,
    #[error(transparent)]
    Math(#[from] crate::math::MathError),
}

/// Condition numbers of the unweighted stacked regressor.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Condition {
    /// Ratio of its extreme singular values as it stands; null where the rank is short.
    pub raw: Option<f64>,
    /// With columns scaled to norm 1.
    pub normalised: Option<f64>,
}

/// A combination of unknowns that the data do not tell apart: coefficients of the scaled columns.
#[derive(Debug, Clone, Serialize)]
pub struct Confounded {
    /// Index of the unknown and its coefficient, largest first.
    pub terms: Vec<(usize, f64)>,
}

/// Result of the fit, unknowns in the order of `Columns`.
#[derive(Debug, Clone)]
pub struct Fit {
    pub theta: DVector<f64>,
    /// Covariance of theta: correlated residuals and the known friction's own covariance.
    pub covariance: DMatrix<f64>,
    /// Textbook covariance, for the comparison only.
    pub textbook: DMatrix<f64>,
    /// d theta / d(known friction parameters) per joint, unknowns x 5.
    pub friction_sensitivity: Vec<Option<DMatrix<f64>>>,
    /// False where the unknown has a part in a combination that the data leave open.
    pub determined: Vec<bool>,
    pub confounded: Vec<Confounded>,
    pub condition: Condition,
    pub rank: usize,
    /// Standard deviation of each joint's residual [N or Nm], filtered.
    pub residual_std: Vec<f64>,
    /// Relative residual per joint: norm of residual over norm of filtered torque.
    pub relative_error: Vec<f64>,
    /// Root mean square of the filtered torque per joint.
    pub torque_rms: Vec<f64>,
    /// Root mean square of each unknown's column per joint, joints x unknowns.
    pub column_rms: DMatrix<f64>,
    pub rows: u64,
    /// Rows that independent residuals of the same certainty would number.
    pub effective_rows: f64,
}

/// Fits all unknowns of the sums.
pub fn fit(sums: &Sums, estimator: Estimator) -> Result<Fit, FitError> {
    let columns = &sums.columns;
    let (n, u) = (columns.joints, columns.unknowns());
    if sums.rows < 2 * u as u64 {
        return Err(FitError::TooFewRows {
            rows: sums.rows,
            unknowns: u,
        });
    }
    let joints: Vec<DMatrix<f64>> = (0..n).map(|j| sums.joint(j)).collect();
    let condition_factor = stacked(sums, &joints, &vec![1.0; n]);
    let whole = condition_factor.columns(0, u).into_owned();
    let (condition, rank) = conditions(&whole)?;

    let ones = vec![1.0; n];
    let (mut solution, mut weights) = (solve(sums, &joints, &ones)?, ones);
    if estimator == Estimator::Wls {
        // noise of each joint from the step before; two steps settle it
        for _ in 0..2 {
            weights = residual_std(sums, &joints, &solution.theta)
                .iter()
                .zip(&sums.torque_square)
                .map(|(s, t)| {
                    let floor = 1e-9 * (t / sums.rows as f64).sqrt();
                    if *s > floor {
                        1.0 / s
                    } else if floor > 0.0 {
                        1.0 / floor
                    } else {
                        0.0
                    }
                })
                .collect();
            solution = solve(sums, &joints, &weights)?;
        }
    }
    let residual = residual_std(sums, &joints, &solution.theta);
    let (covariance, textbook, sensitivity) =
        super::covariance::covariance(sums, &joints, &solution, &weights, &residual);
    let rows = sums.rows as f64;
    let torque_rms: Vec<f64> = sums
        .torque_square
        .iter()
        .map(|s| (s / rows).sqrt())
        .collect();
    let relative_error = residual
        .iter()
        .zip(&torque_rms)
        .map(|(r, t)| if *t > 0.0 { r / t } else { f64::NAN })
        .collect();
    let mut column_rms = DMatrix::zeros(n, u);
    for (j, r) in joints.iter().enumerate() {
        for c in 0..columns.shared + columns.own[j].len() {
            column_rms[(j, columns.unknown(j, c))] = r.column(c).norm() / rows.sqrt();
        }
    }
    let effective = (0..u)
        .filter(|&i| solution.determined[i] && covariance.sandwich[(i, i)] > 0.0)
        .map(|i| textbook[(i, i)] / covariance.sandwich[(i, i)])
        .collect::<Vec<_>>();
    let effective_rows = if effective.is_empty() {
        rows
    } else {
        (rows * effective.iter().sum::<f64>() / effective.len() as f64).min(rows)
    };
    Ok(Fit {
        theta: solution.theta,
        covariance: covariance.total,
        textbook,
        friction_sensitivity: sensitivity,
        determined: solution.determined,
        confounded: solution.confounded,
        condition,
        rank,
        residual_std: residual,
        relative_error,
        torque_rms,
        column_rms,
        rows: sums.rows,
        effective_rows,
    })
}

/// Weighted solution with the directions that the data leave open held at zero.
pub(super) struct Solution {
    pub theta: DVector<f64>,
    /// Inverse of the weighted normal matrix on the directions that are open to the data.
    pub inverse: DMatrix<f64>,
    pub determined: Vec<bool>,
    pub confounded: Vec<Confounded>,
}

/// R factor of all joints' rows, unknowns and target, each joint times its weight.
fn stacked(sums: &Sums, joints: &[DMatrix<f64>], weights: &[f64]) -> DMatrix<f64> {
    let columns = &sums.columns;
    let u = columns.unknowns();
    let mut factor = RFactor::new(u + 1);
    let mut row = vec![0.0; u + 1];
    for (j, r) in joints.iter().enumerate() {
        let own = columns.shared + columns.own[j].len();
        for i in 0..r.nrows() {
            row.fill(0.0);
            for c in 0..own {
                row[columns.unknown(j, c)] = weights[j] * r[(i, c)];
            }
            row[u] = weights[j] * r[(i, r.ncols() - 1)];
            factor.fold(&row);
        }
    }
    factor.r()
}

fn conditions(x: &DMatrix<f64>) -> Result<(Condition, usize), FitError> {
    let raw = rank::svd(x)?;
    let mut scaled = x.clone();
    for mut c in scaled.column_iter_mut() {
        let norm = c.norm();
        if norm > 0.0 {
            c /= norm;
        }
    }
    let normalised = rank::svd(&scaled)?;
    let k = normalised
        .s
        .iter()
        .filter(|s| **s > RANK_TOLERANCE * normalised.s[0])
        .count();
    if k == 0 || normalised.s[0] == 0.0 {
        return Err(FitError::NothingExcited);
    }
    let full = k == x.ncols();
    let ratio = |s: &DVector<f64>| full.then(|| s[0] / s[s.len() - 1]);
    Ok((
        Condition {
            raw: ratio(&raw.s),
            normalised: ratio(&normalised.s),
        },
        k,
    ))
}

/// Singular values of the scaled columns below this share of the largest carry nothing but
/// rounding and the differentiation's own error.
const RANK_TOLERANCE: f64 = 1e-8;
/// Share of an unknown in an open direction from which on it counts as not determined.
const SHARE: f64 = 1e-3;

fn solve(sums: &Sums, joints: &[DMatrix<f64>], weights: &[f64]) -> Result<Solution, FitError> {
    let u = sums.columns.unknowns();
    let r = stacked(sums, joints, weights);
    let x = r.columns(0, u);
    let scale: Vec<f64> = x.column_iter().map(|c| c.norm()).collect();
    let unscale = |i: usize| if scale[i] > 0.0 { 1.0 / scale[i] } else { 0.0 };
    let scaled = DMatrix::from_fn(r.nrows(), u, |i, j| r[(i, j)] * unscale(j));
    let svd = rank::svd(&scaled)?;
    let kept: Vec<usize> = (0..svd.s.len())
        .filter(|&k| svd.s[k] > RANK_TOLERANCE * svd.s[0])
        .collect();
    let target = r.column(u);
    let mut z = DVector::zeros(u);
    let mut inverse = DMatrix::zeros(u, u);
    for &k in &kept {
        let v = svd.v.column(k);
        z += v * (svd.u.column(k).dot(&target) / svd.s[k]);
        inverse += v * v.transpose() / (svd.s[k] * svd.s[k]);
    }
    let mut determined: Vec<bool> = (0..u).map(|i| scale[i] > 0.0).collect();
    let mut confounded = Vec::new();
    for k in (0..svd.s.len()).filter(|k| !kept.contains(k)) {
        let v = svd.v.column(k);
        let mut terms: Vec<(usize, f64)> = (0..u)
            .filter(|&i| v[i].abs() > SHARE)
            .map(|i| (i, v[i]))
            .collect();
        terms.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        for (i, _) in &terms {
            determined[*i] = false;
        }
        confounded.push(Confounded { terms });
    }
    let theta = DVector::from_fn(u, |i, _| z[i] * unscale(i));
    let inverse = DMatrix::from_fn(u, u, |i, j| inverse[(i, j)] * unscale(i) * unscale(j));
    Ok(Solution {
        theta,
        inverse,
        determined,
        confounded,
    })
}

/// Restriction of the global unknowns to those of joint j.
pub(super) fn of_joint(sums: &Sums, theta: &DVector<f64>, j: usize) -> DVector<f64> {
    let columns = &sums.columns;
    DVector::from_fn(columns.shared + columns.own[j].len(), |c, _| {
        theta[columns.unknown(j, c)]
    })
}

pub(super) fn parts<'a>(sums: &Sums, r: &'a DMatrix<f64>, j: usize) -> Parts<'a> {
    Parts {
        r,
        unknowns: sums.columns.shared + sums.columns.own[j].len(),
        gradient: if sums.columns.known[j].is_some() {
            GRADIENT
        } else {
            0
        },
    }
}

fn residual_std(sums: &Sums, joints: &[DMatrix<f64>], theta: &DVector<f64>) -> Vec<f64> {
    joints
        .iter()
        .enumerate()
        .map(|(j, r)| {
            let own = of_joint(sums, theta, j);
            (parts(sums, r, j).residual_square(&own) / sums.rows as f64).sqrt()
        })
        .collect()
}
