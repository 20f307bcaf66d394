//! `torque-offset`: a constant torque, in both directions and at standstill.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::torque_offset::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.1 * site.scale],
    build: |site, _, values| {
        let c = values[0];
        BuiltLaw::torque(site, move |_| c)
    },
};
