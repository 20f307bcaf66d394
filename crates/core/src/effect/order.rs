//! Orders of what repeats with position: waves per revolution or metre.

use super::law::ShapeStarts;
use super::{CodeSite, EffectPlace, Instant, LogCoverage, ShapeSpan, exact};
use crate::robot::{JointKind, Robot};

/// rad per rad or per metre of an order (1/rev or 1/m).
pub(super) fn wavenumber(robot: &Robot, j: usize, order: f64) -> f64 {
    match robot.joint_kind(j) {
        JointKind::Revolute => order,
        JointKind::Prismatic => std::f64::consts::TAU * order,
    }
}

impl Instant<'_> {
    /// Sine and cosine of the joint's position at the order that its shape is.
    pub(super) fn wave(&self) -> (f64, f64) {
        let per_unit = wavenumber(self.scene.robot, self.joint, self.shape[0]);
        (per_unit * self.q()).sin_cos()
    }
}

impl CodeSite<'_> {
    /// Both, each times its coefficient.
    pub(super) fn wave(&self) -> String {
        let wave = wavenumber(&self.model.robot, self.joint(), self.shape[0]);
        let angle = format!("{} * {}", exact(wave), self.q());
        let [sin, cos] = [self.x(0), self.x(1)];
        format!("{sin} * sin({angle}) + {cos} * cos({angle})")
    }
}

/// Peaks of the spectrum that the travel covers; what is missing where there are none.
pub(super) fn orders(cover: &LogCoverage, place: EffectPlace, peaks: &[f64]) -> ShapeStarts {
    let travel = cover.travel(place);
    if travel * MOST_ORDER < LEAST_WAVES {
        return Err("the joint stands still: no order can be seen".into());
    }
    let least = LEAST_WAVES / travel;
    let seen = |o: &&f64| **o >= least && is_whole(cover, place, **o);
    let kept: Vec<Vec<f64>> = peaks.iter().filter(seen).map(|o| vec![*o]).collect();
    if kept.is_empty() {
        return Err(format!(
            "no order above {least:.3}, below which the travel covers less than {LEAST_WAVES} waves"
        ));
    }
    Ok(kept)
}

/// Whether an order can be that of the place: after a full turn a joint is where it was, so that on
/// one which turns further its orders are whole, within half of 1/travel.
pub fn is_whole(cover: &LogCoverage, place: EffectPlace, order: f64) -> bool {
    let turns = cover.travel(place);
    let revolute = |j| cover.kinds[j] == JointKind::Revolute;
    let revolute = place.joint().is_some_and(revolute);
    !revolute || turns < FULL_TURNS || (order - order.round()).abs() <= 0.5 / turns
}

/// Turns from which on an order must be whole.
const FULL_TURNS: f64 = 1.5;

/// Orders between what the travel covers and what the position filter lets through.
pub(super) fn order_limits(cover: &LogCoverage, place: EffectPlace, _: &[f64]) -> Vec<ShapeSpan> {
    let travel = cover.travel(place).max(f64::MIN_POSITIVE);
    vec![ShapeSpan::of(LEAST_WAVES / travel, MOST_ORDER).open_above()]
}

/// Waves that the travel must cover.
const LEAST_WAVES: f64 = 1.5;
/// No order above this is looked for.
const MOST_ORDER: f64 = 1e6;
