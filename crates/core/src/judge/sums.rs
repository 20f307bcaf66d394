//! Sums of products per block and joint, and the fit of all terms.

use nalgebra::{DMatrix, DVector};

use super::bounded::{self, Bound};

/// An unknown, with its column in the rows of each joint that it acts on.
#[derive(Debug, Clone, PartialEq)]
pub struct Term {
    /// Joint and column.
    pub columns: Vec<(usize, usize)>,
    pub bound: Bound,
}

impl Term {
    /// Its column in the rows of a joint.
    pub(super) fn column(&self, joint: usize) -> Option<usize> {
        let own = self.columns.iter().find(|(j, _)| *j == joint);
        own.map(|(_, column)| *column)
    }
}

/// Sums of products of every joint's columns, the torque last, `[block][joint]`.
#[derive(Debug, Clone, Default)]
pub struct BlockSums {
    pub blocks: Vec<Vec<DMatrix<f64>>>,
    /// Rows, `[block][joint]`.
    pub rows: Vec<Vec<f64>>,
}

impl BlockSums {
    /// Zeros for so many blocks of joints with so many columns each, the torque not counted.
    pub fn zeros(blocks: usize, columns: &[usize]) -> Self {
        let of_joint = |c: &usize| DMatrix::zeros(c + 1, c + 1);
        let of_block = |_| columns.iter().map(of_joint).collect();
        Self {
            blocks: (0..blocks).map(of_block).collect(),
            rows: vec![vec![0.0; columns.len()]; blocks],
        }
    }

    /// Takes off the blocks from one on.
    pub(crate) fn split_off(&mut self, at: usize) -> Self {
        Self {
            blocks: self.blocks.split_off(at),
            rows: self.rows.split_off(at),
        }
    }

    /// These blocks, and behind them those of other sums.
    pub(crate) fn followed_by(&self, mut other: BlockSums) -> Self {
        let mut all = self.clone();
        all.blocks.append(&mut other.blocks);
        all.rows.append(&mut other.rows);
        all
    }

    /// The sum over some blocks, joint by joint.
    pub fn over(&self, blocks: impl Iterator<Item = usize>) -> Vec<DMatrix<f64>> {
        let mut total: Vec<DMatrix<f64>> = Vec::new();
        for b in blocks {
            match total.is_empty() {
                true => total.clone_from(&self.blocks[b]),
                false => (total.iter_mut().zip(&self.blocks[b])).for_each(|(t, x)| *t += x),
            }
        }
        total
    }

    /// The mean with other sums of the same blocks.
    pub(crate) fn mean(mut self, other: &BlockSums) -> Self {
        let pairs = self.blocks.iter_mut().zip(&other.blocks);
        for (own, other) in pairs.flat_map(|(own, other)| own.iter_mut().zip(other)) {
            *own = (&*own + other) * 0.5;
        }
        self
    }

    /// Rows of each joint in all blocks.
    pub(crate) fn rows_of(&self, joint: usize) -> f64 {
        self.rows.iter().map(|rows| rows[joint]).sum()
    }
}

/// Terms that are fitted together, and what is known of them beforehand.
#[derive(Debug, Clone)]
pub struct Terms {
    pub list: Vec<Term>,
    /// Weight of each joint's squares: 1 / variance of its residual.
    pub weights: Vec<f64>,
    /// Information of the first terms, and its pull at zero.
    pub prior: (DMatrix<f64>, DVector<f64>),
    /// Part of the diagonal that is added to it.
    pub ridge: f64,
}

/// A fit of all terms.
#[derive(Debug, Clone)]
pub struct TermFit {
    pub values: DVector<f64>,
    /// Squared residual of each joint.
    pub squares: Vec<f64>,
}

impl Terms {
    pub(crate) fn len(&self) -> usize {
        self.list.len()
    }

    /// Weighted normal matrix and right side of joints' sums, without prior and ridge.
    pub(super) fn normal(&self, sums: &[DMatrix<f64>]) -> (DMatrix<f64>, DVector<f64>) {
        let u = self.len();
        let mut all = (DMatrix::zeros(u, u), DVector::zeros(u));
        self.add_normal(&self.own_of_all(), sums, 1.0, &mut all);
        all
    }

    /// Adds the same so many times; `own` is [`Terms::own_of_all`].
    pub(super) fn add_normal(
        &self,
        own: &[Vec<(usize, usize)>],
        sums: &[DMatrix<f64>],
        times: f64,
        (normal, right): &mut (DMatrix<f64>, DVector<f64>),
    ) {
        for ((own, sums), w) in own.iter().zip(sums).zip(&self.weights) {
            let w = times * w;
            let torque = sums.column(sums.ncols() - 1);
            for &(l, b) in own {
                right[l] += w * torque[b];
                let (mut to, from) = (normal.column_mut(l), sums.column(b));
                for &(i, a) in own {
                    to[i] += w * from[a];
                }
            }
        }
    }

    /// Places and columns of the terms of each joint.
    pub(super) fn own_of_all(&self) -> Vec<Vec<(usize, usize)>> {
        (0..self.weights.len()).map(|j| self.own(j)).collect()
    }

    /// Places and columns of the terms that a joint's rows have.
    pub(super) fn own(&self, joint: usize) -> Vec<(usize, usize)> {
        let list = self.list.iter().enumerate();
        list.filter_map(|(i, term)| Some((i, term.column(joint)?)))
            .collect()
    }

    /// Adds what is known beforehand, and the ridge of the matrix of all data.
    pub(super) fn firm(&self, normal: &mut DMatrix<f64>, right: &mut DVector<f64>, all: &[f64]) {
        let (information, pull) = &self.prior;
        let known = pull.len();
        let mut corner = normal.view_mut((0, 0), (known, known));
        corner += information;
        let mut first = right.rows_mut(0, known);
        first += pull;
        for (i, x) in all.iter().enumerate() {
            normal[(i, i)] += self.ridge * x;
        }
    }

    /// Fits all terms to joints' sums, some of them held.
    pub fn fit(&self, sums: &[DMatrix<f64>], held: &[(usize, f64)]) -> TermFit {
        let (normal, right) = self.firmed(sums);
        let mut bounds = self.bounds();
        for (i, x) in held {
            bounds[*i] = Bound {
                least: *x,
                most: *x,
            };
        }
        let values = bounded::solve(&normal, &right, &bounds);
        TermFit {
            squares: self.squares(sums, &values),
            values,
        }
    }

    /// Values of all terms fitted to joints' sums, some of them kept near 0 by so many parts of their own diagonal.
    pub(crate) fn damped_values(
        &self,
        sums: &[DMatrix<f64>],
        (damped, damping): (&[usize], f64),
    ) -> DVector<f64> {
        let (mut normal, right) = self.firmed(sums);
        for i in damped {
            normal[(*i, *i)] *= 1.0 + damping;
        }
        bounded::solve(&normal, &right, &self.bounds())
    }

    fn bounds(&self) -> Vec<Bound> {
        self.list.iter().map(|t| t.bound).collect()
    }

    /// Information matrix of the terms: that of joints' sums and of what is known beforehand, in weighted rows.
    pub(crate) fn information(&self, sums: &[DMatrix<f64>]) -> DMatrix<f64> {
        self.firmed(sums).0
    }

    fn firmed(&self, sums: &[DMatrix<f64>]) -> (DMatrix<f64>, DVector<f64>) {
        let (mut normal, mut right) = self.normal(sums);
        let diagonal: Vec<f64> = normal.diagonal().iter().copied().collect();
        self.firm(&mut normal, &mut right, &diagonal);
        (normal, right)
    }

    /// Normal matrix and right side with what is known beforehand; a ridge holds what the data do not determine at all.
    pub(super) fn firm_normal(&self, sums: &[DMatrix<f64>]) -> (DMatrix<f64>, DVector<f64>) {
        let (mut normal, mut right) = self.normal(sums);
        let diagonal: Vec<f64> = normal.diagonal().iter().map(|x| x.max(1e-300)).collect();
        self.firm(&mut normal, &mut right, &diagonal);
        (normal, right)
    }

    /// The covariance of a fit's values by that of its prior, over the squared unit in which information counts.
    pub(crate) fn known_before(&self, sums: &[DMatrix<f64>]) -> Option<DMatrix<f64>> {
        let prior = self.prior.0.clone().resize(self.len(), self.len(), 0.0);
        let factor = self.firm_normal(sums).0.cholesky()?;
        Some(factor.solve(&factor.solve(&prior).transpose()))
    }

    /// Sum over joints in their weights.
    pub(crate) fn weigh(&self, squares: &[f64]) -> f64 {
        let pairs = squares.iter().zip(&self.weights);
        pairs.map(|(s, w)| s * w).sum()
    }

    /// Squared residual of each joint at some values.
    pub fn squares(&self, sums: &[DMatrix<f64>], values: &DVector<f64>) -> Vec<f64> {
        let of_joint = |(j, sums): (usize, &DMatrix<f64>)| {
            let own = self.own(j);
            let tau = sums.nrows() - 1;
            let mut square = sums[(tau, tau)];
            for &(i, a) in &own {
                let products = sums.column(a);
                let through: f64 = own.iter().map(|&(l, b)| products[b] * values[l]).sum();
                square += values[i] * (through - 2.0 * products[tau]);
            }
            square.max(0.0)
        };
        sums.iter().enumerate().map(of_joint).collect()
    }

    /// The same terms and more.
    pub fn with(&self, more: &[Term]) -> Terms {
        let mut all = self.clone();
        all.list.extend_from_slice(more);
        all
    }
}
