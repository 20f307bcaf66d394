//! What a gain does to the parameters that were fitted with it.

use nalgebra::{DMatrix, DVector};

use crate::inertia::accumulate::BlockFactors;
use crate::inertia::solution::{FitError, joints, solve};

/// Derivatives of the weighted least-squares solution by the logarithm of each joint's gain, unknowns x
/// joints: the solution for the torque of that joint alone. `shift` is what the solution of the rows lacks
/// to the parameters, as for a law that they are linear about.
///
/// # Errors
/// [`FitError`].
pub fn by_gains(
    factors: &BlockFactors,
    weights: &[f64],
    shift: &DVector<f64>,
) -> Result<DMatrix<f64>, FitError> {
    let columns = &factors.columns;
    let triangles = joints(factors)?;
    let inverse = solve(factors, &triangles, weights, None)?.inverse;
    let mut slopes = DMatrix::zeros(columns.unknowns(), columns.joints);
    for (j, r) in triangles.iter().enumerate() {
        let x = r.columns(0, columns.unknowns_of(j));
        let torque = r.column(r.ncols() - 1) + x * factors.own_unknowns(shift, j);
        let mut whole = DVector::zeros(columns.unknowns());
        columns.add_own(j, weights[j] * weights[j], &x.tr_mul(&torque), &mut whole);
        slopes.set_column(j, &(&inverse * whole));
    }
    Ok(slopes)
}
