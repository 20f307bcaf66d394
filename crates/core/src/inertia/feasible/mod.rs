//! Physically consistent link parameters: positive definite pseudo-inertias and drive inertias above zero.
//!
//! The fit's R factor says how much the torques suffer for any parameters, so the nearest feasible
//! ones are found on it, without reading a log again: least squares over ten free numbers a link
//! ([`log_cholesky`]) and the logarithm of each drive's inertia, damped as Levenberg and Marquardt
//! do. What torques do not determine is filled by a prior: the mass properties that the robot file gives,
//! or a plain body, with a small weight in the same ten numbers.

mod friction;
mod log_cholesky;

pub use friction::{FrictionColumns, with_friction};

use nalgebra::{DMatrix, DVector, SVector};

use super::solution::FitError;
use crate::math::descent::{Ending, StepControl, Trial, descend};
use crate::math::rfactor::RFactor;
use crate::robot::bodies::StandardMap;
use crate::robot::standard::{Body, STANDARD, pseudo_inertia};
use log_cholesky::LogCholesky;

/// Weight of the prior: a number off by 1 (a factor e in mass or size) costs as much as one
/// independent row of data that is off by a tenth of its noise.
pub const PRIOR_WEIGHT: f64 = 0.01;
/// The body that stands where a robot file gives none: 2 kg about the frame's origin, with a radius
/// of gyration of 0.1 m along each axis.
pub const PLAIN: Body = Body {
    mass: 2.0,
    centre: [0.0; 3],
    inertia: [0.04, 0.0, 0.0, 0.04, 0.0, 0.04],
};
/// Inertia of a drive before data [kg m^2 or kg].
const PLAIN_DRIVE: f64 = 0.1;
/// A step that lowers the cost by less than this share is the last.
const SETTLED: f64 = 1e-6;
/// Damping of the steps.
const DAMPING: StepControl = StepControl::damping(5.0, 4.0, [1e-12, 1e12]);
/// Most steps under each weight of the prior.
const MAX_STEPS: usize = 300;
/// Weights of the prior on the way to [`PRIOR_WEIGHT`].
const WEIGHTS: [f64; 7] = [1e4, 1e3, 100.0, 10.0, 1.0, 0.1, PRIOR_WEIGHT];
/// A number changes by at most this in one step.
const FARTHEST: f64 = 2.0;

/// What the search is given.
#[derive(Debug, Clone)]
pub struct ConsistencyProblem<'a> {
    pub map: &'a StandardMap,
    /// Prior of each link, where there is one.
    pub bodies: &'a [Option<Body>],
    /// R factor of the weighted rows: shared parameters first, then other unknowns, then the target.
    pub factor: &'a DMatrix<f64>,
    /// Effective sample size over rows: what correlated rows count.
    pub effective: f64,
}

/// Physically consistent parameters.
#[derive(Debug, Clone)]
pub struct Feasible {
    /// All unknowns, in the order of the factor's columns.
    pub theta: DVector<f64>,
    /// Standard parameters of each link.
    pub links: Vec<[f64; STANDARD]>,
    /// Inertia of each drive of the map [kg m^2 or kg].
    pub drives: Vec<f64>,
    /// Whether each link's prior comes from the robot file.
    pub given: Vec<bool>,
    pub ending: Ending,
    pub iterations: usize,
}

/// Least squares over physically consistent links.
///
/// A given prior that no body can have counts as none.
///
/// # Errors
/// [`FitError`].
pub fn feasible(task: &ConsistencyProblem) -> Result<Feasible, FitError> {
    let links = task.map.links.len();
    let drives = task.map.drives.len();
    let mut prior = DVector::zeros(STANDARD * links + drives);
    let mut given = Vec::with_capacity(links);
    for i in 0..links {
        let of = |body: Body| log_cholesky::of(&pseudo_inertia(&body.standard()));
        let own = task.bodies.get(i).copied().flatten().and_then(of);
        given.push(own.is_some());
        if let Some(x) = own.or_else(|| of(PLAIN)) {
            prior.rows_mut(STANDARD * i, STANDARD).copy_from_slice(&x);
        }
    }
    let of_drives = STANDARD * links;
    prior.rows_mut(of_drives, drives).fill(PLAIN_DRIVE.ln());

    let reduced = EliminatedFactor::of(task);
    let (mut x, mut iterations, mut ending) = (prior.clone(), 0, Ending::IterationLimit);
    // from the prior outward: a search that begins without it runs along the border of what
    // is consistent, where its numbers go to infinity and it hardly moves
    for weight in WEIGHTS {
        let at = |x: DVector<f64>| reduced.at(task.map, x, &prior, weight);
        let found = descend(at(x), &DAMPING, MAX_STEPS, &mut |from, damping| {
            let step = from.damped_step(weight, damping);
            let next = at(&from.x + step.map(|s| s.clamp(-FARTHEST, FARTHEST)));
            let (lowest, cost) = (from.cost, next.cost);
            Ok::<_, FitError>(match cost < lowest {
                true if lowest - cost <= SETTLED * cost => Trial::Last(next),
                true => Trial::Accepted(next),
                false => Trial::Rejected,
            })
        })?;
        x = found.0.x;
        ending = found.1;
        iterations += found.2;
    }
    let (standard, _) = standard_at(task.map, &x);
    let mapped = &task.map.matrix * &standard;
    Ok(Feasible {
        theta: reduced.complete(&mapped),
        links: (0..links)
            .map(|i| std::array::from_fn(|k| standard[STANDARD * i + k]))
            .collect(),
        drives: standard.as_slice()[of_drives..].to_vec(),
        given,
        ending,
        iterations,
    })
}

/// The physically consistent unknowns that give nearly the torques of `theta` on the rows of `factor`: for
/// simulations, which a mass matrix that is not positive definite lets run away.
///
/// # Errors
/// [`FitError`].
pub fn nearest(
    map: &StandardMap,
    factor: &DMatrix<f64>,
    effective: f64,
    theta: &DVector<f64>,
) -> Result<DVector<f64>, FitError> {
    let u = theta.len();
    let mut factor = factor.clone();
    let torque = factor.columns(0, u) * theta;
    factor.set_column(u, &torque);
    let bodies = vec![None; map.links.len()];
    let task = ConsistencyProblem {
        map,
        bodies: &bodies,
        factor: &factor,
        effective,
    };
    Ok(feasible(&task)?.theta)
}

/// Standard parameters, and the derivatives of each link's by its own numbers, column by column; a drive's is its own.
fn standard_at(
    map: &StandardMap,
    x: &DVector<f64>,
) -> (DVector<f64>, Vec<[[f64; STANDARD]; STANDARD]>) {
    let links = map.links.len();
    let mut s = x.map(f64::exp);
    let of_link = |i: usize| {
        let at = STANDARD * i;
        let own: LogCholesky = std::array::from_fn(|k| x[at + k]);
        let (values, columns) = log_cholesky::standard(&own);
        s.rows_mut(at, STANDARD).copy_from_slice(&values);
        columns
    };
    let slopes = (0..links).map(of_link).collect();
    (s, slopes)
}

/// Where a search stands.
struct Point {
    x: DVector<f64>,
    /// Residual of the data and its slopes by the numbers.
    residual: DVector<f64>,
    jacobian: DMatrix<f64>,
    /// Distance from the prior.
    off: DVector<f64>,
    cost: f64,
}

impl Point {
    /// Least-squares step with the columns' own size as damping.
    fn damped_step(&self, weight: f64, damping: f64) -> DVector<f64> {
        let n = self.jacobian.ncols();
        // prior and damping have one row a number: the rows of the data go under their triangle
        let mut triangle = vec![0.0; (n + 1) * (n + 1)];
        for (c, column) in self.jacobian.column_iter().enumerate() {
            let size = (weight + damping * (column.norm_squared() + weight)).sqrt();
            triangle[c * (n + 2)] = size;
            triangle[c * (n + 1) + n] = -weight * self.off[c] / size;
        }
        let mut factor = RFactor::of_triangle(n + 1, triangle);
        let mut rows = self.jacobian.clone().insert_column(n, 0.0);
        rows.set_column(n, &-&self.residual);
        factor.fold(rows.transpose().as_slice());
        let r = factor.r();
        let right = r.view((0, n), (n, 1)).column(0).into_owned();
        let square = r.view((0, 0), (n, n));
        square
            .solve_upper_triangular(&right)
            .unwrap_or_else(|| DVector::zeros(n))
    }
}

/// The factor with the unknowns that no link has a part in solved for.
struct EliminatedFactor {
    /// Columns of the factor: free ones first, then mapped ones.
    order: Vec<usize>,
    free: usize,
    r: DMatrix<f64>,
    /// What standard parameters do to the rows of the mapped unknowns, and what those rows are to be.
    rows: DMatrix<f64>,
    target: DVector<f64>,
}

impl EliminatedFactor {
    fn of(task: &ConsistencyProblem) -> Self {
        let u = task.factor.ncols() - 1;
        let p = task.map.matrix.nrows();
        let mapped = |c: &usize| *c < p && task.map.matrix.row(*c).amax() > 0.0;
        let (mapped, mut order): (Vec<usize>, Vec<usize>) = (0..u).partition(mapped);
        let free = order.len();
        order.extend(mapped);
        let ordered = task.factor.select_columns(&[&order[..], &[u]].concat());
        let mut factor = RFactor::new(u + 1);
        factor.fold(ordered.transpose().as_slice());
        let (r, m) = (factor.r(), u - free);
        let scale = task.effective.sqrt();
        let chosen = task.map.matrix.select_rows(&order[free..]);
        EliminatedFactor {
            rows: r.view((free, free), (m, m)) * scale * chosen,
            target: r.view((free, u), (m, 1)).column(0) * scale,
            order,
            free,
            r,
        }
    }

    fn at(&self, map: &StandardMap, x: DVector<f64>, prior: &DVector<f64>, weight: f64) -> Point {
        let (s, slopes) = standard_at(map, &x);
        let residual = &self.rows * &s - &self.target;
        let mut jacobian = self.rows.clone();
        for (c, mut column) in jacobian.column_iter_mut().enumerate() {
            match slopes.get(c / STANDARD) {
                Some(slopes) => {
                    let own = self.rows.columns(c / STANDARD * STANDARD, STANDARD);
                    own.mul_to(&SVector::from(slopes[c % STANDARD]), &mut column);
                }
                None => column *= s[c],
            }
        }
        let off = &x - prior;
        Point {
            cost: residual.norm_squared() + weight * off.norm_squared(),
            x,
            residual,
            jacobian,
            off,
        }
    }

    /// All unknowns from the shared parameters of the map.
    fn complete(&self, shared: &DVector<f64>) -> DVector<f64> {
        let u = self.order.len();
        let m = u - self.free;
        let known = DVector::from_fn(m, |k, _| shared[self.order[self.free + k]]);
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

#[cfg(test)]
mod tests;
