//! `asymmetric-friction`: Coulomb and viscous friction that the positive direction has beyond the negative.
//!
//! E(v) = (coulomb + viscous v) H(v), with H a step as steep as the joint allows.

use super::{BuiltLaw, PlantLaw, step};
use cft_ident_core::effect::asymmetric_friction::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.1 * site.scale, 0.1 * site.scale / site.speed],
    build: |site, _, values| {
        let (coulomb, viscous, slope) = (values[0], values[1], site.slope());
        BuiltLaw::torque(site, move |m| (coulomb + viscous * m.v) * step(slope, m.v))
    },
};
