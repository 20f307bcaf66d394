//! Errors of blocks by fits without them, where many fits are tried and most of them are soon seen to be worse.

use nalgebra::{DMatrix, DVector};

use super::bounded::{self, Bound};
use super::sums::Terms;
use crate::math::cholesky;
use crate::math::gram::quadratic_form;

/// A fit to all blocks: it leaves no more of them than fits without each of them.
pub struct FitToAll<'a> {
    terms: &'a Terms,
    /// Weights by which the last columns of each joint add up to its torque.
    torques: &'a [DVector<f64>],
    own: Vec<Vec<(usize, usize)>>,
    /// Of all blocks; the matrix has its lower half alone.
    normal: (DMatrix<f64>, DVector<f64>),
    diagonal: Vec<f64>,
    values: DVector<f64>,
    error: f64,
}

/// Errors of blocks by fits without them, and by the fit to all.
pub struct BlockErrors {
    /// Squared errors of each block by the fit of the others, `[block][joint]`.
    pub errors: Vec<Vec<f64>>,
    /// Values of the terms by all blocks.
    pub values: DVector<f64>,
    /// The same without each block.
    pub without: Vec<DVector<f64>>,
}

impl<'a> FitToAll<'a> {
    /// Of blocks with these sums: columns of the terms, which have no bounds, then those that add up to a torque by `torques`.
    pub fn new(total: &[DMatrix<f64>], torques: &'a [DVector<f64>], terms: &'a Terms) -> Self {
        let u = terms.len();
        let mut out = Self {
            terms,
            torques,
            own: terms.own_of_all(),
            normal: (DMatrix::zeros(u, u), DVector::zeros(u)),
            diagonal: Vec::new(),
            values: DVector::zeros(0),
            error: 0.0,
        };
        out.normal = out.plus(total, 1.0);
        let all = out.normal.0.diagonal();
        out.diagonal = all.iter().map(|x| x.max(1e-300)).collect();
        let (mut matrix, mut side) = out.normal.clone();
        out.terms.firm(&mut matrix, &mut side, all.as_slice());
        out.values = match all.iter().all(|x| *x > 0.0) {
            true if cholesky::solve(&mut matrix, &mut side) => side,
            true => DVector::zeros(u),
            false => bounded::solve(&matrix, &side, &vec![Bound::NONE; u]),
        };
        out.error = out.error_of(total);
        out
    }

    /// Its weighted squared error; none where it found nothing, which bounds nothing.
    pub fn least(&self) -> Option<f64> {
        let found = self.values.iter().any(|x| *x != 0.0);
        found.then_some(self.error)
    }

    /// Its weighted squared error in some rows.
    pub fn error_of(&self, sums: &[DMatrix<f64>]) -> f64 {
        self.terms.weigh(&self.squares(sums, &self.values))
    }

    /// Whether an error of which this is the least is surely above `most`.
    pub fn is_above(&self, least: f64, most: f64) -> bool {
        // sums of products hold half of a number's digits of an error
        let rounding = f64::EPSILON.sqrt();
        self.least().is_some() && least > most * (1.0 + rounding) + rounding
    }

    /// Fits without each block, in this order; none where one determines nothing, or the weighted error is surely above `most`.
    pub fn blocks<'b>(
        self,
        (order, block): (&[usize], impl Fn(usize) -> &'b [DMatrix<f64>]),
        most: f64,
    ) -> Option<BlockErrors> {
        let mut to_come = self.error;
        let mut out = BlockErrors {
            errors: vec![Vec::new(); order.len()],
            values: DVector::zeros(0),
            without: vec![DVector::zeros(0); order.len()],
        };
        let mut so_far = 0.0;
        for &b in order {
            if self.is_above(so_far + to_come, most) {
                return None;
            }
            let values = self.without(block(b))?;
            let errors = self.squares(block(b), &values);
            so_far += self.terms.weigh(&errors);
            to_come -= self.error_of(block(b));
            out.errors[b] = errors;
            out.without[b] = values;
        }
        out.values = self.values;
        Some(out)
    }

    fn without(&self, block: &[DMatrix<f64>]) -> Option<DVector<f64>> {
        let (mut matrix, mut side) = self.plus(block, -1.0);
        self.terms.firm(&mut matrix, &mut side, &self.diagonal);
        cholesky::solve(&mut matrix, &mut side).then_some(side)
    }

    /// The lower half of its normal matrix, and its right side, with sums added so many times.
    fn plus(&self, sums: &[DMatrix<f64>], times: f64) -> (DMatrix<f64>, DVector<f64>) {
        let (mut normal, mut right) = self.normal.clone();
        let joints = self.own.iter().zip(sums).zip(self.torques);
        for (((own, sums), torque), w) in joints.zip(&self.terms.weights) {
            let (w, first) = (times * w, sums.ncols() - torque.len());
            for (k, part) in torque.iter().enumerate().filter(|(_, part)| **part != 0.0) {
                let column = sums.column(first + k);
                for &(i, a) in own {
                    right[i] += w * part * column[a];
                }
            }
            for (at, &(l, b)) in own.iter().enumerate() {
                let (mut to, from) = (normal.column_mut(l), sums.column(b));
                for &(i, a) in &own[at..] {
                    to[i] += w * from[a];
                }
            }
        }
        (normal, right)
    }

    /// Squared residual of each joint at some values.
    fn squares(&self, sums: &[DMatrix<f64>], values: &DVector<f64>) -> Vec<f64> {
        let joints = self.own.iter().zip(sums).zip(self.torques);
        let of_joint = |((own, sums), torque)| {
            let (own, sums): (&Vec<(usize, usize)>, &DMatrix<f64>) = (own, sums);
            let torque: &DVector<f64> = torque;
            let mut x = vec![0.0; sums.nrows()];
            let first = x.len() - torque.len();
            own.iter().for_each(|(i, a)| x[*a] = values[*i]);
            x[first..].iter_mut().zip(torque).for_each(|(x, t)| *x = -t);
            quadratic_form(sums, &x).max(0.0)
        };
        joints.map(of_joint).collect()
    }
}
