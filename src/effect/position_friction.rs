//! `position-friction`: friction whose width changes with position, sgn(v) (sin, cos at an order):
//! it flips with the direction, a ripple does not (Remark 1 of the report).

use super::ripple::{order_limits, orders, wavenumber};
use super::{Family, Key, Kind, Role, Unit, every_joint, sign};

pub const KIND: Kind = Kind {
    name: "position-friction",
    family: Family::Position,
    role: Role::Columns,
    shape: &[Key::new("order", Unit::Order)],
    linear: &[Key::new("sin", Unit::Torque), Key::new("cos", Unit::Torque)],
    places: every_joint,
    starts: |cover, place| {
        if !cover.at(place).both_ways() {
            return Err("the joint moves in one direction only: move it both ways".into());
        }
        orders(cover, place, &cover.at(place).friction_orders)
    },
    limits: order_limits,
    columns: |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let per_unit = wavenumber(scene.robot, j, shape[0]);
        let motion = scene.stretch.q[j].iter().zip(&scene.stretch.v[j]);
        for (k, (q, v)) in motion.enumerate() {
            let (s, c) = (per_unit * q).sin_cos();
            out[0][k] = sign(*v) * s;
            out[1][k] = sign(*v) * c;
        }
    },
    separate_by: "the same stretch of travel in both directions at one speed",
};
