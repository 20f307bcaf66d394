//! `payload` of a serial robot: a ball on the last link, its centre somewhere in that link's frame. All of
//! what a body does to its link would be ten numbers, which few logs tell; mass, centre and one moment of
//! inertia, the same about every axis, are five.
//!
//! Files and tables have first moments in the place of the centre: mx = mass x.

use super::payload::SEPARATE_BY;
use super::{Family, Key, Kind, Place, Role, Unit};
use crate::robot::standard::Body;
use crate::robot::tree::MOST_JOINTS;

/// Distance from the link's origin at which the search begins, along each axis \[m\].
const NEAR: f64 = 0.1;
/// Farthest that a centre is looked for, along each axis \[m\].
const FAR: f64 = 1.0;

pub const KIND: Kind = Kind {
    name: "payload",
    family: Family::Inertia,
    role: Role::Kept,
    shape: &[
        Key::new("x", Unit::Text("m")),
        Key::new("y", Unit::Text("m")),
        Key::new("z", Unit::Text("m")),
    ],
    linear: &[
        Key::new("mass", Unit::Text("kg")),
        Key::new("inertia", Unit::Text("kg m^2")),
    ],
    places: |robot, _| match robot.tool_stays_level() {
        true => Vec::new(),
        false => vec![Place::All],
    },
    starts: |_, _| {
        let corner = |k: usize, axis: usize| if k >> axis & 1 == 0 { NEAR } else { -NEAR };
        let corners = (0..8).map(|k| (0..3).map(|axis| corner(k, axis)).collect());
        Ok(corners.collect())
    },
    limits: |_, _| vec![[-FAR, FAR]; 3],
    columns: |scene, _, centre, joint, out| {
        let [of_mass, of_inertia] = out else { return };
        let &[x, y, z] = centre else { return };
        let point = Body {
            mass: 1.0,
            centre: [x, y, z],
            inertia: [0.0; 6],
        }
        .standard();
        let ball = Body {
            mass: 0.0,
            centre: [0.0; 3],
            inertia: [1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
        }
        .standard();
        let s = scene.stretch;
        let n = scene.robot.joints();
        let mut state = [[0.0; MOST_JOINTS]; 3];
        for k in 0..s.len() {
            let [q, v, a] = state.each_mut().map(|x| &mut x[..n]);
            s.at(k, q, v, a);
            let row = scene.robot.tool_row(joint, q, v, a);
            let of = |body: &[f64]| row.iter().zip(body).map(|(y, x)| y * x).sum();
            of_mass[k] = of(&point);
            of_inertia[k] = of(&ball);
        }
    },
    separate_by: SEPARATE_BY,
};
