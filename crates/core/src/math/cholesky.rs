//! Normal equations by the Cholesky factor of their matrix, in place.

use nalgebra::{DMatrix, DVector};

use super::lanes::{LaneWork, Simd, widest};
use super::rfactor::dot;

/// Columns that are taken off another at once.
const TOGETHER: usize = 4;

/// Solves A x = b, of whose symmetric matrix the lower half is read; the factor takes its place, and x that of b. False where
/// the matrix is not positive definite: both hold nothing then.
#[must_use]
pub fn solve(a: &mut DMatrix<f64>, b: &mut DVector<f64>) -> bool {
    debug_assert!(a.is_square() && a.nrows() == b.len(), "as many as rows");
    widest(CholeskySolve {
        n: b.len(),
        a: a.as_mut_slice(),
        b: b.as_mut_slice(),
    })
}

/// A system `A x = b` with `n` unknowns, solved in place.
struct CholeskySolve<'a> {
    n: usize,
    a: &'a mut [f64],
    b: &'a mut [f64],
}

impl LaneWork for CholeskySolve<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> bool {
        let Self { n, a, b } = self;
        for j in 0..n {
            let (before, rest) = a.split_at_mut(j * n);
            let column = &mut rest[j..n];
            take_off(column, before, n, j);
            let diagonal = column[0].sqrt();
            // nor is a NaN
            if column[0].is_nan() || column[0] <= 0.0 {
                return false;
            }
            column[0] = diagonal;
            column[1..].iter_mut().for_each(|x| *x /= diagonal);
        }
        substitute_column(a, n, b);
        true
    }
}

/// Solves L L' X = B; of the factor the lower half is read, and X takes the place of B.
pub(crate) fn substitute(factor: &DMatrix<f64>, columns: &mut DMatrix<f64>) {
    debug_assert!(factor.is_square() && factor.nrows() == columns.nrows());
    widest(ColumnSubstitution {
        n: factor.nrows(),
        factor: factor.as_slice(),
        columns: columns.as_mut_slice(),
    });
}

/// Systems of `n` unknowns with the same factor, their right sides one behind the other.
struct ColumnSubstitution<'a> {
    n: usize,
    factor: &'a [f64],
    columns: &'a mut [f64],
}

impl LaneWork for ColumnSubstitution<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        for column in self.columns.chunks_exact_mut(self.n.max(1)) {
            substitute_column(self.factor, self.n, column);
        }
    }
}

/// Solves L L' x = b in place; what is zero at the begin of b stays so in L' x.
#[inline(always)]
fn substitute_column(factor: &[f64], n: usize, b: &mut [f64]) {
    let first = b.iter().position(|x| *x != 0.0).unwrap_or(n);
    for j in first..n {
        let (x, below) = b[j..].split_at_mut(1);
        let column = &factor[j * n + j..(j + 1) * n];
        x[0] /= column[0];
        for (b, l) in below.iter_mut().zip(&column[1..]) {
            *b -= x[0] * l;
        }
    }
    for j in (0..n).rev() {
        let (x, below) = b[j..].split_at_mut(1);
        let column = &factor[j * n + j..(j + 1) * n];
        x[0] = (x[0] - dot(&column[1..], below)) / column[0];
    }
}

/// Takes off a column, from its row j down, what the columns before it have of it.
#[inline(always)]
fn take_off(column: &mut [f64], before: &[f64], n: usize, j: usize) {
    let mut groups = before.chunks_exact(TOGETHER * n);
    for group in &mut groups {
        let [x, y, z, w] = std::array::from_fn(|m| &group[m * n + j..(m + 1) * n]);
        let by = [x[0], y[0], z[0], w[0]];
        let others = x.iter().zip(y).zip(z).zip(w);
        for (to, (((x, y), z), w)) in column.iter_mut().zip(others) {
            *to = *to - by[0] * x - by[1] * y - by[2] * z - by[3] * w;
        }
    }
    for one in groups.remainder().chunks_exact(n) {
        let by = one[j];
        for (to, x) in column.iter_mut().zip(&one[j..]) {
            *to -= by * x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solutions_are_those_of_the_equations_and_what_is_not_positive_definite_has_none() {
        for n in [0, 1, 2, 3, 4, 5, 9, 30] {
            let rows = DMatrix::from_fn(n + 4, n, |i, k| {
                (1.1 + (i * i) as f64 + 1.7 * k as f64).sin()
            });
            let a = rows.transpose() * &rows + DMatrix::identity(n, n);
            let x = DVector::from_fn(n, |i, _| 0.3 + i as f64);
            let (mut factor, mut b) = (a.clone(), &a * &x);
            assert!(solve(&mut factor, &mut b));
            assert!((b - &x).amax() < 1e-11 || n == 0, "{n}");
            let solutions = DMatrix::from_fn(n, 3, |i, k| (i as f64 - 1.0) * k as f64);
            let mut columns = &a * &solutions;
            substitute(&factor, &mut columns);
            assert!((columns - &solutions).iter().all(|x| x.abs() < 1e-11));
            if n > 0 {
                let mut a = a;
                a[(n - 1, n - 1)] = f64::NAN;
                assert!(!solve(&mut a.clone(), &mut x.clone()));
                a[(n - 1, n - 1)] = -1.0;
                assert!(!solve(&mut a, &mut x.clone()));
            }
        }
    }
}
