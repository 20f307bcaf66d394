//! Step control of a Gauss-Newton descent: how far to trust the linear model from step to step.
//!
//! A damping goes with every step that is tried (Levenberg 1944, Marquardt 1963): it grows where a step is rejected and
//! falls where it is accepted.

use schemars::JsonSchema;
use serde::Serialize;

/// How an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Ending")]
pub enum IterationEnding {
    /// The last step moved nothing that matters, or none is short enough to be of use.
    Converged,
    /// The steps are used up; the last one's result stands.
    IterationLimit,
    /// There is no next step.
    Diverged,
}

/// Damping of the first step.
const START: f64 = 1e-3;

/// What becomes of the damping, which begins at a thousandth.
#[derive(Debug, Clone, Copy)]
pub struct StepControl {
    /// Divisor after a step that was accepted, and factor after one that was rejected.
    pub accepted: f64,
    pub rejected: f64,
    /// An accepted step leaves it in here; a step that is rejected at the end of it was the last.
    pub range: [f64; 2],
    /// It counts as no less than this where a step is rejected.
    pub rejected_from: f64,
}

impl StepControl {
    /// Damping that falls and grows by these factors within a range.
    pub const fn damping(accepted: f64, rejected: f64, range: [f64; 2]) -> Self {
        StepControl {
            accepted,
            rejected,
            range,
            rejected_from: 0.0,
        }
    }
}

/// What became of a step that was tried.
pub enum Trial<S> {
    /// On from here.
    Accepted(S),
    /// The same, and further steps would bring nothing.
    Last(S),
    /// It is worse: a shorter one.
    Rejected,
    /// The point before is as good as any.
    Settled,
    /// There is no step from here.
    NoStep,
}

/// What is made of a point and the damping.
pub type DescentStep<'a, S, E> = dyn FnMut(&S, f64) -> Result<Trial<S>, E> + 'a;

/// Descends from `start` by at most so many tried steps: `step` gets the present point and the damping. The point at the end, how it ended, and the steps that were tried.
pub fn descend<S, E>(
    start: S,
    control: &StepControl,
    most: usize,
    step: &mut DescentStep<S, E>,
) -> Result<(S, IterationEnding, usize), E> {
    let (mut at, mut damping) = (start, START);
    let [least, greatest] = control.range;
    for tried in 1..=most {
        match step(&at, damping)? {
            Trial::Accepted(next) => {
                at = next;
                damping = (damping / control.accepted).clamp(least, greatest);
            }
            Trial::Rejected if damping >= greatest => {
                return Ok((at, IterationEnding::Converged, tried));
            }
            Trial::Rejected => damping = damping.max(control.rejected_from) * control.rejected,
            Trial::Last(next) => return Ok((next, IterationEnding::Converged, tried)),
            Trial::Settled => return Ok((at, IterationEnding::Converged, tried)),
            Trial::NoStep => return Ok((at, IterationEnding::Diverged, tried)),
        }
    }
    Ok((at, IterationEnding::IterationLimit, most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    const DAMPING: StepControl = StepControl::damping(10.0, 10.0, [1e-9, 1e6]);

    /// The least of ln(1 + x^2), whose Gauss-Newton step overshoots where it is not damped.
    fn lowest(most: usize) -> (f64, IterationEnding, usize) {
        let cost = |x: f64| (1.0 + x * x).ln();
        let Ok(found) = descend(40.0, &DAMPING, most, &mut |x: &f64, damping: f64| {
            let (slope, curvature) = (2.0 * x / (1.0 + x * x), 2.0 / (1.0 + x * x).powi(2));
            let next = x - slope / (curvature * (1.0 + damping));
            Ok::<_, Infallible>(match cost(*x) - cost(next) {
                gain if gain > 1e-12 => Trial::Accepted(next),
                gain if gain >= 0.0 => Trial::Last(next),
                _ => Trial::Rejected,
            })
        });
        found
    }

    #[test]
    fn damped_steps_come_down_where_whole_ones_overshoot() {
        let (x, ending, tried) = lowest(200);
        assert_eq!(ending, IterationEnding::Converged);
        assert!(x.abs() < 1e-5 && tried < 150, "{x} after {tried}");
        assert_eq!(lowest(3).1, IterationEnding::IterationLimit);
    }

    #[test]
    fn a_step_that_is_never_accepted_is_tried_over_the_whole_range() {
        let control = StepControl {
            rejected_from: 10.0,
            ..DAMPING
        };
        let mut tries = Vec::new();
        let Ok((_, ending, tried)) = descend((), &control, 99, &mut |(), damping| {
            tries.push(damping);
            Ok::<_, Infallible>(Trial::Rejected)
        });
        // 1e-3, then 1e2 to 1e6
        assert_eq!(
            (ending, tried, tries.len()),
            (IterationEnding::Converged, 6, 6)
        );
        assert!(
            tries
                .iter()
                .zip([1e-3, 1e2, 1e3, 1e4, 1e5, 1e6])
                .all(|(a, b)| (a / b - 1.0).abs() < 1e-12)
        );
    }
}
