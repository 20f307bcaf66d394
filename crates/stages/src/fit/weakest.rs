//! Which combination of the parameters the data determine least.

use nalgebra::{DMatrix, SymmetricEigen};
use schemars::JsonSchema;
use serde::Serialize;

use crate::input::unknowns::FittedUnknown;
use cft_ident_core::inertia::solve::Fit;

/// Parts below this share of a direction of norm 1 are left out.
const MIN_PART: f64 = 0.1;

/// A parameter's part in the least certain combination of columns, each scaled to norm 1.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct WeakestPart {
    /// Short name of the parameter, that of the model file.
    pub parameter: String,
    pub joint: Option<String>,
    /// Between -1 and 1; the squares of all parts sum to 1, and the largest is positive.
    pub part: f64,
}

/// The direction of largest variance, largest part first; nothing where a variance is not finite.
pub(crate) fn weakest(fit: &Fit, unknowns: &[FittedUnknown]) -> Vec<WeakestPart> {
    let n = unknowns.len();
    let norm = |i: usize| fit.column_rms.column(i).norm();
    let scaled = DMatrix::from_fn(n, n, |a, b| norm(a) * norm(b) * fit.covariance[(a, b)]);
    if scaled.iter().any(|x| !x.is_finite()) {
        return Vec::new();
    }
    let eigen = SymmetricEigen::new(scaled);
    let by_variance =
        |a: &usize, b: &usize| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]);
    let Some(last) = (0..n).max_by(by_variance) else {
        return Vec::new();
    };
    let direction = eigen.eigenvectors.column(last);
    let mut parts: Vec<(usize, f64)> = direction.iter().copied().enumerate().collect();
    parts.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(a.0.cmp(&b.0)));
    // an eigenvector has no sign of its own
    let sign = parts.first().map_or(1.0, |p| p.1.signum());
    let large = parts.into_iter().take_while(|(_, x)| x.abs() > MIN_PART);
    let part = |(i, x): (usize, f64)| WeakestPart {
        parameter: unknowns[i].key.clone(),
        joint: unknowns[i].joint.clone(),
        part: sign * x,
    };
    large.map(part).collect()
}
