//! `presliding`: below breakaway friction is a spring that yields (Dahl 1968; LuGre, Canudas de Wit
//! et al. 1995). In place of the declared law's saturating part S(v) stands fc h, with
//! dh/dt = rate (v - |v| h) and h in -1..1, and its rate of change damps: sigma1 dh/dt / rate.
//! sigma0 = fc rate.

use super::{Family, Key, Kind, Role, Unit, every_joint};
use crate::robot::model::JointFriction;

pub const KIND: Kind = Kind {
    name: "presliding",
    family: Family::Memory,
    role: Role::Columns,
    shape: &[Key::new("rate", Unit::Text("1/position"))],
    linear: &[
        Key::new("fc", Unit::Torque),
        Key::new("sigma1", Unit::Viscous),
    ],
    places: every_joint,
    starts: |cover, place| {
        let joint = cover.at(place);
        if joint.reversals < 4 {
            return Err("fewer than four reversals".into());
        }
        let shares = [0.001, 0.003, 0.01, 0.02, 0.05, 0.1];
        Ok(shares.map(|s| vec![1.0 / (s * joint.range())]).to_vec())
    },
    limits: |cover, place| {
        let range = cover.at(place).range();
        vec![[3.0 / range, 1e4 / range]]
    },
    columns: |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let s = scene.stretch;
        let rate = shape[0];
        let mut h = 0.0;
        let [friction, damping] = out else { return };
        for (k, (friction, damping)) in friction.iter_mut().zip(damping).enumerate() {
            let v = s.v[j][k];
            // exact over one step of constant speed: h -> sgn(v) with exp(-rate |v| dt)
            let target = super::sign(v);
            let decay = (-rate * v.abs() * s.dt).exp();
            let next = target + (h - target) * decay;
            let middle = 0.5 * (h + next);
            *friction = middle - saturating(&scene.laws[j], v);
            *damping = (next - h) / (s.dt * rate);
            h = next;
        }
    },
    separate_by: "slow reversals with a ladder of amplitudes below and above breakaway",
};

/// Saturating part of a law over its height, -1..1.
fn saturating(law: &JointFriction, v: f64) -> f64 {
    match law {
        JointFriction::None => 0.0,
        JointFriction::ViscousCoulomb(_) => super::sign(v),
        JointFriction::DoubleTanh(law) => {
            let height = law.coulomb_1 + law.coulomb_2;
            if height.abs() > 1e-12 {
                (law.torque(v) - law.viscous * v) / height
            } else {
                super::sign(v)
            }
        }
    }
}
