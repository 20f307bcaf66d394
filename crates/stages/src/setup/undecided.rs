//! Why data cannot tell: a joint that misses much, and no mistake that repairs it.

use super::LIMITS;
use super::problem::Problem;
use super::trial::Trial;
use cft_ident_core::inertia::columns::JointTerm;

/// What keeps data from telling.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// It moves in proportion to another joint, by this factor.
    Proportion(usize, f64),
    /// No other joint moves.
    Alone,
    /// This share of its torque is friction.
    Friction(f64),
    /// None that is known.
    Other,
}

/// A joint that misses much, and no mistake that repairs it.
#[derive(Debug, Clone, PartialEq)]
pub struct Undecided {
    pub joint: usize,
    /// Error as declared, a share of its torque.
    pub error: f64,
    pub cause: Cause,
}

/// The joints that miss most of their torque.
pub(super) fn undecided(problem: &Problem, declared: &Trial) -> Vec<Undecided> {
    let moving = problem.channels_that_move();
    let errors = declared.errors();
    let cause = |j: usize| {
        if let Some((other, ratio)) = proportion(problem, &moving, j) {
            return Cause::Proportion(other, ratio);
        }
        let share = friction(problem, declared, j);
        if moving.len() == 1 {
            Cause::Alone
        } else if share > LIMITS.unexplained {
            Cause::Friction(share)
        } else {
            Cause::Other
        }
    };
    let missed =
        |j: &usize| errors[*j] > LIMITS.unexplained && problem.sample.travel(*j) > LIMITS.still;
    let undecided = |joint: usize| Undecided {
        joint,
        error: errors[joint],
        cause: cause(joint),
    };
    let missed = moving.iter().copied().filter(missed);
    missed.map(undecided).collect()
}

/// Another joint whose speed is that of this one times a factor.
pub(super) fn proportion(problem: &Problem, moving: &[usize], j: usize) -> Option<(usize, f64)> {
    let product = |a: usize, b: usize| problem.sample.product(|row| row.v[a] * row.v[b]);
    let own = product(j, j);
    let of = |k: &usize| {
        let (other, across) = (product(*k, *k), product(j, *k));
        // what is left of one beside the other is less than a joint that stands still has
        let left = 1.0 - across * across / (own * other);
        (left < LIMITS.still * LIMITS.still).then_some((*k, across / other))
    };
    moving.iter().filter(|k| **k != j).find_map(of)
}

/// Share of a joint's torque that its friction terms take, by root mean square.
fn friction(problem: &Problem, trial: &Trial, j: usize) -> f64 {
    let own = &problem.columns.own[j];
    let first = problem.first_own(&trial.robot, j);
    let sums = &trial.total[j];
    let column = sums.nrows() - 1 - own.len();
    let terms = || (0..own.len()).filter(|i| own[*i] != JointTerm::Offset);
    let pairs = terms().flat_map(|a| terms().map(move |b| (a, b)));
    let product =
        |(a, b)| trial.theta[first + a] * trial.theta[first + b] * sums[(column + a, column + b)];
    let square: f64 = pairs.map(product).sum();
    (square.max(0.0) * trial.terms.weights[j]).sqrt()
}
