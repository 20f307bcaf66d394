//! The triangular factor R of a tall matrix A, `A' A = R' R`, from rows that arrive one block at a
//! time.
//!
//! Rows are collected in a small column-major block and folded under the triangle by Householder
//! reflections (Golub and Van Loan 2013, section 5.2; the tree form is Demmel, Grigori, Hoemmen
//! and Langou 2012). Two factors of the same columns merge by folding one triangle under the
//! other. Unlike the normal equations this keeps the condition number of A.
//!
//! The result depends on the order of rows and merges, not on how the rows were cut into calls.

use nalgebra::DMatrix;

use super::MathError;
use super::lanes::{LaneWork, Simd, widest};

/// Numbers of a block: what a first-level cache of 32 KiB holds.
const BLOCK: usize = 4096;
/// Fewest and most rows folded at once: vectors want some, and more of them save nothing.
const BLOCK_ROWS: [usize; 2] = [32, 256];

/// A column whose squares sum to less counts as zero, as the tails of filters do: a reflector would divide by underflow.
const TINY: f64 = 1e-280;

/// R factor of a stacked matrix of `columns` columns, built up by rows.
///
/// Values are squared: entries below 1e-140 count as zero, those beyond 1e150 overflow, a NaN spreads to R (and is reported
/// by [`super::rank::svd`]).
#[derive(Debug, Clone)]
pub struct RFactor {
    columns: usize,
    rows: u64,
    /// Upper triangle, row-major, `columns x columns`; below the diagonal zeros.
    triangle: Vec<f64>,
    /// Rows that are not yet folded, column-major.
    block: Vec<f64>,
    /// Rows that the block holds: its stride.
    stride: usize,
    /// Of each waiting row the column of its first entry that is not zero: what stands before it need not be reduced.
    first: Vec<usize>,
}

impl RFactor {
    /// An empty factor (R = 0, no rows) of `columns` columns.
    pub fn new(columns: usize) -> Self {
        let [fewest, most] = BLOCK_ROWS;
        let stride = (BLOCK / columns.max(1)).clamp(fewest, most) / 8 * 8;
        Self {
            columns,
            rows: 0,
            triangle: vec![0.0; columns * columns],
            block: vec![0.0; columns * stride],
            stride,
            first: Vec::new(),
        }
    }

    /// The factor of rows that are an upper triangle already, row-major.
    pub fn of_triangle(columns: usize, triangle: Vec<f64>) -> Self {
        debug_assert_eq!(triangle.len(), columns * columns, "a square");
        Self {
            rows: columns as u64,
            triangle,
            ..Self::new(columns)
        }
    }

    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows of the stacked matrix so far.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Adds rows, `k x columns` row-major. A tail that is no whole row is not read.
    pub fn fold(&mut self, rows: &[f64]) {
        if self.columns == 0 {
            return;
        }
        for row in rows.chunks_exact(self.columns) {
            self.push(row);
        }
        self.rows += (rows.len() / self.columns) as u64;
    }

    /// Adds all rows of another factor of the same columns.
    ///
    /// # Errors
    /// [`MathError::ColumnMismatch`] if the widths differ.
    pub fn merge(&mut self, other: &RFactor) -> Result<(), MathError> {
        if other.columns != self.columns {
            return Err(MathError::ColumnMismatch {
                expected: self.columns,
                found: other.columns,
            });
        }
        let n = self.columns;
        if n > 0 {
            for row in other.triangle.chunks_exact(n) {
                self.push(row);
            }
        }
        let mut row = vec![0.0; n];
        for k in 0..other.first.len() {
            for (j, x) in row.iter_mut().enumerate() {
                *x = other.block[j * other.stride + k];
            }
            self.push(&row);
        }
        self.rows += other.rows;
        Ok(())
    }

    /// Folds the rows that wait in the block.
    pub fn flush(&mut self) {
        if !self.first.is_empty() {
            in_order(&mut self.first, &mut self.block, self.stride);
            reduce(
                &self.first,
                self.stride,
                &mut self.triangle,
                &mut self.block,
            );
            self.first.clear();
        }
    }

    /// R, `columns x columns`, upper triangular, of all rows added so far. Signs of its rows are
    /// not normalised.
    pub fn r(&self) -> DMatrix<f64> {
        let (n, k) = (self.columns, self.first.len());
        let mut triangle = self.triangle.clone();
        if k > 0 {
            let columns = self.block.chunks_exact(self.stride);
            let mut waiting: Vec<f64> = columns.flat_map(|x| &x[..k]).copied().collect();
            let mut first = self.first.clone();
            in_order(&mut first, &mut waiting, k);
            reduce(&first, k, &mut triangle, &mut waiting);
        }
        DMatrix::from_row_slice(n, n, &triangle)
    }

    /// The rows themselves while they are fewer than the columns, `k x columns`, otherwise R: either has the products
    /// of the stacked matrix, and few rows need no reflection.
    pub fn short(&self) -> DMatrix<f64> {
        let waiting = self.first.len();
        let few = self.rows == waiting as u64 && waiting < self.columns;
        match few {
            true => DMatrix::from_fn(waiting, self.columns, |k, j| {
                self.block[j * self.stride + k]
            }),
            false => self.r(),
        }
    }

    pub fn clear(&mut self) {
        self.triangle.fill(0.0);
        self.first.clear();
        self.rows = 0;
    }

    fn push(&mut self, row: &[f64]) {
        let pending = self.first.len();
        for (column, &x) in self.block.chunks_exact_mut(self.stride).zip(row) {
            column[pending] = x;
        }
        let first = row.iter().position(|x| *x != 0.0);
        self.first.push(first.unwrap_or(row.len()));
        if self.first.len() == self.stride {
            self.flush();
        }
    }
}

/// Puts the rows of a column-major block in the order of their first numbers that are not zero.
fn in_order(first: &mut [usize], block: &mut [f64], stride: usize) {
    if first.is_sorted() {
        return;
    }
    let mut order: Vec<usize> = (0..first.len()).collect();
    order.sort_by_key(|k| first[*k]);
    first.sort_unstable();
    let mut sorted = vec![0.0; first.len()];
    for column in block.chunks_exact_mut(stride) {
        for (to, k) in sorted.iter_mut().zip(&order) {
            *to = column[*k];
        }
        column[..sorted.len()].copy_from_slice(&sorted);
    }
}

/// Annihilates rows of the column-major `block`, whose columns begin `stride` apart, under the row-major `triangle`.
/// Row k is zero before column `first[k]`; `first` is sorted.
fn reduce(first: &[usize], stride: usize, triangle: &mut [f64], block: &mut [f64]) {
    widest(FactorReduction {
        first,
        stride,
        triangle,
        block,
    });
}

/// A triangle, and the block of rows that is reduced into it.
struct FactorReduction<'a> {
    first: &'a [usize],
    stride: usize,
    triangle: &'a mut [f64],
    block: &'a mut [f64],
}

impl LaneWork for FactorReduction<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self {
            first,
            stride,
            triangle,
            block,
        } = self;
        let n = block.len() / stride;
        let mut k = 0;
        for j in 0..n {
            k += first[k..].iter().take_while(|first| **first <= j).count();
            let (left, right) = block.split_at_mut((j + 1) * stride);
            let u = &left[j * stride..j * stride + k];
            let below = dot(u, u);
            if below < TINY {
                continue;
            }
            let diagonal = triangle[j * n + j];
            let norm = (diagonal * diagonal + below).sqrt();
            // The reflector is I - w w' / h with w = [u0; u]; the sign avoids cancellation in u0.
            let (u0, r) = if diagonal > 0.0 {
                (diagonal + norm, -norm)
            } else {
                (diagonal - norm, norm)
            };
            let inverse_h = 1.0 / (norm * (norm + diagonal.abs()));
            triangle[j * n + j] = r;

            let row = &mut triangle[j * n + j + 1..(j + 1) * n];
            let mut quads = right.chunks_exact_mut(4 * stride);
            let mut entries = row.chunks_exact_mut(4);
            for (columns, r) in (&mut quads).zip(&mut entries) {
                let (a, rest) = columns.split_at_mut(stride);
                let (b, rest) = rest.split_at_mut(stride);
                let (c, d) = rest.split_at_mut(stride);
                reflect_four(
                    u,
                    [&mut a[..k], &mut b[..k], &mut c[..k], &mut d[..k]],
                    r,
                    u0,
                    inverse_h,
                );
            }
            for (column, r) in quads
                .into_remainder()
                .chunks_exact_mut(stride)
                .zip(entries.into_remainder())
            {
                let column = &mut column[..k];
                let s = (u0 * *r + dot(u, column)) * inverse_h;
                *r -= s * u0;
                for (x, y) in column.iter_mut().zip(u) {
                    *x -= s * y;
                }
            }
        }
    }
}

/// The reflection of four columns at once: `u` is then read from the cache a quarter as often.
#[inline(always)]
fn reflect_four(u: &[f64], columns: [&mut [f64]; 4], r: &mut [f64], u0: f64, inverse_h: f64) {
    let [a, b, c, d] = columns;
    let mut sums = [[0.0_f64; 4]; 4];
    let lanes = u.len() / 4 * 4;
    let mut i = 0;
    while i < lanes {
        let w = &u[i..i + 4];
        for (sum, column) in sums.iter_mut().zip([&*a, &*b, &*c, &*d]) {
            let x = &column[i..i + 4];
            for l in 0..4 {
                sum[l] += w[l] * x[l];
            }
        }
        i += 4;
    }
    let mut scale = [0.0; 4];
    for (m, column) in [&*a, &*b, &*c, &*d].into_iter().enumerate() {
        let mut tail = 0.0;
        for l in lanes..u.len() {
            tail += u[l] * column[l];
        }
        let s = &sums[m];
        let product = (s[0] + s[1]) + (s[2] + s[3]) + tail;
        scale[m] = (u0 * r[m] + product) * inverse_h;
        r[m] -= scale[m] * u0;
    }
    for ((((w, a), b), c), d) in u.iter().zip(a).zip(b).zip(c).zip(d) {
        *a -= scale[0] * w;
        *b -= scale[1] * w;
        *c -= scale[2] * w;
        *d -= scale[3] * w;
    }
}

/// Inner product with eight partial sums, which the compiler keeps in vector registers.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0_f64; 8];
    let mut a8 = a.chunks_exact(8);
    let mut b8 = b.chunks_exact(8);
    for (x, y) in (&mut a8).zip(&mut b8) {
        for l in 0..8 {
            sums[l] += x[l] * y[l];
        }
    }
    let tail: f64 = a8
        .remainder()
        .iter()
        .zip(b8.remainder())
        .map(|(x, y)| x * y)
        .sum();
    ((sums[0] + sums[1]) + (sums[2] + sums[3])) + ((sums[4] + sums[5]) + (sums[6] + sums[7])) + tail
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::math::{jacobi, rank};

    fn random_rows(rows: usize, columns: usize, seed: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..rows * columns)
            .map(|_| rng.random_range(-1.0..1.0))
            .collect()
    }

    /// Columns agree with the Gram matrix of the rows: `R'R = A'A`.
    fn gram_error(factor: &RFactor, rows: &[f64]) -> f64 {
        let n = factor.columns();
        let a = DMatrix::from_row_slice(rows.len() / n, n, rows);
        let r = factor.r();
        (r.transpose() * &r - a.transpose() * &a).norm() / a.norm_squared()
    }

    #[test]
    fn columns_of_vanishing_size_leave_the_others_finite() {
        let (mut factor, mut plain) = (RFactor::new(3), RFactor::new(2));
        for k in 0..600 {
            let (x, y) = ((0.1 * f64::from(k)).sin(), (0.3 * f64::from(k)).cos());
            factor.fold(&[1e-160 * x, x, y]);
            plain.fold(&[x, y]);
        }
        let r = factor.r();
        assert!(r.iter().all(|x| x.is_finite()), "{r}");
        let rest = r.view((1, 1), (2, 2)).map(f64::abs);
        assert!((rest - plain.r().map(f64::abs)).amax() < 1e-12);
    }

    #[test]
    fn the_factor_has_the_gram_matrix_of_its_rows() {
        for columns in 1..=14 {
            for rows in [1, 3, 255, 256, 257, 1500] {
                let data = random_rows(rows, columns, 7);
                let mut factor = RFactor::new(columns);
                factor.fold(&data);
                assert_eq!(factor.rows(), rows as u64);
                assert!(gram_error(&factor, &data) < 1e-14, "{rows} x {columns}");
                let r = factor.r();
                assert_eq!(r, r.upper_triangle());
            }
        }
    }

    #[test]
    fn rows_that_begin_with_zeros_count_in_any_order() {
        for columns in [1, 2, 5, 9, 40, 150] {
            let mut data = random_rows(700, columns, 11);
            for (k, row) in data.chunks_exact_mut(columns).enumerate() {
                row[..(k * 7919) % (columns + 1)].fill(0.0);
            }
            let mut factor = RFactor::new(columns);
            factor.fold(&data);
            assert!(gram_error(&factor, &data) < 1e-14, "{columns}");
            let mut twice = RFactor::of_triangle(columns, factor.r().transpose().as_slice().into());
            twice.merge(&factor).expect("same width");
            let both = [data.clone(), data].concat();
            assert!(gram_error(&twice, &both) < 1e-14, "{columns}");
        }
    }

    #[test]
    fn how_rows_are_cut_into_calls_changes_no_bit() {
        let data = random_rows(1000, 5, 3);
        let mut whole = RFactor::new(5);
        whole.fold(&data);
        let mut pieces = RFactor::new(5);
        for piece in data.chunks(5 * 37) {
            pieces.fold(piece);
        }
        assert_eq!(whole.r(), pieces.r());
    }

    #[test]
    fn reading_the_factor_does_not_change_what_follows() {
        let data = random_rows(700, 4, 9);
        let (mut a, mut b) = (RFactor::new(4), RFactor::new(4));
        a.fold(&data[..400]);
        let _ = a.r();
        a.fold(&data[400..]);
        b.fold(&data);
        assert_eq!(a.r(), b.r());
    }

    #[test]
    fn small_singular_values_survive_where_the_gram_matrix_loses_them() {
        // Two columns that differ by 1e-10: the normal equations see rank one.
        let mut factor = RFactor::new(2);
        let mut rows = Vec::new();
        for i in 0..5000 {
            let x = (0.01 * i as f64).sin();
            let y = (0.37 * i as f64).cos();
            rows.extend([x, x + 1e-10 * y]);
        }
        factor.fold(&rows);
        let s = rank::svd(&factor.r()).expect("finite").s;
        let exact = 1e-10 * (2500.0_f64).sqrt() / 2.0_f64.sqrt();
        assert!((s[1] / exact - 1.0).abs() < 1e-2, "{}", s[1] / exact);
        assert_eq!(rank::rank(&s, factor.rows()), 2);
        let s = jacobi::svd(&factor.r()).s;
        assert!((s[1] / exact - 1.0).abs() < 1e-2);
    }

    #[test]
    fn an_empty_factor_is_zero_and_merges_as_nothing() {
        let mut empty = RFactor::new(3);
        assert_eq!(empty.r(), DMatrix::zeros(3, 3));
        let data = random_rows(10, 3, 1);
        let mut full = RFactor::new(3);
        full.fold(&data);
        empty.merge(&full).expect("same width");
        assert!(gram_error(&empty, &data) < 1e-15);
        assert_eq!(empty.rows(), 10);
        RFactor::new(0).fold(&[]);
    }

    #[test]
    fn factors_of_other_width_do_not_merge() {
        let error = RFactor::new(3).merge(&RFactor::new(4));
        assert_eq!(
            error,
            Err(MathError::ColumnMismatch {
                expected: 3,
                found: 4
            })
        );
    }
}
