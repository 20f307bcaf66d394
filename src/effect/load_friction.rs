//! `load-friction`: friction that grows with the load, (mu_c + mu_v |v|) |tau_l| tanh(w v)
//! (Hamon, Gautier and Garrec 2010).

use super::{Family, Key, Kind, Role, Unit, every_joint};

pub const KIND: Kind = Kind {
    name: "load-friction",
    family: Family::Load,
    role: Role::Columns,
    shape: &[Key::new("w", Unit::Text("1/speed"))],
    linear: &[
        Key::new("mu_c", Unit::Text("")),
        Key::new("mu_v", Unit::Text("1/speed")),
    ],
    places: every_joint,
    starts: |cover, place| {
        let joint = cover.at(place);
        if joint.reversals < 2 {
            return Err("fewer than two reversals: friction is not seen in both directions".into());
        }
        Ok(vec![
            vec![10.0 / joint.fastest()],
            vec![40.0 / joint.fastest()],
            vec![200.0 / joint.fastest()],
        ])
    },
    limits: |cover, place| {
        let top = cover.at(place).fastest();
        vec![[4.0 / top, 2000.0 / top]]
    },
    columns: |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        for (k, (v, load)) in scene.stretch.v[j].iter().zip(&scene.load[j]).enumerate() {
            let x = load.abs() * (shape[0] * v).tanh();
            out[0][k] = x;
            out[1][k] = v.abs() * x;
        }
    },
    separate_by: "the same path at the same speed with and without a known payload",
};
