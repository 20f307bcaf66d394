//! Sums of products of a candidate's columns with what is declared, with themselves and with the residual.

use nalgebra::{DMatrix, DVector};

/// Sums of a candidate over one piece.
pub(crate) struct CrossProducts {
    /// X'WC over all unknowns.
    pub with_base: DMatrix<f64>,
    /// C'WC.
    pub own: DMatrix<f64>,
    /// C'We.
    pub score: DVector<f64>,
}

impl CrossProducts {
    pub fn none(u: usize, k: usize) -> Self {
        CrossProducts {
            with_base: DMatrix::zeros(u, k),
            own: DMatrix::zeros(k, k),
            score: DVector::zeros(k),
        }
    }

    pub fn add(&mut self, other: &CrossProducts) {
        self.with_base += &other.with_base;
        self.own += &other.own;
        self.score += &other.score;
    }

    pub fn without(&self, other: &CrossProducts) -> CrossProducts {
        CrossProducts {
            with_base: &self.with_base - &other.with_base,
            own: &self.own - &other.own,
            score: &self.score - &other.score,
        }
    }
}
