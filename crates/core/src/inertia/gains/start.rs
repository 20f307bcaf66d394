//! Where the search begins: total least squares with the channels among the columns.
//!
//! With weights 1/(g_j std_j) the noise of the n channel columns is alike, and the right singular vector of the smallest
//! singular value holds the gains.

use nalgebra::{DMatrix, DVector};

use super::problem::Problem;
use crate::inertia::solution::FitError;
use crate::math::rank;
use crate::math::rfactor::RFactor;

/// Gains up to a common factor by those of the step before (Gautier and Briot 2014).
pub(super) fn total_least_squares(
    problem: &Problem,
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
