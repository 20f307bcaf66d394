//! `torque-offset`: a constant torque, in both directions and at standstill.

use super::{Built, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::torque_offset::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.1 * site.scale],
    build: |site, _, values| {
        Built::plant(TorqueOffset {
            joint: site.joint(),
            c: values[0],
        })
    },
};

#[derive(Debug)]
struct TorqueOffset {
    joint: usize,
    c: f64,
}

impl Effect for TorqueOffset {
    fn torque(&self, _motion: &PlantState, torque: &mut [f64]) {
        torque[self.joint] += self.c;
    }
}
