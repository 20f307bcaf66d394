//! `warm-up`: the joint's friction times 1 + k (1 - exp(-t/T)), with k < 0 when it falls.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::warm_up::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![-0.2, 20.0],
    build: |site, _, values| {
        let (k, time) = (values[0], values[1]);
        BuiltLaw::torque(site, move |m| -k * (-m.t / time).exp_m1() * m.friction)
    },
};
