//! Normal equations over pieces of time, summed from filtered rows.

use std::ops::Range;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::data_split::{DataSplit, Piece, RowRole};
use super::rows::{Column, Filtered, Inertial, filtered};
use super::unknowns::{Unknown, Unknowns};
use crate::effect::AugmentedModel;
use crate::motion::{MotionError, ParallelFilters, Stretch};

/// Sums of one joint over one piece: columns and residual.
#[derive(Debug, Clone)]
pub struct PieceSums {
    /// X'X of the joint's own columns.
    pub normal: DMatrix<f64>,
    /// X'e.
    pub score: DVector<f64>,
    /// e'e.
    pub square: f64,
}

impl PieceSums {
    fn none(columns: usize) -> Self {
        PieceSums {
            normal: DMatrix::zeros(columns, columns),
            score: DVector::zeros(columns),
            square: 0.0,
        }
    }

    /// `known` is X'X of the first columns, where it has been summed before.
    fn of(
        columns: &[Column],
        residual: &[f64],
        rows: Range<usize>,
        known: Option<&DMatrix<f64>>,
    ) -> Self {
        let e = &residual[rows.clone()];
        let mut sums = PieceSums::none(columns.len());
        let first = known.map_or(0, DMatrix::nrows);
        if let Some(known) = known {
            let block = &mut sums.normal.view_mut((0, 0), (first, first));
            block.copy_from(known);
        }
        for (a, x) in columns.iter().enumerate() {
            let x = &x[rows.clone()];
            sums.score[a] = dot(x, e);
            if a < first {
                continue;
            }
            for (b, y) in columns[..=a].iter().enumerate() {
                let product = dot(x, &y[rows.clone()]);
                sums.normal[(a, b)] = product;
                sums.normal[(b, a)] = product;
            }
        }
        sums.square = dot(e, e);
        sums
    }
}

/// X'X of the inertial parameters' columns, `[piece][joint]`, once it has been summed; none of joints that were late
/// then. It is that of every model on the same rows.
pub type InertialSums = OnceLock<Vec<Vec<Option<DMatrix<f64>>>>>;

/// All rows of the base model, reduced to pieces; the rows themselves stay for candidates.
pub struct Base {
    pub unknowns: Unknowns,
    pub stretches: Vec<Filtered>,
    /// `[piece][joint]`.
    pub sums: Vec<Vec<PieceSums>>,
}

impl Base {
    /// Filters every stretch and sums over the pieces.
    ///
    /// # Errors
    /// [`MotionError`] of the filter.
    pub fn of(
        model: &AugmentedModel,
        unknowns: Unknowns,
        (stretches, inertial): (&[Stretch], &[Inertial]),
        (filters, rest_weight): (&ParallelFilters, &[f64]),
        (split, known): (&DataSplit, &InertialSums),
    ) -> Result<Self, MotionError> {
        let filtered = stretches
            .par_iter()
            .zip(inertial)
            .enumerate()
            .map(|(i, motion)| {
                let filter = filters.of(motion.0);
                filtered(model, &unknowns, motion, (filter, rest_weight), &|j| {
                    split.ignores(i, j)
                })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let late = |j: usize| model.shift(j) != 0.0;
        let of_piece = |(i, piece): (usize, &Piece)| {
            let rows = &filtered[piece.stretch];
            let joints = 0..rows.columns.len();
            let of_joint = |j: usize| {
                let (columns, range) = (&rows.columns[j], piece.rows.clone());
                let known = known.get().filter(|_| !late(j));
                match split.ignores(piece.stretch, j) {
                    true => PieceSums::none(columns.len()),
                    false => PieceSums::of(
                        columns,
                        &rows.residual[j],
                        range,
                        known.and_then(|k| k[i][j].as_ref()),
                    ),
                }
            };
            joints.map(of_joint).collect()
        };
        let pieces = split.pieces.par_iter().enumerate();
        let sums: Vec<Vec<PieceSums>> = pieces.map(of_piece).collect();
        known.get_or_init(|| {
            let own = |j: usize| {
                let list = unknowns.columns[j].iter();
                let theta = |i: &&usize| matches!(unknowns.list[**i], Unknown::Theta(_));
                list.take_while(theta).count()
            };
            let of_joint = |(j, sums): (usize, &PieceSums)| {
                let block = || sums.normal.view((0, 0), (own(j), own(j))).into_owned();
                (!late(j)).then(block)
            };
            let of_piece = |sums: &Vec<PieceSums>| sums.iter().enumerate().map(of_joint).collect();
            sums.iter().map(of_piece).collect()
        });
        Ok(Base {
            unknowns,
            stretches: filtered,
            sums,
        })
    }

    /// Squared residual of each joint over the fitted rows.
    pub(crate) fn residual_squares(&self, split: &DataSplit) -> Vec<f64> {
        let joints = self.unknowns.columns.len();
        let of_joint = |j: usize| {
            let pieces = split.pieces.iter().zip(&self.sums);
            let fitted = pieces.filter(|(p, _)| p.role.fitted());
            fitted.map(|(_, s)| s[j].square).sum()
        };
        (0..joints).map(of_joint).collect()
    }

    /// Root mean square of each joint's residual over the fitted rows.
    pub(crate) fn residual_rms(&self, split: &DataSplit) -> Vec<f64> {
        let squares = self.residual_squares(split);
        let rows = |j| split.fitted_rows_of(j).max(1) as f64;
        let joints = squares.iter().enumerate();
        joints.map(|(j, s)| (s / rows(j)).sqrt()).collect()
    }

    /// Weighted normal matrix, score and squared residual over the pieces whose role is wanted.
    pub fn total(
        &self,
        split: &DataSplit,
        weights: &[f64],
        wanted: &dyn Fn(RowRole) -> bool,
    ) -> NormalEquations {
        let u = self.unknowns.len();
        let mut total = NormalEquations::none(u);
        for (piece, sums) in split.pieces.iter().zip(&self.sums) {
            if wanted(piece.role) {
                self.add(sums, weights, &mut total);
            }
        }
        total
    }

    /// The same of every such piece by itself.
    pub fn each(
        &self,
        split: &DataSplit,
        weights: &[f64],
        wanted: &dyn Fn(RowRole) -> bool,
    ) -> Vec<NormalEquations> {
        let pieces = split.pieces.iter().zip(&self.sums);
        let wanted = pieces.filter(|(p, _)| wanted(p.role));
        wanted.map(|(_, sums)| self.sum_of(sums, weights)).collect()
    }

    /// The same of one piece.
    pub(crate) fn sum_of(&self, sums: &[PieceSums], weights: &[f64]) -> NormalEquations {
        let mut total = NormalEquations::none(self.unknowns.len());
        self.add(sums, weights, &mut total);
        total
    }

    /// Adds one piece.
    pub(crate) fn add(&self, sums: &[PieceSums], weights: &[f64], total: &mut NormalEquations) {
        for (j, s) in sums.iter().enumerate() {
            let w = weights[j] * weights[j];
            let columns = &self.unknowns.columns[j];
            for (a, &i) in columns.iter().enumerate() {
                total.score[i] += w * s.score[a];
                for (b, &l) in columns.iter().enumerate() {
                    total.normal[(i, l)] += w * s.normal[(a, b)];
                }
            }
            total.square += w * s.square;
        }
    }
}

/// Weighted sums over pieces.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    pub normal: DMatrix<f64>,
    pub score: DVector<f64>,
    pub square: f64,
}

impl NormalEquations {
    pub(crate) fn none(u: usize) -> Self {
        NormalEquations {
            normal: DMatrix::zeros(u, u),
            score: DVector::zeros(u),
            square: 0.0,
        }
    }
}

/// Inner product, in a fixed order: eight sums side by side, for one would wait for itself.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    debug_assert_eq!(a.len(), b.len());
    let (blocks_a, rest_a) = a.as_chunks::<8>();
    let (blocks_b, rest_b) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in blocks_a.iter().zip(blocks_b) {
        for l in 0..8 {
            sums[l] += a[l] * b[l];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_inner_product_counts_every_pair_whatever_their_number() {
        for n in [0, 1, 7, 8, 9, 16, 29] {
            let a: Vec<f64> = (0..n).map(|k| f64::from(k) - 3.0).collect();
            let b: Vec<f64> = (0..n).map(|k| 2.0 * f64::from(k) + 1.0).collect();
            let wanted: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
            assert_eq!(dot(&a, &b), wanted, "{n}");
        }
    }
}
