//! What a log says of a slope that it cannot determine: a bound by the profile likelihood.

use super::passes::{Maximum, refine_others, spread};
use super::problem::FrictionProblem;

/// Drop of the log-likelihood at a one-sided 95 % bound: half of 1.645 squared.
const BOUND_DROP: f64 = 1.353;
/// Gauss-Newton steps of the other parameters at each slope.
const GAUSS_NEWTON_STEPS: usize = 8;
/// Step of the slope's logarithm on the way down.
const STRIDE: f64 = 0.25;

/// How much the log-likelihood falls from the maximum to `value`; coloured innovations count for
/// less, as in the covariance.
fn drop(maximum: &Maximum, value: f64) -> f64 {
    (maximum.score.log_likelihood - value) / maximum.widening
}

/// Whether the slope with index `i` (3 or 4) may be as steep as any that is tried, the other
/// parameters fitted anew. A standard deviation does not say so: it knows the curvature at the maximum
/// alone, and a likelihood that rises to a plateau is curved at its edge.
pub(crate) fn open_above(problem: &FrictionProblem, maximum: &Maximum, i: usize) -> bool {
    let mut p = maximum.parameters.clone();
    p[i] = (problem.slope_range.1 * problem.velocity_scale).ln();
    let spread = spread(problem);
    let fixed = [&[i], maximum.fixed].concat();
    let refined = refine_others(
        problem,
        p,
        maximum.noise,
        &spread,
        GAUSS_NEWTON_STEPS,
        &fixed,
    );
    drop(maximum, refined.score.log_likelihood) < BOUND_DROP
}

/// One-sided 95 % lower bound of the slope with index `i` (3 or 4) by its profile likelihood: the
/// slope steps down while everything else is fitted anew. The steeper slope, 3, takes the other
/// with it, which would step into its place. `None` where the whole range is as likely.
pub(crate) fn profile_slope(problem: &FrictionProblem, maximum: &Maximum, i: usize) -> Option<f64> {
    let spread = spread(problem);
    let lowest = (problem.slope_range.0 * problem.velocity_scale).ln();
    let mut p = maximum.parameters.clone();
    let mut before = (p[i], 0.0);
    let fixed = [&[i], maximum.fixed].concat();
    while p[i] > lowest {
        p[i] = (p[i] - STRIDE).max(lowest);
        let from = p.clone();
        let mut refined = refine_others(
            problem,
            p,
            maximum.noise,
            &spread,
            GAUSS_NEWTON_STEPS,
            &fixed,
        );
        if i == 3 && !maximum.one_term() && refined.parameters[4] > refined.parameters[3] {
            let mut both = from;
            both[4] = both[4].min(both[3]);
            let fixed = [3, 4];
            let merged = refine_others(
                problem,
                both.clone(),
                maximum.noise,
                &spread,
                GAUSS_NEWTON_STEPS,
                &fixed,
            );
            // apart again, should the data want that
            both = merged.parameters.clone();
            both[4] -= 1.0;
            problem.clamp(&mut both);
            let apart = refine_others(
                problem,
                both,
                maximum.noise,
                &spread,
                GAUSS_NEWTON_STEPS,
                &[3],
            );
            let admissible = apart.parameters[4] <= apart.parameters[3]
                && apart.score.log_likelihood > merged.score.log_likelihood;
            refined = if admissible { apart } else { merged };
        }
        p = refined.parameters;
        let drop = drop(maximum, refined.score.log_likelihood);
        if drop > BOUND_DROP {
            let share = (BOUND_DROP - before.1) / (drop - before.1);
            let at = before.0 + share.clamp(0.0, 1.0) * (p[i] - before.0);
            return Some(at.exp() / problem.velocity_scale);
        }
        before = (p[i], drop);
    }
    None
}
