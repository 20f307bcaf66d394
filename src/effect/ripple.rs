//! `ripple`: torque that repeats with position and does not flip with direction. Each harmonic is an
//! effect of its own order.

use super::{Cover, Family, Key, Kind, Place, Role, Starts, Unit, every_joint};
use crate::robot::{JointKind, Robot};

pub const KIND: Kind = Kind {
    name: "ripple",
    family: Family::Position,
    role: Role::Columns,
    shape: &[Key::new("order", Unit::Order)],
    linear: &[Key::new("sin", Unit::Torque), Key::new("cos", Unit::Torque)],
    places: every_joint,
    starts: |cover, place| orders(cover, place, &cover.at(place).ripple_orders),
    limits: order_limits,
    columns: |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let per_unit = wavenumber(scene.robot, j, shape[0]);
        for (k, q) in scene.stretch.q[j].iter().enumerate() {
            let (s, c) = (per_unit * q).sin_cos();
            out[0][k] = s;
            out[1][k] = c;
        }
    },
    separate_by: "the same stretch of travel at two constant speeds: the order stays, the \
                  frequency moves",
};

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
        .filter(|o| **o >= least)
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

/// Orders between what the travel covers and what the position filter lets through.
pub fn order_limits(cover: &Cover, place: Place) -> Vec<[f64; 2]> {
    let travel = cover.travel(place).max(f64::MIN_POSITIVE);
    vec![[LEAST_WAVES / travel, MOST_ORDER]]
}

/// Waves that the travel must cover.
pub const LEAST_WAVES: f64 = 1.5;
/// No order above this is looked for.
const MOST_ORDER: f64 = 1e6;
