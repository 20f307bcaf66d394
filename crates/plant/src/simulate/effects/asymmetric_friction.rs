//! `asymmetric-friction`: Coulomb and viscous friction that the positive direction has beyond the negative.
//!
//! E(v) = (coulomb + viscous v) H(v), with H a step as steep as the joint allows.

use super::{Built, Effect, PlantLaw, PlantState, step};
use cft_ident_core::effect::asymmetric_friction::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.1 * site.scale, 0.1 * site.scale / site.speed],
    build: |site, _, values| {
        Built::plant(AsymmetricFriction {
            joint: site.joint(),
            coulomb: values[0],
            viscous: values[1],
            slope: site.slope(),
        })
    },
};

#[derive(Debug)]
struct AsymmetricFriction {
    joint: usize,
    coulomb: f64,
    viscous: f64,
    slope: f64,
}

impl Effect for AsymmetricFriction {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let v = motion.v[self.joint];
        torque[self.joint] += (self.coulomb + self.viscous * v) * step(self.slope, v);
    }
}
