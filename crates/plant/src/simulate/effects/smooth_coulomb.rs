//! `smooth-coulomb`: friction that does not jump at rest, in the place of the joint's saturating friction.
//!
//! fc tanh(v/vs) stands where F(v) - viscous v stood, which is taken out.

use super::{Built, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::smooth_coulomb::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.1 * site.speed, site.coulomb],
    build: |site, _, values| {
        Built::plant(SmoothCoulomb {
            joint: site.joint(),
            per_speed: 1.0 / values[0],
            level: values[1],
            viscous: site.viscous,
        })
    },
};

#[derive(Debug)]
struct SmoothCoulomb {
    joint: usize,
    /// s/m or s/rad.
    per_speed: f64,
    /// N or N m.
    level: f64,
    /// Of the friction law that stays, N s/m or N m s/rad.
    viscous: f64,
}

impl Effect for SmoothCoulomb {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let v = motion.v[self.joint];
        let own = motion.friction[self.joint] - self.viscous * v;
        torque[self.joint] += self.level * (self.per_speed * v).tanh() - own;
    }
}
