//! `spring`: k (q - q0) + k3 (q - q0)^3.

use super::{Family, Key, Kind, Role, Unit, every_joint};

pub const KIND: Kind = Kind {
    name: "spring",
    family: Family::Position,
    role: Role::Columns,
    shape: &[Key::new("q0", Unit::Position)],
    linear: &[Key::new("k", Unit::Stiffness), Key::new("k3", Unit::Cubic)],
    places: every_joint,
    starts: |cover, place| {
        let joint = cover.at(place);
        joint.is_wide()?;
        if joint.reversals < 2 {
            return Err("fewer than two reversals: a slope over position is not seen".into());
        }
        let [low, high] = joint.position;
        let step = 0.25 * (high - low);
        Ok((-1..=5).map(|i| vec![low + f64::from(i) * step]).collect())
    },
    limits: |cover, place| {
        let [low, high] = cover.at(place).position;
        // a spring that is at rest far outside the travel is hardly more than an offset
        let beyond = 0.25 * (high - low);
        vec![[low - beyond, high + beyond]]
    },
    columns: |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        for (k, q) in scene.stretch.q[j].iter().enumerate() {
            let x = q - shape[0];
            out[0][k] = x;
            out[1][k] = x * x * x;
        }
    },
    separate_by: "a slow sweep over the whole travel with two payloads: gravity scales, a spring \
                  does not",
};
