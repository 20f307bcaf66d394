//! RowEquations of one row, and the place at which what is not linear is linearised.

use cft_ident_core::robot::tree::space::{Rotation, Vector};

use super::wrench_log::turn_between;

/// What the columns of effects that are not linear stand for.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LinearisedAt {
    pub mass: f64,
    /// m c \[kg m\].
    pub first_moment: Vector,
    /// The sensor's axes in the frame whose orientation is logged.
    pub turn: Rotation,
    /// Horizontal part of gravity's direction in the base frame \[rad\].
    pub lean: [f64; 2],
}

impl LinearisedAt {
    /// Whether another step would change nothing.
    pub fn is_near(&self, other: &Self) -> bool {
        let turned = turn_between(&self.turn, &other.turn);
        let lean = [0, 1].map(|k| self.lean[k] - other.lean[k]);
        let small = |x: &f64| x.abs() < 1e-9;
        turned.iter().chain(&lean).all(small)
            && (self.mass - other.mass).abs() <= 1e-9 * self.mass.abs()
    }
}

/// The row's own part of a linear problem: six equations, `p` columns, row-major.
pub(super) struct RowEquations<'a> {
    pub p: usize,
    pub numbers: &'a mut [f64],
}

impl RowEquations<'_> {
    pub fn set(&mut self, equation: usize, column: usize, x: f64) {
        self.numbers[equation * self.p + column] = x;
    }

    /// A column's force and moment.
    pub fn wrench(&mut self, column: usize, force: &Vector, moment: &Vector) {
        for i in 0..3 {
            self.set(i, column, force[i]);
            self.set(3 + i, column, moment[i]);
        }
    }
}

/// Directions of one number each.
pub(super) const AXES: [Vector; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
