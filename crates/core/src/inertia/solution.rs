//! The weighted least-squares solution (41) by singular values: rank, condition numbers, and combinations that the
//! data leave open.

use crate::explain::Explain;
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Serialize;

use super::accumulate::BlockFactors;
use crate::math::rank;
use crate::math::rfactor::RFactor;

/// Why no fit came out.
#[derive(Debug, Clone, Explain, thiserror::Error)]
pub enum FitError {
    #[explain(
        "{rows} rows are left after filtering and decimation, too few for {unknowns} unknowns",
        "give a longer log, a lower decimation or a higher cut-off"
    )]
    TooFewRows { rows: u64, unknowns: usize },
    #[explain(
        "no column of the regressor is excited by these logs: every joint stands still, or its torque is zero",
        "log a motion of every joint"
    )]
    NothingExcited,
    #[explain(_0.explanation())]
    Math(#[from] crate::math::MathError),
}

/// Condition numbers of the unweighted stacked regressor.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct ConditionNumbers {
    /// Ratio of its extreme singular values as it stands; null where the rank is short.
    pub raw: Option<f64>,
    /// With columns scaled to norm 1.
    pub normalised: Option<f64>,
}

/// A combination of unknowns that the data do not distinguish: coefficients of the scaled columns.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "Confounded")]
pub struct ConfoundedUnknowns {
    /// Index of the unknown and its coefficient, largest first.
    pub terms: Vec<(usize, f64)>,
}

/// What a fit is given besides the rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct FitInputs<'a> {
    /// Weight of each joint's rows [1/N or 1/Nm].
    pub weights: &'a [f64],
    /// Per joint, by which part of X'X the score falls where theta grows: 1 for least squares, the
    /// mean of psi' over that of the row weights for a robust fit.
    pub slope: Option<&'a [f64]>,
    /// What is known of the unknowns beforehand.
    pub prior: Option<&'a PriorRows>,
}

impl<'a> FitInputs<'a> {
    /// Least squares.
    pub fn weighted(weights: &'a [f64], prior: Option<&'a PriorRows>) -> Self {
        FitInputs {
            weights,
            slope: None,
            prior,
        }
    }
}

/// What is known of the unknowns beforehand, as rows of unit noise.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PriorRows {
    /// k x (unknowns + 1), the target last.
    pub rows: DMatrix<f64>,
    /// Variance of the rows' noise: above 1 where they are given more weight than one row of data,
    /// as they must among correlated rows.
    pub variance: f64,
}

/// R factor of each joint, where there are rows enough.
pub(super) fn joints(factors: &BlockFactors) -> Result<Vec<DMatrix<f64>>, FitError> {
    let u = factors.columns.unknowns();
    let rows = factors.moving.iter().map(|rows| rows.count).max();
    let rows = rows.unwrap_or(0);
    if rows < 2 * u as u64 {
        return Err(FitError::TooFewRows { rows, unknowns: u });
    }
    let joints = 0..factors.columns.joints;
    Ok(joints.map(|j| factors.joint(j)).collect())
}

/// Weighted solution with the directions that the data leave open fixed at zero.
pub(super) struct WeightedSolution {
    pub theta: DVector<f64>,
    /// Inverse of the weighted normal matrix on the directions that are open to the data.
    pub inverse: DMatrix<f64>,
    pub determined: Vec<bool>,
    pub confounded: Vec<ConfoundedUnknowns>,
}

/// R factor of all joints' rows, unknowns and target, each joint times its weight, and of a prior.
pub(super) fn stacked(
    factors: &BlockFactors,
    joints: &[DMatrix<f64>],
    weights: &[f64],
    prior: Option<&PriorRows>,
) -> DMatrix<f64> {
    let columns = &factors.columns;
    let u = columns.unknowns();
    let mut factor = RFactor::new(u + 1);
    let mut row = vec![0.0; u + 1];
    for (j, r) in joints.iter().enumerate() {
        let own = columns.unknowns_of(j);
        for i in 0..r.nrows() {
            row.fill(0.0);
            for c in 0..own {
                row[columns.unknown(j, c)] = weights[j] * r[(i, c)];
            }
            row[u] = weights[j] * r[(i, r.ncols() - 1)];
            factor.fold(&row);
        }
    }
    if let Some(prior) = prior {
        factor.fold(prior.rows.transpose().as_slice());
    }
    factor.r()
}

pub(super) fn conditions(x: &DMatrix<f64>) -> Result<(ConditionNumbers, usize), FitError> {
    let raw = rank::svd(x)?;
    let mut scaled = x.clone();
    for mut c in scaled.column_iter_mut() {
        let norm = c.norm();
        if norm > 0.0 {
            c /= norm;
        }
    }
    let normalised = rank::svd(&scaled)?;
    let shown = |s: &&f64| **s > RANK_TOLERANCE * normalised.s[0];
    let k = normalised.s.iter().filter(shown).count();
    if k == 0 || normalised.s[0] == 0.0 {
        return Err(FitError::NothingExcited);
    }
    let full = k == x.ncols();
    let ratio = |s: &DVector<f64>| full.then(|| s[0] / s[s.len() - 1]);
    Ok((
        ConditionNumbers {
            raw: ratio(&raw.s),
            normalised: ratio(&normalised.s),
        },
        k,
    ))
}

/// Singular values of the scaled columns below this share of the largest are rounding and errors of differentiation.
const RANK_TOLERANCE: f64 = 1e-8;
/// Standard deviation of a combination's torque over the whole torque from which on its values are the nearest to zero.
// what the data give for it is noise, and huge where it shows in other motion; 5 or 20 change none of the measured sets
const OPEN_DEVIATION: f64 = 10.0;
/// Share of an unknown in an open direction from which on it counts as not determined.
const SHARE: f64 = 1e-3;

pub(super) fn solve(
    factors: &BlockFactors,
    joints: &[DMatrix<f64>],
    weights: &[f64],
    prior: Option<&PriorRows>,
) -> Result<WeightedSolution, FitError> {
    let u = factors.columns.unknowns();
    let r = stacked(factors, joints, weights, prior);
    let x = r.columns(0, u);
    let scale: Vec<f64> = x.column_iter().map(|c| c.norm()).collect();
    let unscale = |i: usize| if scale[i] > 0.0 { 1.0 / scale[i] } else { 0.0 };
    let scaled = DMatrix::from_fn(r.nrows(), u, |i, j| r[(i, j)] * unscale(j));
    let svd = rank::svd(&scaled)?;
    let kept = |k: &usize| svd.s[*k] > RANK_TOLERANCE * svd.s[0];
    let (kept, lost): (Vec<usize>, Vec<usize>) = (0..svd.s.len()).partition(kept);
    let target = r.column(u);
    let rows: u64 = factors.moving.iter().map(|rows| rows.count).sum();
    let noise = r[(u, u)].abs() / (rows.max(1) as f64).sqrt();
    let least = noise / (OPEN_DEVIATION * target.norm()).max(f64::MIN_POSITIVE);
    let mut z = DVector::zeros(u);
    let mut inverse = DMatrix::zeros(u, u);
    for k in kept {
        let v = svd.v.column(k);
        if svd.s[k] > least {
            z += v * (svd.u.column(k).dot(&target) / svd.s[k]);
        }
        inverse += v * v.transpose() / (svd.s[k] * svd.s[k]);
    }
    let lost = lost.into_iter().map(|k| svd.v.column(k).into_owned());
    let confounded = open_directions(lost, &scale);
    let mut determined = vec![true; u];
    for (i, _) in confounded.iter().flat_map(|c| &c.terms) {
        determined[*i] = false;
    }
    let theta = DVector::from_fn(u, |i, _| z[i] * unscale(i));
    let inverse = DMatrix::from_fn(u, u, |i, j| inverse[(i, j)] * unscale(i) * unscale(j));
    Ok(WeightedSolution {
        theta,
        inverse,
        determined,
        confounded,
    })
}

/// The directions that the data leave open, each unknown without a column by itself.
fn open_directions(
    lost: impl Iterator<Item = DVector<f64>>,
    scale: &[f64],
) -> Vec<ConfoundedUnknowns> {
    let silent = |i: &usize| scale[*i] == 0.0;
    let single = |i: usize| ConfoundedUnknowns {
        terms: vec![(i, 1.0)],
    };
    let mut out: Vec<ConfoundedUnknowns> = (0..scale.len()).filter(silent).map(single).collect();
    let mut others: Vec<DVector<f64>> = Vec::new();
    for mut v in lost {
        (0..scale.len()).filter(silent).for_each(|i| v[i] = 0.0);
        for other in &others {
            v -= other * other.dot(&v);
        }
        if v.norm() < SHARE {
            continue;
        }
        v.normalize_mut();
        let terms = v.iter().copied().enumerate();
        let mut terms: Vec<(usize, f64)> = terms.filter(|(_, x)| x.abs() > SHARE).collect();
        terms.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        out.push(ConfoundedUnknowns { terms });
        others.push(v);
    }
    out
}

pub(super) fn residual_std(
    factors: &BlockFactors,
    joints: &[DMatrix<f64>],
    theta: &DVector<f64>,
) -> Vec<f64> {
    let of = |(j, r): (usize, &DMatrix<f64>)| {
        let own = factors.own_unknowns(theta, j);
        let rows = factors.moving[j].count.max(1);
        (factors.parts(r, j).residual_square(&own) / rows as f64).sqrt()
    };
    joints.iter().enumerate().map(of).collect()
}
