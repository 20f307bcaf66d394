//! What a torque that is logged late or early changes in a fit.
//!
//! A controller sets a torque, holds it and logs it at times of its own: a row's torque is of its position to within a
//! step or so. Late by d it is tau - d tau', and friction's part of tau' is viscous friction times an acceleration: half
//! a millisecond takes two percent off a light joint's inertia, and its residual hardly shows. The rate of each joint's
//! torque as one more column shows how late the rows let it be; a fit without that column is wrong by as much.

use nalgebra::{DMatrix, DVector};

use super::accumulate::BlockFactors;
use super::columns::Own;
use super::departure::{inverse_scaled, products};
use super::solve::{Fit, weights_of};

/// Standard deviation of a delay before the rows are asked, in samples: a command is logged with the position before
/// or after it.
const DELAY_SAMPLES: f64 = 0.5;

/// The rows of columns [`with_torque_rates`](super::columns::RegressorColumns::with_torque_rates) without the rates.
pub fn without_rates(sums: &BlockFactors) -> BlockFactors {
    let kept = |own: &Vec<Own>| {
        (0..own.len())
            .filter(|k| own[*k] != Own::TorqueRate)
            .collect()
    };
    sums.with_own(&sums.columns.own.iter().map(kept).collect::<Vec<_>>())
}

/// Adds to a fit's covariance the second moment of what delays change in it: their mean and scatter by `sums`, rows with
/// the rates, and what is known of them before.
pub fn widen_by_delay(sums: &BlockFactors, fit: &mut Fit) -> Option<()> {
    let columns = &sums.columns;
    let (n, u) = (columns.joints, fit.theta.len());
    let correlated = fit.rows as f64 / fit.effective_rows.max(1.0);
    let weights = weights_of(sums, &fit.residual_std);
    let mut normal = DMatrix::<f64>::zeros(u + n, u + n);
    let mut target = DVector::<f64>::zeros(u + n);
    for j in 0..n {
        let (x, t) = products(&sums.parts(&sums.joint(j), j), columns.unknowns_of(j));
        let last = columns.unknowns_of(j) - 1;
        // the rates stand behind all other unknowns
        let place = |c: usize| {
            if c == last {
                u + j
            } else {
                columns.unknown(j, c) - own_before(j, c, columns.shared)
            }
        };
        let w = weights[j] * weights[j];
        for a in 0..=last {
            target[place(a)] += w * t[a];
            for b in 0..=last {
                normal[(place(a), place(b))] += w * x[(a, b)];
            }
        }
    }
    let inverse = inverse_scaled(&normal.view((0, 0), (u, u)).into_owned())?;
    let cross = normal.view((0, u), (u, n)).into_owned();
    let by_delay = &inverse * &cross;
    let score = target.rows(u, n) - cross.tr_mul(&(&inverse * target.rows(0, u)));
    let known = (normal.view((u, u), (n, n)) - cross.tr_mul(&by_delay)) / correlated;
    let scatter = (known + DMatrix::identity(n, n) / DELAY_SAMPLES.powi(2))
        .cholesky()?
        .inverse();
    let mean = &scatter * score / correlated;
    fit.covariance += &by_delay * (scatter + &mean * mean.transpose()) * by_delay.transpose();
    Some(())
}

/// Rates that stand before an own term of joint j.
fn own_before(j: usize, c: usize, shared: usize) -> usize {
    if c < shared { 0 } else { j }
}
