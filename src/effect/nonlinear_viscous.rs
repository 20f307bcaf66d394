//! `nonlinear-viscous`: friction that bends with speed, c sgn(v) |v|^p.

use super::{Family, Key, Kind, Role, Unit, every_joint, sign};

pub const KIND: Kind = Kind {
    name: "nonlinear-viscous",
    family: Family::Velocity,
    role: Role::Columns,
    shape: &[Key::new("p", Unit::Text(""))],
    linear: &[Key::new("c", Unit::Text("torque per speed^p"))],
    places: every_joint,
    starts: |cover, place| {
        if cover.at(place).reversals < 2 {
            return Err("fewer than two reversals: friction is not seen in both directions".into());
        }
        Ok([0.35, 0.5, 0.7, 1.6, 2.0, 2.5].map(|p| vec![p]).to_vec())
    },
    // between 0.8 and 1.5 it is viscous friction
    limits: |_, _| vec![[0.3, 3.0]],
    columns: |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        for (x, v) in out[0].iter_mut().zip(&scene.stretch.v[j]) {
            *x = sign(*v) * v.abs().powf(shape[0]);
        }
    },
    separate_by: "plateaus of constant speed, both ways, up to the top speed",
};
