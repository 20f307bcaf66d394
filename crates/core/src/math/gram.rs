//! Sums of products of rows, X' X.

use nalgebra::DMatrix;

use super::lanes::{LaneWork, Simd, widest};

/// Columns whose sums are kept at once with those of [`ACROSS`] others: so many sums stay in registers.
const DOWN: usize = 4;
const ACROSS: usize = 8;

/// Numbers from the begin of a row to that of the next one, for rows of so many columns: what is beyond the columns is zero.
pub fn stride(columns: usize) -> usize {
    columns.next_multiple_of(ACROSS)
}

/// X' X of rows of so many columns, [`stride`] numbers apart. The order of the sums is that of the rows.
pub fn gram(rows: &[f64], columns: usize) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(columns, columns);
    if columns > 0 {
        widest(GramProducts {
            rows,
            columns,
            out: out.as_mut_slice(),
        });
    }
    out
}

/// x' S x of a symmetric matrix S.
pub(crate) fn quadratic_form(sums: &DMatrix<f64>, x: &[f64]) -> f64 {
    debug_assert!(sums.is_square() && sums.nrows() == x.len());
    widest(QuadraticForm {
        sums: sums.as_slice(),
        x,
    })
}

/// x' S x, the columns of S one behind the other.
struct QuadraticForm<'a> {
    sums: &'a [f64],
    x: &'a [f64],
}

impl LaneWork for QuadraticForm<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> f64 {
        let mut along = vec![0.0; self.x.len()];
        let columns = self.sums.chunks_exact(self.x.len().max(1)).zip(self.x);
        for (column, x) in columns.filter(|(_, x)| **x != 0.0) {
            for (to, y) in along.iter_mut().zip(column) {
                *to += x * y;
            }
        }
        self.x.iter().zip(&along).map(|(x, y)| x * y).sum()
    }
}

/// Products of the columns of a block of rows, which are summed up in `out`.
struct GramProducts<'a> {
    rows: &'a [f64],
    columns: usize,
    out: &'a mut [f64],
}

impl LaneWork for GramProducts<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let n = self.columns;
        for down in (0..n).step_by(DOWN) {
            for across in (down / ACROSS * ACROSS..n).step_by(ACROSS) {
                let sums = tile(self.rows, stride(n), down, across);
                for (a, sums) in (down..n).zip(&sums) {
                    for (b, sum) in (across..n).zip(sums) {
                        self.out[b * n + a] = *sum;
                        self.out[a * n + b] = *sum;
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn tile(rows: &[f64], stride: usize, down: usize, across: usize) -> [[f64; ACROSS]; DOWN] {
    let mut sums = [[0.0; ACROSS]; DOWN];
    for row in rows.chunks_exact(stride) {
        let (x, y) = (&row[down..down + DOWN], &row[across..across + ACROSS]);
        for (sums, x) in sums.iter_mut().zip(x) {
            for (sum, y) in sums.iter_mut().zip(y) {
                *sum += x * y;
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_plain_product() {
        for columns in [0, 1, 3, 4, 7, 8, 9, 20, 33] {
            for count in [0, 1, 5, 40] {
                let x = DMatrix::from_fn(columns, count, |i, k| {
                    (0.7 + i as f64 * 1.3 + k as f64 * 2.1).sin()
                });
                let mut rows = vec![0.0; count * stride(columns)];
                for k in 0..if columns > 0 { count } else { 0 } {
                    let at = k * stride(columns);
                    rows[at..at + columns].copy_from_slice(x.column(k).as_slice());
                }
                let off = gram(&rows, columns) - &x * x.transpose();
                assert!(off.iter().all(|x| x.abs() < 1e-13), "{columns} x {count}");
            }
        }
    }
}
