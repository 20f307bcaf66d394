//! `spring`: k (q - q0) + k3 (q - q0)^3, a cable or a return spring.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::spring::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.3 * site.scale / site.half_travel(), site.middle(), 0.0],
    build: |site, _, values| {
        let (k, rest, cubic) = (values[0], values[1], values[2]);
        BuiltLaw::torque(site, move |m| {
            let x = m.q - rest;
            x * (k + cubic * x * x)
        })
    },
};
