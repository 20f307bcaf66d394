//! What a log says of a slope that it cannot determine: a bound by the profile likelihood.
//!
//! The slope steps down while everything else is fitted anew. The steeper one takes the other with it, which would step
//! into its place. A standard deviation says less: it knows the curvature at the maximum alone, and a likelihood that
//! rises to a plateau is curved at its edge.

use super::passes::{LikelihoodMaximum, refine};
use super::problem::{FilterParameters, FrictionProblem};

/// Drop of the log-likelihood at a one-sided 95 % bound: half of 1.645 squared.
const BOUND_DROP: f64 = 1.353;
/// Gauss-Newton steps of the other parameters at each slope.
const GAUSS_NEWTON_STEPS: usize = 8;
/// Step of the slope's logarithm on the way down.
const STRIDE: f64 = 0.25;

/// Fall of the log-likelihood from the maximum to `value`; coloured innovations count for less, as in the covariance.
fn drop(maximum: &LikelihoodMaximum, value: f64) -> f64 {
    (maximum.score.log_likelihood - value) / maximum.widening
}

/// Whether the slope with index `i` (3 or 4) may be as steep as any that is tried, the other parameters fitted anew.
pub(super) fn open_above(problem: &FrictionProblem, maximum: &LikelihoodMaximum, i: usize) -> bool {
    let mut p = maximum.parameters.clone();
    p[i] = (problem.slope_range.1 * problem.velocity_scale).ln();
    let fixed = [&[i], maximum.fixed].concat();
    let refined = refine(problem, p, maximum.noise, GAUSS_NEWTON_STEPS, &fixed);
    drop(maximum, refined.score.log_likelihood) < BOUND_DROP
}

/// One-sided 95 % lower bound of the slope with index `i` (3 or 4); `None` where the whole range is as likely.
pub(super) fn profile_slope(
    problem: &FrictionProblem,
    maximum: &LikelihoodMaximum,
    i: usize,
) -> Option<f64> {
    let refined = |p: FilterParameters, fixed: &[usize]| {
        refine(problem, p, maximum.noise, GAUSS_NEWTON_STEPS, fixed)
    };
    let lowest = (problem.slope_range.0 * problem.velocity_scale).ln();
    let mut p = maximum.parameters.clone();
    let mut before = (p[i], 0.0);
    let fixed = [&[i], maximum.fixed].concat();
    while p[i] > lowest {
        p[i] = (p[i] - STRIDE).max(lowest);
        let from = p.clone();
        let mut at = refined(p, &fixed);
        if i == 3 && !maximum.one_term() && at.parameters[4] > at.parameters[3] {
            let mut both = from;
            both[4] = both[4].min(both[3]);
            let merged = refined(both, &[3, 4]);
            // apart again, should the data want that
            let mut both = merged.parameters.clone();
            both[4] -= 1.0;
            problem.clamp(&mut both);
            let apart = refined(both, &[3]);
            let admissible = apart.parameters[4] <= apart.parameters[3]
                && apart.score.log_likelihood > merged.score.log_likelihood;
            at = if admissible { apart } else { merged };
        }
        p = at.parameters;
        let drop = drop(maximum, at.score.log_likelihood);
        if drop > BOUND_DROP {
            let share = (BOUND_DROP - before.1) / (drop - before.1);
            let at = before.0 + share.clamp(0.0, 1.0) * (p[i] - before.0);
            return Some(at.exp() / problem.velocity_scale);
        }
        before = (p[i], drop);
    }
    None
}
