//! Orders of what repeats with position: waves per revolution or metre.

use super::cover::Cover;
use super::law::Starts;
use super::place::Place;
use crate::robot::{JointKind, Robot};

/// rad per rad or per metre of an order (1/rev or 1/m).
pub fn wavenumber(robot: &Robot, j: usize, order: f64) -> f64 {
    match robot.joint_kind(j) {
        JointKind::Revolute => order,
        JointKind::Prismatic => std::f64::consts::TAU * order,
    }
}

/// Peaks of the spectrum that the travel covers; what is missing where there are none.
pub fn orders(cover: &Cover, place: Place, peaks: &[f64]) -> Starts {
    let travel = cover.travel(place);
    if travel * MOST_ORDER < LEAST_WAVES {
        return Err("the joint stands still: no order can be seen".into());
    }
    let least = LEAST_WAVES / travel;
    let kept: Vec<Vec<f64>> = peaks
        .iter()
        .filter(|o| **o >= least && is_whole(cover, place, **o))
        .map(|o| vec![*o])
        .collect();
    if kept.is_empty() {
        Err(format!(
            "no order above {least:.3}, below which the travel covers less than {LEAST_WAVES} waves"
        ))
    } else {
        Ok(kept)
    }
}

/// Whether an order can be that of the place: after a full turn a joint is where it was, so that on
/// one which turns further its orders are whole, within half of 1/travel.
pub fn is_whole(cover: &Cover, place: Place, order: f64) -> bool {
    let turns = cover.travel(place);
    let revolute = place
        .joint()
        .is_some_and(|j| cover.kinds[j] == JointKind::Revolute);
    !revolute || turns < FULL_TURNS || (order - order.round()).abs() <= 0.5 / turns
}

/// Turns from which on an order must be whole.
const FULL_TURNS: f64 = 1.5;

/// Orders between what the travel covers and what the position filter lets through.
pub(crate) fn order_limits(cover: &Cover, place: Place) -> Vec<[f64; 2]> {
    let travel = cover.travel(place).max(f64::MIN_POSITIVE);
    vec![[LEAST_WAVES / travel, MOST_ORDER]]
}

/// Waves that the travel must cover.
pub(crate) const LEAST_WAVES: f64 = 1.5;
/// No order above this is looked for.
const MOST_ORDER: f64 = 1e6;
