//! Physically consistent parameters: positive definite pseudo-inertias, drive inertias above zero, friction that takes power.
//!
//! The torques are linear in the pseudo-inertias, so the least squares over them is a convex problem (Wensing, Kim and
//! Slotine 2018). The fit's R factor says how much the torques suffer for any parameters, so it is solved on that, without
//! reading a log again: Newton's steps on the sum of squares and the distance from a prior ([`cone`]), whose weight falls
//! from stage to stage. What torques do not determine is filled by the prior: the mass properties that the robot file
//! gives, or a plain body. The last stage ends at the optimum, and a duality gap says how near.

mod cone;
mod eliminated;
mod friction;

pub use friction::FrictionColumns;

use nalgebra::{DMatrix, DVector};

use super::solution::FitError;
use crate::math::MathError;
use crate::math::descent::IterationEnding;
use crate::math::rfactor::RFactor;
use crate::robot::bodies::StandardMap;
use crate::robot::standard::{Body, STANDARD};
use cone::{ConePrior, InteriorPoint, prior_of};
use eliminated::EliminatedFactor;

/// Weight of the prior: a body that is off by a factor e in mass or size costs as much as one independent row of data
/// that is off by about a tenth of its noise.
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
/// Factor by which the weight of the prior falls from stage to stage.
const FALL: f64 = 10.0;
/// Most of Newton's steps under each weight. A tenth: heavy arms whose rows leave whole links open end on their way.
const MAX_STEPS: usize = 1000;
/// Squares of Newton's decrement, in units of the barrier: below the first a whole step is safe (Nesterov and
/// Nemirovskii 1994) and near enough for the next weight; below the second the optimum is reached to the last digits.
const NEAR: f64 = 0.06;
const AT_END: f64 = 1e-14;
/// Least part of the decrease that a step promises.
const SUFFICIENT: f64 = 0.1;
/// Shortest part of a step, where not even the safe one stays inside.
const SHORTEST: f64 = 1e-9;

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
    /// Friction f_c sgn v + f_v v that takes power from rest to the speeds given.
    pub friction: &'a [FrictionColumns],
}

/// Physically consistent parameters.
#[derive(Debug, Clone)]
pub struct FeasibleParameters {
    /// All unknowns, in the order of the factor's columns.
    pub theta: DVector<f64>,
    /// Standard parameters of each link.
    pub links: Vec<[f64; STANDARD]>,
    /// Inertia of each drive of the map [kg m^2 or kg].
    pub drives: Vec<f64>,
    /// Whether each link's prior comes from the robot file.
    pub given: Vec<bool>,
    /// Most by which the sum of squares, in independent rows, is above that of any other physically consistent
    /// parameters, up to what the prior pulls: the duality gap.
    pub gap: f64,
    /// Converged where Newton's decrement proves the gap.
    pub ending: IterationEnding,
    pub iterations: usize,
}

/// Least squares over physically consistent parameters: the same rows give the same numbers to the last digit.
///
/// A given prior that no body can have counts as none.
///
/// # Errors
/// [`FitError`].
pub fn feasible(task: &ConsistencyProblem) -> Result<FeasibleParameters, FitError> {
    let links = task.map.links.len();
    let drives = task.map.drives.len();
    if !task.factor.iter().all(|x| x.is_finite()) {
        return Err(not_finite(task.factor).into());
    }
    let rows = EliminatedFactor::of(task);
    let (mut priors, mut given) = (Vec::with_capacity(links), Vec::with_capacity(links));
    for i in 0..links {
        let own = task.bodies.get(i).copied().flatten();
        let own = own.and_then(|body| prior_of(&body));
        given.push(own.is_some());
        priors.extend(own.or_else(|| prior_of(&PLAIN)));
    }
    let mut numbers = vec![PLAIN_DRIVE; drives];
    numbers.extend(rows.plain_friction());
    let cone = ConePrior {
        links: priors,
        numbers,
    };
    let mut at = cone.start().ok_or_else(|| not_finite(task.factor))?;
    let (mut iterations, mut decrement) = (0, f64::INFINITY);
    // from the prior outward, where Newton's steps are long: it weighs as much as the rows at first
    let misfit = rows.residual(&at).norm_squared().max(PRIOR_WEIGHT);
    let stages = (misfit / PRIOR_WEIGHT).log(FALL).ceil() as i32;
    for stage in (0..=stages).rev() {
        let enough = if stage == 0 { AT_END } else { NEAR };
        let stage = WeightStage {
            rows: &rows,
            cone: &cone,
            weight: PRIOR_WEIGHT * FALL.powi(stage),
        };
        let steps;
        (at, steps, decrement) = stage.descend(at, enough);
        iterations += steps;
    }
    let last = WeightStage {
        rows: &rows,
        cone: &cone,
        weight: PRIOR_WEIGHT,
    };
    let gap = last.gap(&at);
    let standard = at.standard();
    Ok(FeasibleParameters {
        theta: rows.complete(&standard),
        links: (0..links)
            .map(|i| std::array::from_fn(|k| standard[STANDARD * i + k]))
            .collect(),
        drives: at.numbers[..drives].to_vec(),
        given,
        gap,
        ending: match decrement <= NEAR {
            true => IterationEnding::Converged,
            false => IterationEnding::IterationLimit,
        },
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
        friction: &[],
    };
    Ok(feasible(&task)?.theta)
}

/// The first entry of a factor that is no number.
fn not_finite(factor: &DMatrix<f64>) -> MathError {
    let at = factor.iter().position(|x| !x.is_finite()).unwrap_or(0);
    let rows = factor.nrows().max(1);
    MathError::NotFinite {
        row: at % rows,
        column: at / rows,
        value: factor.iter().nth(at).copied().unwrap_or(f64::NAN),
    }
}

/// The search under one weight of the prior.
struct WeightStage<'a> {
    rows: &'a EliminatedFactor,
    cone: &'a ConePrior,
    weight: f64,
}

impl WeightStage<'_> {
    fn cost(&self, at: &InteriorPoint) -> f64 {
        self.rows.residual(at).norm_squared() + self.weight * self.cone.distance(at)
    }

    /// Newton's step in the own coordinates of a point, by least squares and not by its squares; and the decrement's
    /// square in units of the barrier. Nothing where numbers leave the finite.
    fn step(&self, at: &InteriorPoint) -> Option<(DVector<f64>, f64)> {
        let jacobian = at.in_own_coordinates(&self.rows.rows);
        let n = jacobian.ncols();
        let half = (0.5 * self.weight).sqrt();
        let towards = (self.cone.unit() - self.cone.pull(at)) * half;
        let mut triangle = vec![0.0; (n + 1) * (n + 1)];
        for (k, towards) in towards.iter().enumerate() {
            triangle[k * (n + 2)] = half;
            triangle[k * (n + 1) + n] = *towards;
        }
        let mut factor = RFactor::of_triangle(n + 1, triangle);
        let mut rows = jacobian.insert_column(n, 0.0);
        rows.set_column(n, &-self.rows.residual(at));
        factor.fold(rows.transpose().as_slice());
        let r = factor.r();
        let right = r.view((0, n), (n, 1)).column(0).into_owned();
        let square = r.view((0, 0), (n, n));
        let step = square.solve_upper_triangular(&right);
        let step = step.filter(|step| step.iter().all(|x| x.is_finite()))?;
        // the Hessian is twice the square of the triangle
        let decrement = 2.0 * right.norm_squared() / self.weight;
        Some((step, decrement))
    }

    /// Steps until the decrement is small `enough`, or digits are used up; how many they were, and the last decrement.
    fn descend(&self, start: InteriorPoint, enough: f64) -> (InteriorPoint, usize, f64) {
        let (mut at, mut before) = (start, f64::INFINITY);
        for taken in 0..MAX_STEPS {
            let Some((step, decrement)) = self.step(&at) else {
                return (at, taken, before);
            };
            // near the optimum every step squares the distance, until rounding is what is left of it
            let rounding = decrement < NEAR && decrement > 0.25 * before;
            if decrement <= enough || rounding {
                return (at, taken, decrement);
            }
            let (cost, promised) = (self.cost(&at), self.weight * decrement);
            let mut part = at.longest(&step);
            // a step that short lowers the cost for certain (Nesterov and Nemirovskii 1994), whatever rounding makes of it
            let safe = 1.0 / (1.0 + decrement.sqrt());
            loop {
                let next = at.after(&step, part);
                let lower = |next: &InteriorPoint| {
                    decrement < NEAR
                        || part <= safe
                        || self.cost(next) <= cost - SUFFICIENT * part * promised
                };
                if let Some(next) = next.filter(lower) {
                    at = next;
                    break;
                }
                part *= 0.5;
                if part < SHORTEST {
                    return (at, taken, decrement);
                }
            }
            before = decrement;
        }
        (at, MAX_STEPS, before)
    }

    /// Duality gap of the sum of squares with the prior's pull: what their gradient gives along the point itself. Near the
    /// optimum that gradient is the weight over the point, positive definite for every link and number.
    fn gap(&self, at: &InteriorPoint) -> f64 {
        let jacobian = at.in_own_coordinates(&self.rows.rows);
        let slope =
            jacobian.tr_mul(&self.rows.residual(at)) * 2.0 + self.cone.pull(at) * self.weight;
        slope.dot(&self.cone.unit())
    }
}

#[cfg(test)]
mod tests;
