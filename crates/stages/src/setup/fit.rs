//! The solution of normal equations with weights of its own, and its likelihood.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::normal::Normal;

/// Rounding of a normal matrix whose columns are scaled to norm 1: what the rows do not determine is kept
/// small by it.
const RIDGE: f64 = 1e-10;
/// Times that the weights of the joints are found anew from the residual.
const SWEEPS: usize = 3;
/// A residual below this share of the torque's power is rounding and smoothing.
const ROUNDING: f64 = 1e-8;

/// By what residuals are measured.
#[derive(Debug, Clone)]
pub(super) struct Power {
    /// Squares of each joint's torque.
    pub joints: Vec<f64>,
    /// Logarithm of their product over that of the channels' squares, as this hypothesis has one from the other: 0 where
    /// each channel is a joint's.
    pub size: f64,
}

/// Least squares under one hypothesis.
#[derive(Debug, Clone)]
pub(super) struct Fit {
    pub theta: DVector<f64>,
    /// Of each joint, one over the variance of its residual.
    pub weights: Vec<f64>,
    /// Squares of the residual of each joint, over its torque's power.
    pub left: Vec<f64>,
    /// Log-likelihood by all rows, independent or not, but for a constant.
    pub score: f64,
    /// Weights of the columns behind the unknowns, by joint.
    pub targets: Vec<DVector<f64>>,
    solver: Solver,
}

/// A factored normal matrix.
#[derive(Debug, Clone)]
struct Solver {
    scale: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
}

impl Solver {
    fn new(mut h: DMatrix<f64>) -> Option<Self> {
        let scale = h
            .diagonal()
            .map(|d| if d > 0.0 { d.sqrt().recip() } else { 1.0 });
        for (i, mut column) in h.column_iter_mut().enumerate() {
            column.component_mul_assign(&scale);
            column *= scale[i];
            column[i] = column[i].max(f64::MIN_POSITIVE) + RIDGE;
            if column[i] < 0.5 {
                column[i] = 1.0;
            }
        }
        Some(Self {
            scale,
            factor: Cholesky::new(h)?,
        })
    }

    fn solve(&self, g: &DVector<f64>) -> DVector<f64> {
        self.factor
            .solve(&g.component_mul(&self.scale))
            .component_mul(&self.scale)
    }
}

impl Fit {
    /// Fits a hypothesis: `targets` are the weights of the torques of each joint, `power` the squares of
    /// its torque. None where the numbers are not finite.
    pub fn new(normal: &Normal, targets: Vec<DVector<f64>>, by: &Power) -> Option<Self> {
        let power = &by.joints;
        let n = normal.joints;
        let active = |j: &usize| !normal.places[*j].is_empty() && power[*j] > 0.0;
        let mut weights: Vec<f64> = (0..n)
            .map(|j| if active(&j) { power[j].recip() } else { 0.0 })
            .collect();
        let mut found = None;
        for _ in 0..SWEEPS {
            let (h, g) = system(&normal.total, normal, &targets, &weights);
            let solver = Solver::new(h)?;
            let theta = solver.solve(&g);
            let left: Vec<f64> = (0..n)
                .map(|j| match active(&j) {
                    true => {
                        let rss = squares(&normal.total[j], &normal.places[j], &targets[j], &theta);
                        (rss / power[j]).max(ROUNDING)
                    }
                    false => 0.0,
                })
                .collect();
            if left.iter().any(|x| !x.is_finite()) {
                return None;
            }
            let rows = normal.rows as f64;
            for j in (0..n).filter(active) {
                weights[j] = rows / (left[j] * power[j]);
            }
            let logs = (0..n).filter(active).map(|j| left[j].ln());
            let score = -0.5 * rows * (logs.sum::<f64>() + by.size);
            found = Some(Self {
                theta,
                weights: weights.clone(),
                left,
                score,
                targets: Vec::new(),
                solver,
            });
        }
        found.map(|fit| Self { targets, ..fit })
    }

    /// Columns solved for.
    pub fn solve(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        let columns: Vec<DVector<f64>> = right
            .column_iter()
            .map(|column| self.solver.solve(&column.into_owned()))
            .collect();
        match columns.is_empty() {
            true => DMatrix::zeros(right.nrows(), 0),
            false => DMatrix::from_columns(&columns),
        }
    }

    /// Relative error, the root of the mean square over the joints that move.
    pub fn error(&self) -> f64 {
        let active = self.left.iter().filter(|x| **x > 0.0);
        let count = active.clone().count().max(1) as f64;
        (active.sum::<f64>() / count).sqrt()
    }

    /// Deviation of f' theta by how the blocks' scores vary.
    pub fn deviation(&self, normal: &Normal, f: &DVector<f64>) -> f64 {
        let h = self.solver.solve(f);
        let sum: f64 = normal
            .blocks
            .iter()
            .map(|block| self.along(normal, block, &h).powi(2))
            .sum();
        let blocks = normal.blocks.len().max(2) as f64;
        (sum * blocks / (blocks - 1.0)).sqrt()
    }

    /// The score of one block along a direction of the unknowns.
    fn along(&self, normal: &Normal, block: &[DMatrix<f64>], h: &DVector<f64>) -> f64 {
        let of = |(j, gram): (usize, &DMatrix<f64>)| {
            let places = &normal.places[j];
            if self.weights[j] == 0.0 || places.is_empty() {
                return 0.0;
            }
            let whole = stacked(places, &self.targets[j], &self.theta);
            let mut direction = DVector::zeros(gram.nrows());
            for (c, at) in places.iter().enumerate() {
                direction[c] = h[*at];
            }
            self.weights[j] * direction.dot(&(gram * whole))
        };
        block.iter().enumerate().map(of).sum()
    }

    /// Squares of the residuals of every block and joint, each by the fit to all other blocks with these
    /// weights.
    pub fn held_out(&self, normal: &Normal) -> Option<Vec<Vec<f64>>> {
        let (h, g) = system(&normal.total, normal, &self.targets, &self.weights);
        let of = |block: &Vec<DMatrix<f64>>| {
            let (dh, dg) = system(block, normal, &self.targets, &self.weights);
            let theta = Solver::new(&h - dh)?.solve(&(&g - dg));
            let joint = |(j, gram): (usize, &DMatrix<f64>)| match self.weights[j] > 0.0 {
                true => squares(gram, &normal.places[j], &self.targets[j], &theta),
                false => 0.0,
            };
            Some(block.iter().enumerate().map(joint).collect())
        };
        normal.blocks.iter().map(of).collect()
    }
}

/// H x = g, where H is a normal matrix.
pub(super) fn solved(h: DMatrix<f64>, g: &DVector<f64>) -> Option<DVector<f64>> {
    Some(Solver::new(h)?.solve(g))
}

/// (-theta, target): what a joint's columns are multiplied with to give its residual.
fn stacked(places: &[usize], target: &DVector<f64>, theta: &DVector<f64>) -> DVector<f64> {
    let c = places.len();
    DVector::from_fn(c + target.len(), |i, _| match i < c {
        true => -theta[places[i]],
        false => target[i - c],
    })
}

/// |target - X theta|^2.
fn squares(
    gram: &DMatrix<f64>,
    places: &[usize],
    target: &DVector<f64>,
    theta: &DVector<f64>,
) -> f64 {
    let whole = stacked(places, target, theta);
    whole.dot(&(gram * &whole)).max(0.0)
}

/// X' W X and X' W target over all joints.
fn system(
    grams: &[DMatrix<f64>],
    normal: &Normal,
    targets: &[DVector<f64>],
    weights: &[f64],
) -> (DMatrix<f64>, DVector<f64>) {
    let u = normal.unknowns;
    let (mut h, mut g) = (DMatrix::zeros(u, u), DVector::zeros(u));
    for (j, gram) in grams.iter().enumerate() {
        let (places, w) = (&normal.places[j], weights[j]);
        let c = places.len();
        if c == 0 || w == 0.0 {
            continue;
        }
        let b = gram.view((0, c), (c, targets[j].len())) * &targets[j];
        for (k, &at) in places.iter().enumerate() {
            g[at] += w * b[k];
            for (i, &row) in places.iter().enumerate() {
                h[(row, at)] += w * gram[(i, k)];
            }
        }
    }
    (h, g)
}
