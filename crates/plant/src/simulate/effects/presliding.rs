//! `presliding`: bristles that bend before they slip, in the place of the joint's Coulomb friction.
//!
//! dz/dt = v - sigma0 |v| z/Fc, torque sigma0 z + sigma1 dz/dt (Dahl 1968; Canudas de Wit et al. 1995 with a
//! constant level), where the level Fc is `fc`, by default that of the joint's law at speed. The law's own Coulomb part
//! F(v) - viscous v is taken out. The state is integrated with the plant; |v| has a kink and no jump.

use super::{BuiltLaw, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::presliding::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| {
        let (level, bend) = (site.coulomb, bend(site.turns));
        vec![level / bend, 0.002 * level / bend, level]
    },
    build: |site, _, values| {
        let level = values[2];
        if level <= 0.0 {
            return Err(site.refuse(
                ENTRY.name,
                "it takes the place of Coulomb friction, and this joint's law has none at speed; give the \
                 level fc above 0",
            ));
        }
        BuiltLaw::plant(PreslidingEffect {
            joint: site.joint(),
            sigma0: values[0],
            sigma1: values[1],
            per_level: values[0] / level,
            viscous: site.viscous,
        })
    },
};

/// Default distance over which the bristles bend, m or rad.
const fn bend(turns: bool) -> f64 {
    if turns { 1e-3 } else { 1e-4 }
}

/// A bristle between the surfaces of a joint, which bends before they slide.
struct PreslidingEffect {
    joint: usize,
    sigma0: f64,
    sigma1: f64,
    /// sigma0/Fc, 1/m or 1/rad.
    per_level: f64,
    viscous: f64,
}

impl PreslidingEffect {
    fn bending(&self, motion: &PlantState) -> f64 {
        let v = motion.v[self.joint];
        let z = motion.z.first().copied().unwrap_or(0.0);
        v - self.per_level * v.abs() * z
    }
}

impl Effect for PreslidingEffect {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let z = motion.z.first().copied().unwrap_or(0.0);
        let bristles = self.sigma0 * z + self.sigma1 * self.bending(motion);
        let own = motion.friction[self.joint] - self.viscous * motion.v[self.joint];
        torque[self.joint] += bristles - own;
    }

    fn states(&self) -> usize {
        1
    }

    fn rates(&self, motion: &PlantState, dz: &mut [f64]) {
        if let Some(dz) = dz.first_mut() {
            *dz = self.bending(motion);
        }
    }
}
