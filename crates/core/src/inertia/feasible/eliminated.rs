//! The R factor of the rows with the unknowns that nothing bounds solved for.

use nalgebra::{DMatrix, DVector};

use super::ConsistencyProblem;
use super::cone::InteriorPoint;
use super::friction::FrictionLevels;
use crate::math::rfactor::RFactor;

/// The factor by standard parameters and friction levels.
pub(super) struct EliminatedFactor {
    /// Columns of the factor: free ones first, then bounded ones.
    order: Vec<usize>,
    free: usize,
    r: DMatrix<f64>,
    /// Bounded unknowns of standard parameters and friction levels.
    bounded: DMatrix<f64>,
    friction: Vec<f64>,
    /// What standard parameters and friction levels do to the rows, and what those rows are to be.
    pub rows: DMatrix<f64>,
    target: DVector<f64>,
}

impl EliminatedFactor {
    pub fn of(task: &ConsistencyProblem) -> Self {
        let u = task.factor.ncols() - 1;
        let p = task.map.matrix.nrows();
        let of_friction = FrictionLevels::of(task.friction, task.factor);
        let levels: Vec<_> = of_friction
            .iter()
            .flat_map(FrictionLevels::levels)
            .collect();
        let shared = task.map.columns();
        let mut whole = DMatrix::zeros(u, shared + levels.len());
        whole
            .view_mut((0, 0), (p, shared))
            .copy_from(&task.map.matrix);
        for (k, level) in levels.iter().enumerate() {
            for (unknown, part) in &level.parts {
                whole[(*unknown, shared + k)] = *part;
            }
        }
        let bounded = |c: &usize| whole.row(*c).amax() > 0.0;
        let (bounded, mut order): (Vec<usize>, Vec<usize>) = (0..u).partition(bounded);
        let free = order.len();
        order.extend(bounded);
        let ordered = task.factor.select_columns(&[&order[..], &[u]].concat());
        let mut factor = RFactor::new(u + 1);
        factor.fold(ordered.transpose().as_slice());
        let (r, m) = (factor.r(), u - free);
        let scale = task.effective.sqrt();
        let bounded = whole.select_rows(&order[free..]);
        EliminatedFactor {
            rows: r.view((free, free), (m, m)) * scale * &bounded,
            target: r.view((free, u), (m, 1)).column(0) * scale,
            order,
            free,
            r,
            bounded,
            friction: levels.iter().map(|level| level.plain).collect(),
        }
    }

    /// Friction levels before data, behind the drives.
    pub fn plain_friction(&self) -> impl Iterator<Item = f64> + '_ {
        self.friction.iter().copied()
    }

    pub fn residual(&self, at: &InteriorPoint) -> DVector<f64> {
        &self.rows * at.standard() - &self.target
    }

    /// All unknowns from standard parameters and friction levels.
    pub fn complete(&self, standard: &DVector<f64>) -> DVector<f64> {
        let u = self.order.len();
        let m = u - self.free;
        let known = &self.bounded * standard;
        let rest = self.r.view((0, u), (self.free, 1))
            - self.r.view((0, self.free), (self.free, m)) * &known;
        let mut theta = DVector::zeros(u);
        // back substitution; a column that no row excites stays at 0
        let sizes = (0..self.free).map(|i| self.r[(i, i)].abs());
        let largest = sizes.fold(0.0, f64::max);
        let mut free = vec![0.0; self.free];
        for i in (0..self.free).rev() {
            let beyond: f64 = (i + 1..self.free).map(|k| self.r[(i, k)] * free[k]).sum();
            if self.r[(i, i)].abs() > 1e-12 * largest {
                free[i] = (rest[i] - beyond) / self.r[(i, i)];
            }
            theta[self.order[i]] = free[i];
        }
        for (k, c) in self.order[self.free..].iter().enumerate() {
            theta[*c] = known[k];
        }
        theta
    }
}
