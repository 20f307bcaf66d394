//! Covariances and the information that they hold.

use nalgebra::{DMatrix, SymmetricEigen};

/// Share of the largest variance (unknowns scaled by their deviations) below which a direction is rounding.
const ROUNDING: f64 = 1e-13;

/// Rows (p x p) whose square is the information matrix of a covariance of `p` unknowns, row by row; an unknown without
/// a variance has no part in them.
pub fn information_rows(covariance: &[f64], p: usize) -> DMatrix<f64> {
    let scale = |i: usize| match covariance[i * p + i].max(0.0).sqrt() {
        std if std > 0.0 => 1.0 / std,
        _ => 0.0,
    };
    let scale: Vec<f64> = (0..p).map(scale).collect();
    let correlation = DMatrix::from_fn(p, p, |i, j| covariance[i * p + j] * scale[i] * scale[j]);
    let parts = SymmetricEigen::new(correlation);
    let largest = parts.eigenvalues.amax();
    let mut rows = DMatrix::zeros(p, p);
    for (k, size) in parts.eigenvalues.iter().enumerate() {
        if *size > ROUNDING * largest {
            for i in 0..p {
                rows[(k, i)] = parts.eigenvectors[(i, k)] * scale[i] / size.sqrt();
            }
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inverse_leaves_out_what_has_no_variance() {
        let c = [4.0, 1.0, 0.0, 1.0, 9.0, 0.0, 0.0, 0.0, 0.0];
        let rows = information_rows(&c, 3);
        let found = rows.tr_mul(&rows);
        let wanted = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 9.0]);
        let wanted = wanted.try_inverse().unwrap();
        assert!((found.view((0, 0), (2, 2)) - wanted).amax() < 1e-12);
        assert_eq!(found.row(2).amax(), 0.0);
    }
}
