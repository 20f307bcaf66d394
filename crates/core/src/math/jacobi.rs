//! Singular values by one-sided Jacobi rotations (Hestenes 1958; Demmel and Veselic 1992).
//!
//! Slow (0.1 to a few ms for the sizes met here) but simple, and accurate for small singular
//! values of badly scaled columns. It stands behind [`super::rank::svd`] and checks it in tests.

use nalgebra::{DMatrix, DVector};

/// Thin singular value decomposition `A = U diag(s) V'` of an `m x n` matrix, `k = min(m, n)`.
#[derive(Debug, Clone)]
pub struct SvdFactors {
    /// Left singular vectors, `m x k`.
    pub u: DMatrix<f64>,
    /// Singular values in falling order, `k`.
    pub s: DVector<f64>,
    /// Right singular vectors, `n x k`, one per column (not transposed).
    pub v: DMatrix<f64>,
}

/// Sweeps over all pairs of columns; ten are usual, even at 60 columns.
const SWEEPS: usize = 60;

/// Thin singular value decomposition `A = U diag(s) V'`, s in falling order.
///
/// Columns of U that belong to a zero singular value are zero. Entries must be finite.
pub fn svd(a: &DMatrix<f64>) -> SvdFactors {
    if a.nrows() < a.ncols() {
        let SvdFactors { u, s, v } = svd(&a.transpose());
        return SvdFactors { u: v, s, v: u };
    }
    let n = a.ncols();
    let mut u = a.clone();
    let mut v = DMatrix::identity(n, n);
    for _ in 0..SWEEPS {
        let mut turned = false;
        for p in 0..n {
            for q in p + 1..n {
                let alpha = u.column(p).norm_squared();
                let beta = u.column(q).norm_squared();
                let gamma = u.column(p).dot(&u.column(q));
                if gamma == 0.0 || gamma.abs() <= f64::EPSILON * (alpha * beta).sqrt() {
                    continue;
                }
                turned = true;
                let zeta = (beta - alpha) / (2.0 * gamma);
                let t = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                let c = 1.0 / t.hypot(1.0);
                rotate(&mut u, p, q, c, c * t);
                rotate(&mut v, p, q, c, c * t);
            }
        }
        if !turned {
            break;
        }
    }
    let norms: Vec<f64> = u.column_iter().map(|column| column.norm()).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
    let mut sorted = SvdFactors {
        u: DMatrix::zeros(a.nrows(), n),
        s: DVector::zeros(n),
        v: DMatrix::zeros(n, n),
    };
    for (to, &from) in order.iter().enumerate() {
        sorted.s[to] = norms[from];
        if norms[from] > 0.0 {
            sorted.u.set_column(to, &(u.column(from) / norms[from]));
        }
        sorted.v.set_column(to, &v.column(from));
    }
    sorted
}

/// Columns p and q become `c p - s q` and `s p + c q`.
fn rotate(m: &mut DMatrix<f64>, p: usize, q: usize, c: f64, s: f64) {
    for i in 0..m.nrows() {
        let (x, y) = (m[(i, p)], m[(i, q)]);
        m[(i, p)] = c * x - s * y;
        m[(i, q)] = s * x + c * y;
    }
}
