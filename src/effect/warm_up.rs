//! `warm-up`: friction times 1 + k (1 - exp(-t/T)), t since the begin of the log.

use super::{Family, Key, Kind, Role, Unit, every_joint};

pub const KIND: Kind = Kind {
    name: "warm-up",
    family: Family::Slow,
    role: Role::Columns,
    shape: &[Key::new("T", Unit::Text("s"))],
    linear: &[Key::new("k", Unit::Text(""))],
    places: every_joint,
    starts: |cover, place| {
        if cover.at(place).reversals < 4 {
            return Err("fewer than four reversals: friction is not seen early and late".into());
        }
        Ok([0.1, 0.3, 1.0, 3.0]
            .map(|s| vec![s * cover.duration_s])
            .to_vec())
    },
    limits: |cover, _| vec![[0.03 * cover.duration_s, 10.0 * cover.duration_s]],
    columns: |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let s = scene.stretch;
        for (k, v) in s.v[j].iter().enumerate() {
            let t = s.began + s.dt * k as f64;
            out[0][k] = scene.laws[j].torque(*v) * -(-t / shape[0]).exp_m1();
        }
    },
    separate_by: "the same segment of motion at the begin and at the end of an hour",
};
