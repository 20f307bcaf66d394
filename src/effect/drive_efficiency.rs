//! `drive-efficiency`: a loss in proportion to the load while the motor drives it, k tau_l H(tau_l v).

use super::{Family, Key, Kind, Role, Unit, every_joint, no_limits};

pub const KIND: Kind = Kind {
    name: "drive-efficiency",
    family: Family::Load,
    role: Role::Columns,
    shape: &[],
    linear: &[Key::new("k", Unit::Text(""))],
    places: every_joint,
    starts: |cover, place| {
        if cover.at(place).both_ways() {
            Ok(vec![Vec::new()])
        } else {
            Err("the joint moves in one direction only: move it both ways".into())
        }
    },
    limits: no_limits,
    columns: |scene, place, _, _, out| {
        let Some(j) = place.joint() else { return };
        for (k, (v, load)) in scene.stretch.v[j].iter().zip(&scene.load[j]).enumerate() {
            if load * v > 0.0 {
                out[0][k] = *load;
            }
        }
    },
    separate_by: "lift and lower a known payload at the same speeds",
};
