//! One axis for tests: its model, and a motion that it makes.

use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::Stretch;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::robot::{JointKind, Robot};

pub fn model(inertia: f64, friction: JointFriction) -> AugmentedModel {
    AugmentedModel::plain(Model {
        robot: Robot::single_joint("q1", JointKind::Revolute),
        theta: vec![inertia],
        friction: vec![friction],
        offset: vec![0.0],
    })
}

pub fn inertia(inertia: f64) -> AugmentedModel {
    model(inertia, JointFriction::None)
}

/// An inertia of 0.2 on a sine.
pub fn sine(dt: f64, steps: usize) -> Stretch {
    let t: Vec<f64> = (0..=steps).map(|k| k as f64 * dt).collect();
    let of = |f: fn(f64) -> f64| vec![t.iter().map(|t| f(*t)).collect::<Vec<f64>>()];
    Stretch {
        dt,
        q: of(|t| (3.0 * t).sin()),
        v: of(|t| 3.0 * (3.0 * t).cos()),
        a: of(|t| -9.0 * (3.0 * t).sin()),
        tau: of(|t| -1.8 * (3.0 * t).sin()),
        t,
        ..Stretch::default()
    }
}
