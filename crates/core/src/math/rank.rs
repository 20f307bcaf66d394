//! Singular values, rank and condition number: the only door to `faer`.
//!
//! nalgebra 0.35 returns wrong singular values for some exactly rank-deficient matrices (a 3 x 5
//! matrix of ones, say), so no decision about rank may rest on it.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::svd::{ComputeSvdVectors, svd as faer_svd, svd_scratch};
use faer::{Mat, Par};
use nalgebra::{DMatrix, DVector};

use super::MathError;
use super::jacobi::{self, SvdFactors};

/// Thin singular value decomposition.
///
/// The square sum of the singular values is compared with that of the entries; where it fails, or
/// where `faer` does not converge, one-sided Jacobi takes over.
///
/// # Errors
/// [`MathError::NotFinite`] for a NaN or infinite entry, [`MathError::NoConvergence`] where both
/// methods miss the norm of the matrix (overflow, for instance).
pub fn svd(a: &DMatrix<f64>) -> Result<SvdFactors, MathError> {
    let (m, n) = a.shape();
    for column in 0..n {
        for row in 0..m {
            let value = a[(row, column)];
            if !value.is_finite() {
                return Err(MathError::NotFinite { row, column, value });
            }
        }
    }
    if let Some(found) = by_faer(a).filter(|found| keeps_norm(a, found)) {
        return Ok(found);
    }
    let found = jacobi::svd(a);
    if keeps_norm(a, &found) {
        Ok(found)
    } else {
        Err(MathError::NoConvergence {
            rows: m,
            columns: n,
            found: found.s.norm_squared(),
            expected: a.norm_squared(),
        })
    }
}

/// Condition number `s_max / s_min` of singular values in falling order; infinite where the
/// smallest is zero, NaN for an empty list.
pub fn condition(s: &DVector<f64>) -> f64 {
    match (s.iter().next(), s.iter().next_back()) {
        (Some(&largest), Some(&smallest)) if largest > 0.0 => largest / smallest,
        (Some(_), Some(_)) => f64::INFINITY,
        _ => f64::NAN,
    }
}

/// Numerical rank: how many singular values exceed `s_max * max(rows, n) * 2.2e-16`, `rows` being
/// the rows of the matrix that was stacked (Golub and Van Loan 2013, section 5.4.1).
pub fn rank(s: &DVector<f64>, rows: u64) -> usize {
    let Some(&largest) = s.iter().next() else {
        return 0;
    };
    let threshold = largest * f64::EPSILON * (rows.max(s.len() as u64) as f64);
    s.iter().filter(|&&value| value > threshold).count()
}

fn by_faer(a: &DMatrix<f64>) -> Option<SvdFactors> {
    let (m, n) = a.shape();
    let k = m.min(n);
    let input = Mat::from_fn(m, n, |i, j| a[(i, j)]);
    let mut u = Mat::<f64>::zeros(m, k);
    let mut v = Mat::<f64>::zeros(n, k);
    let mut s = faer::diag::Diag::<f64>::zeros(k);
    let thin = ComputeSvdVectors::Thin;
    let scratch = svd_scratch::<f64>(m, n, thin, thin, Par::Seq, Default::default());
    faer_svd(
        input.as_ref(),
        s.as_mut(),
        Some(u.as_mut()),
        Some(v.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    )
    .ok()?;
    let s = s.column_vector();
    Some(SvdFactors {
        u: DMatrix::from_fn(m, k, |i, j| u[(i, j)]),
        s: DVector::from_fn(k, |i, _| s[i]),
        v: DMatrix::from_fn(n, k, |i, j| v[(i, j)]),
    })
}

fn keeps_norm(a: &DMatrix<f64>, svd: &SvdFactors) -> bool {
    let expected = a.norm_squared();
    let found = svd.s.norm_squared();
    expected.is_finite() && (found - expected).abs() <= 1e-10 * expected
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_of_ones_have_one_singular_value() {
        for m in 1..=30 {
            for n in 1..=30 {
                let a = DMatrix::from_element(m, n, 1.0);
                let found = svd(&a).expect("finite");
                let exact = ((m * n) as f64).sqrt();
                assert!(
                    (found.s[0] - exact).abs() < 1e-12 * exact,
                    "{m} x {n}: {}",
                    found.s[0]
                );
                assert_eq!(rank(&found.s, m as u64), 1, "{m} x {n}");
            }
        }
    }

    #[test]
    fn a_decomposition_reproduces_its_matrix() {
        let a = DMatrix::from_fn(7, 4, |i, j| {
            ((3 * i + 5 * j) as f64).sin() * 10f64.powi(j as i32)
        });
        for a in [a.clone(), a.transpose()] {
            for found in [svd(&a).expect("finite"), jacobi::svd(&a)] {
                let back = &found.u * DMatrix::from_diagonal(&found.s) * found.v.transpose();
                assert!((back - &a).norm() < 1e-13 * a.norm());
                assert!(found.s.as_slice().is_sorted_by(|x, y| x >= y));
            }
        }
    }

    #[test]
    fn condition_and_rank_of_a_diagonal_are_exact() {
        let a = DMatrix::from_diagonal(&DVector::from_vec(vec![0.5, 200.0, 1.0, 0.0]));
        let s = svd(&a).expect("finite").s;
        assert_eq!(s.as_slice(), &[200.0, 1.0, 0.5, 0.0]);
        assert_eq!(rank(&s, 1000), 3);
        assert_eq!(condition(&s), f64::INFINITY);
        assert_eq!(condition(&DVector::from_vec(vec![200.0, 1.0, 0.5])), 400.0);
        assert_eq!(rank(&DVector::from_vec(vec![0.0, 0.0]), 10), 0);
    }

    #[test]
    fn an_entry_that_is_not_finite_is_named() {
        let mut a = DMatrix::from_element(3, 2, 1.0);
        a[(2, 1)] = f64::NAN;
        let message = svd(&a).expect_err("NaN").to_string();
        assert!(message.contains("(2, 1) is NaN"), "{message}");
    }

    #[test]
    fn a_square_sum_that_overflows_is_an_error() {
        let a = DMatrix::from_element(2, 2, 1e200);
        assert!(matches!(svd(&a), Err(MathError::NoConvergence { .. })));
    }

    #[test]
    fn empty_matrices_have_rank_zero() {
        let found = svd(&DMatrix::zeros(0, 3)).expect("empty is fine");
        assert_eq!((rank(&found.s, 0), found.v.shape()), (0, (3, 0)));
        assert!(condition(&found.s).is_nan());
    }
}
