//! `asymmetric-friction`: more friction in one direction, (coulomb + viscous v) H(v).

use super::{Family, Key, Kind, Role, Unit, every_joint, no_limits};

pub const KIND: Kind = Kind {
    name: "asymmetric-friction",
    family: Family::Velocity,
    role: Role::Columns,
    shape: &[],
    linear: &[
        Key::new("coulomb", Unit::Torque),
        Key::new("viscous", Unit::Viscous),
    ],
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
        for (k, v) in scene.stretch.v[j].iter().enumerate() {
            // half at standstill, where neither direction has it
            let forward = if *v > 0.0 {
                1.0
            } else if *v < 0.0 {
                0.0
            } else {
                0.5
            };
            out[0][k] = forward;
            out[1][k] = forward * v;
        }
    },
    separate_by: "move the joint both ways at three or more constant speeds and hold it still \
                  between them: an offset holds at standstill, friction does not",
};
