//! `load-friction`: friction that grows with the load, (mu_c + mu_v |v|) |tau_l| tanh(w v).
//!
//! tau_l = M a + C v + G is the rigid-body torque of the joint, which the acceleration depends on in turn.
//! As the friction is piecewise linear in tau_l, the plant solves tau_l (1 + s) = what is left of the motor's
//! torque in closed form, without iteration ([`super::Effect::load`]).

use super::{BuiltLaw, Effect, PlantLaw, PlantState};
use crate::simulate::SimulateError;
use cft_ident_core::effect::load_friction::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.05, 0.0, site.slope().min(40.0 / site.speed)],
    build: |site, _, values| {
        let most = values[0].abs() + values[1].abs() * 4.0 * site.speed;
        if most >= MAX_LOAD_SHARE {
            let (key, beyond) = (
                "mu_c + mu_v |v|",
                "beyond it the joint locks itself under load",
            );
            let rule = format!("must stay below {MAX_LOAD_SHARE}: {beyond}");
            return Err(SimulateError::number(ENTRY.name, key, most, rule));
        }
        BuiltLaw::plant(LoadFriction {
            joint: site.joint(),
            mu_c: values[0],
            mu_v: values[1],
            slope: values[2],
        })
    },
};

/// Share of the load that friction may take.
const MAX_LOAD_SHARE: f64 = 0.95;

struct LoadFriction {
    joint: usize,
    mu_c: f64,
    mu_v: f64,
    slope: f64,
}

impl Effect for LoadFriction {
    fn load(&self, motion: &PlantState, share: &mut [[f64; 2]]) {
        let v = motion.v[self.joint];
        // Speeds far beyond the joint's own, as a rejected trial step has them, must not turn the balance over.
        let mu = (self.mu_c + self.mu_v * v.abs()).clamp(-MAX_LOAD_SHARE, MAX_LOAD_SHARE);
        let friction = mu * (self.slope * v).tanh();
        let [positive, negative] = &mut share[self.joint];
        *positive += friction;
        *negative -= friction;
    }
}
