//! `gain`: torque constant or gear off by a factor, k tau on one joint. A fit that was free while
//! carrying it absorbs it: it is looked for only with the model held.

use super::{Family, Key, Kind, Role, Unit, every_joint, no_limits, no_shape};

pub const KIND: Kind = Kind {
    name: "gain",
    family: Family::Load,
    role: Role::Kept,
    shape: &[],
    linear: &[Key::new("k", Unit::Text(""))],
    places: every_joint,
    starts: no_shape,
    limits: no_limits,
    columns: |scene, place, _, _, out| {
        let Some(j) = place.joint() else { return };
        out[0].copy_from_slice(&scene.hat[j]);
    },
    separate_by: "a known payload, the model held by --keep",
};
