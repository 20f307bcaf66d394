//! `position-friction`: friction whose level varies with position, and flips with the direction.
//!
//! E = sgn(v) (sin sin(k q) + cos cos(k q)), k as in `ripple`, the sign as steep as the joint allows.

use super::{Built, Effect, PlantLaw, PlantState, ripple, sign};
use cft_ident_core::effect::position_friction::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| {
        let order = if site.turns { 2.0 } else { 4.0 };
        vec![order, 0.1 * site.scale, 0.0]
    },
    build: |site, _, values| {
        Built::plant(PositionFriction {
            joint: site.joint(),
            wavenumber: ripple::wavenumber(site, values[0]),
            sin: values[1],
            cos: values[2],
            slope: site.slope(),
        })
    },
};

#[derive(Debug)]
struct PositionFriction {
    joint: usize,
    /// rad per m or per rad.
    wavenumber: f64,
    sin: f64,
    cos: f64,
    slope: f64,
}

impl Effect for PositionFriction {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let (s, c) = (self.wavenumber * motion.q[self.joint]).sin_cos();
        let direction = sign(self.slope, motion.v[self.joint]);
        torque[self.joint] += direction * (self.sin * s + self.cos * c);
    }
}
