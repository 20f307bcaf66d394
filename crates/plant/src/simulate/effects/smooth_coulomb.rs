//! `smooth-coulomb`: friction that does not jump at rest, in the place of the joint's saturating friction.
//!
//! fc tanh(v/vs) stands where F(v) - viscous v stood, which is taken out.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::smooth_coulomb::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.1 * site.speed, site.coulomb],
    build: |site, _, values| {
        // the viscous friction is that of the law that stays
        let (per_speed, level, viscous) = (1.0 / values[0], values[1], site.viscous);
        BuiltLaw::torque(site, move |m| {
            level * (per_speed * m.v).tanh() - (m.friction - viscous * m.v)
        })
    },
};
