//! Standard deviations of shapes by their profile. The linearised one says how steep the squared error is
//! where it is least; a slope that saturates, or a gap whose reversals come one by one, has a floor that is
//! flat or ragged there, and the linear promise is kept further out only.
//!
//! Where the profile (the least weighted square over all other unknowns, Bates and Watts 1988)
//! rises by less than the linearisation says it does at two standard deviations, the shape's standard
//! deviation becomes half of the distance at which it rises by as much, on the side where that is farther. What
//! goes along with the shape, as the inertia of an elastic drive with its frequency, is then known less well too.

use nalgebra::DMatrix;

use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::unknowns::Unknown;
use crate::math::rank_revealing::RankRevealingInverse;
use crate::motion::MotionError;

/// Standard deviations at which the promise is looked at.
const REACH: f64 = 2.0;
/// Most doublings of the distance.
const DOUBLINGS: usize = 12;

/// First distance from a shape that the linearisation says nothing of, over its value.
const FIRST: f64 = 1e-4;

/// Widens rows and columns of the `wanted` shapes in a covariance of the unknowns; a shape whose derivative is zero where it
/// stands, as that of a gap may be between two samples, gets a variance of its own.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn widen(
    at: &FittedModel,
    problem: &FitProblem,
    wanted: &dyn Fn(&Unknown) -> bool,
    covariance: &mut DMatrix<f64>,
) -> Result<(), MotionError> {
    let least = RankRevealingInverse::of(&at.normal);
    let lowest = at.least_with_fixed(problem, None);
    // how much correlation in time makes of a variance
    let ratio = |i: usize| covariance[(i, i)] / least.matrix()[(i, i)];
    let known = (0..covariance.nrows()).map(ratio);
    let mut known: Vec<f64> = known.filter(|r| r.is_finite()).collect();
    known.sort_by(f64::total_cmp);
    let usual = known.get(known.len() / 2).copied().unwrap_or(1.0);
    // all by the covariance as it came, or two shapes that trade with each other would widen each other
    let before = covariance.clone();
    let mut alone: Vec<(usize, f64)> = Vec::new();
    for (i, unknown) in at.base.unknowns.list.iter().enumerate() {
        let Unknown::Shape { effect, k } = *unknown else {
            continue;
        };
        if !wanted(unknown) {
            continue;
        }
        let added = &at.model.effects[effect];
        let value = added.shape[k];
        let [low, high] = added.law.limits_on(&problem.cover, added.place)[k];
        let std = before[(i, i)].sqrt();
        let linear = std.is_finite() && std > 0.0 && !least.redundant(i);
        let (first, inflation) = match linear {
            true => (REACH * std, before[(i, i)] / least.matrix()[(i, i)]),
            false => (FIRST * value.abs(), usual),
        };
        if !(first > 0.0 && first.is_finite()) {
            continue;
        }
        let promised = REACH * REACH * inflation;
        let risen = |x: f64| -> Result<f64, MotionError> {
            let mut model = at.model.clone();
            model.effects[effect].shape[k] = x;
            let moved = at.with(model, problem)?;
            Ok(moved.least_with_fixed(problem, Some(i)) - lowest)
        };
        let mut farthest = first;
        for side in [-1.0, 1.0] {
            let end = if side < 0.0 {
                value - low
            } else {
                high - value
            };
            farthest = farthest.max(distance(first, end, promised, |d| risen(value + side * d))?);
        }
        if linear {
            widen_one(covariance, &before, i, farthest / first);
        } else if farthest < high - low {
            alone.push((i, (farthest / REACH).powi(2)));
        }
    }
    for (i, variance) in alone {
        covariance.row_mut(i).fill(0.0);
        covariance.column_mut(i).fill(0.0);
        covariance[(i, i)] = variance;
    }
    Ok(())
}

/// Makes one standard deviation larger by a factor of what it was before; what is known of the others with this one
/// given stays as it is.
fn widen_one(covariance: &mut DMatrix<f64>, before: &DMatrix<f64>, i: usize, factor: f64) {
    let column = before.column(i);
    let more = (factor.powi(2) - 1.0) / column[i];
    covariance.ger(more, &column, &column, 1.0);
}

/// Distance at which a function that is 0 at 0 has risen by what was promised at `first`, or the end of the way.
fn distance<E>(
    first: f64,
    end: f64,
    promised: f64,
    risen: impl Fn(f64) -> Result<f64, E>,
) -> Result<f64, E> {
    let (mut before, mut had) = (0.0, 0.0);
    let mut at = first;
    for _ in 0..=DOUBLINGS {
        at = f64::min(at, end);
        if at <= before {
            break;
        }
        let has = risen(at)?;
        if has >= promised {
            let part = (promised - had) / (has - had).max(f64::MIN_POSITIVE);
            return Ok(before + part.clamp(0.0, 1.0) * (at - before));
        }
        (before, had) = (at, has);
        at *= 2.0;
    }
    Ok(before)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use nalgebra::DMatrix;

    use super::{distance, widen_one};

    fn of(first: f64, end: f64, promised: f64, rise: fn(f64) -> f64) -> f64 {
        let Ok(found) = distance(first, end, promised, |d| Ok::<_, Infallible>(rise(d)));
        found
    }

    #[test]
    fn a_square_keeps_its_promise_and_what_is_flatter_is_followed_until_it_does() {
        assert_eq!(of(2.0, 100.0, 4.0, |d| d * d), 2.0);
        // a slope that saturates: 4 is reached at infinity only, 3.9 is at 78
        let flat = of(2.0, 1e6, 3.9, |d| 4.0 * d / (d + 2.0));
        assert!((64.0..128.0).contains(&flat), "{flat}");
        // steps of 3 each, 5 apart: the second is passed at 10
        let ragged = of(0.01, 100.0, 4.0, |d| 3.0 * (d / 5.0).floor());
        assert!((5.0..20.0).contains(&ragged), "{ragged}");
    }

    #[test]
    fn a_wider_shape_takes_its_companions_along_and_leaves_what_is_known_beside_it() {
        #[rustfmt::skip]
        let before = DMatrix::from_row_slice(3, 3, &[
            4.0, 1.0, -0.5,
            1.0, 2.0, 0.3,
            -0.5, 0.3, 1.0,
        ]);
        let mut after = before.clone();
        widen_one(&mut after, &before, 1, 3.0);
        assert!((after[(1, 1)] - 18.0).abs() < 1e-12);
        // of the others with this one given: the Schur complement, and the regression on it
        for a in [0, 2] {
            assert!((after[(a, 1)] / after[(1, 1)] - before[(a, 1)] / 2.0).abs() < 1e-12);
            for b in [0, 2] {
                let given = |c: &DMatrix<f64>| c[(a, b)] - c[(a, 1)] * c[(1, b)] / c[(1, 1)];
                assert!((given(&after) - given(&before)).abs() < 1e-12);
            }
        }
        assert!(after[(0, 0)] > before[(0, 0)]);
    }

    #[test]
    fn the_way_ends_at_the_limit_of_the_shape() {
        assert_eq!(of(2.0, 7.0, 4.0, |_| 0.0), 7.0);
        assert_eq!(of(2.0, 1.5, 4.0, |_| 0.0), 1.5);
        assert_eq!(of(2.0, -1.0, 4.0, |_| 0.0), 0.0);
    }
}
