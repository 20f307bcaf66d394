//! Step control of a Gauss-Newton descent: how far to trust the linear model from step to step.
//!
//! A control number goes with every step that is tried: the damping of Levenberg (1944) and Marquardt
//! (1963), which grows where a step is rejected and falls where it is accepted, or the part of the step
//! that is taken, which is halved until the step is accepted.

use schemars::JsonSchema;
use serde::Serialize;

/// How an iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// The last step moved nothing that matters, or none is short enough to be of use.
    Converged,
    /// The steps are used up; the last one's result stands.
    IterationLimit,
    /// There is no next step.
    Diverged,
}

/// What the control number begins at, and what becomes of it.
#[derive(Debug, Clone, Copy)]
pub struct StepControl {
    pub start: f64,
    /// Divisor after a step that was accepted, and factor after one that was rejected.
    pub accepted: f64,
    pub rejected: f64,
    /// An accepted step leaves it in here; a step that is rejected at the end of it was the last.
    pub range: [f64; 2],
    /// It counts as no less than this where a step is rejected.
    pub rejected_from: f64,
}

impl StepControl {
    /// Damping that begins at a thousandth, and by what it falls and grows within a range.
    pub const fn damping(accepted: f64, rejected: f64, range: [f64; 2]) -> Self {
        StepControl {
            start: 1e-3,
            accepted,
            rejected,
            range,
            rejected_from: 0.0,
        }
    }

    /// The whole step, then halves of it, so many lengths in all; anew after each accepted step.
    pub const fn halving(lengths: u32) -> Self {
        StepControl {
            start: 1.0,
            accepted: 0.0,
            rejected: 0.5,
            range: [1.0 / (1u64 << (lengths - 1)) as f64, 1.0],
            rejected_from: 0.0,
        }
    }

    fn after_rejection(&self, control: f64) -> Option<f64> {
        let spent = match self.rejected > 1.0 {
            true => control >= self.range[1],
            false => control <= self.range[0],
        };
        (!spent).then(|| control.max(self.rejected_from) * self.rejected)
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

/// What is made of a point and the control number.
pub type DescentStep<'a, S, E> = dyn FnMut(&S, f64) -> Result<Trial<S>, E> + 'a;

/// Descends from `start` by at most so many tried steps: `step` gets the present point and the control
/// number. The point at the end, how it ended, and the steps that were tried.
pub fn descend<S, E>(
    start: S,
    control: &StepControl,
    most: usize,
    step: &mut DescentStep<S, E>,
) -> Result<(S, Ending, usize), E> {
    let (mut at, mut number) = (start, control.start);
    for tried in 1..=most {
        match step(&at, number)? {
            Trial::Accepted(next) => {
                at = next;
                number = (number / control.accepted).clamp(control.range[0], control.range[1]);
            }
            Trial::Rejected => match control.after_rejection(number) {
                Some(shorter) => number = shorter,
                None => return Ok((at, Ending::Converged, tried)),
            },
            Trial::Last(next) => return Ok((next, Ending::Converged, tried)),
            Trial::Settled => return Ok((at, Ending::Converged, tried)),
            Trial::NoStep => return Ok((at, Ending::Diverged, tried)),
        }
    }
    Ok((at, Ending::IterationLimit, most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    const DAMPING: StepControl = StepControl::damping(10.0, 10.0, [1e-9, 1e6]);

    /// The least of ln(1 + x^2), whose Newton step from far away goes the wrong way and whose
    /// Gauss-Newton step overshoots, damped.
    fn lowest(control: &StepControl, halves: bool, most: usize) -> (f64, Ending, usize) {
        let cost = |x: f64| (1.0 + x * x).ln();
        let found = descend(40.0, control, most, &mut |x: &f64, number: f64| {
            let (slope, curvature) = (2.0 * x / (1.0 + x * x), 2.0 / (1.0 + x * x).powi(2));
            let step = match halves {
                true => -number * slope / curvature,
                false => -slope / (curvature * (1.0 + number)),
            };
            let next = x + step;
            Ok::<_, Infallible>(match cost(*x) - cost(next) {
                gain if gain > 1e-12 => Trial::Accepted(next),
                gain if gain >= 0.0 => Trial::Last(next),
                _ => Trial::Rejected,
            })
        });
        let Ok(found) = found;
        found
    }

    #[test]
    fn damped_and_halved_steps_come_down_where_whole_ones_overshoot() {
        for (control, halves) in [(DAMPING, false), (StepControl::halving(20), true)] {
            let (x, ending, tried) = lowest(&control, halves, 200);
            assert_eq!(ending, Ending::Converged);
            assert!(x.abs() < 1e-5 && tried < 150, "{x} after {tried}");
        }
        assert_eq!(lowest(&DAMPING, false, 3).1, Ending::IterationLimit);
    }

    #[test]
    fn a_step_that_is_never_accepted_is_tried_over_the_whole_range() {
        let tries = |control: &StepControl| {
            let mut numbers = Vec::new();
            let Ok((_, ending, tried)) = descend((), control, 99, &mut |(), number| {
                numbers.push(number);
                Ok::<_, Infallible>(Trial::Rejected)
            });
            assert_eq!((ending, tried), (Ending::Converged, numbers.len()));
            numbers
        };
        assert_eq!(tries(&StepControl::halving(4)), [1.0, 0.5, 0.25, 0.125]);
        let raised = StepControl {
            rejected_from: 10.0,
            ..DAMPING
        };
        // 1e-3, then 1e2 to 1e6
        assert_eq!(tries(&raised).len(), 6);
    }
}
