//! `warm-up`: the joint's friction times 1 + k (1 - exp(-t/T)), with k < 0 when it falls.

use super::{Built, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::warm_up::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![-0.2, 20.0],
    build: |site, _, values| {
        Built::plant(WarmUp {
            joint: site.joint(),
            k: values[0],
            time: values[1],
        })
    },
};

#[derive(Debug)]
struct WarmUp {
    joint: usize,
    k: f64,
    time: f64,
}

impl Effect for WarmUp {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let change = -self.k * (-motion.t / self.time).exp_m1();
        torque[self.joint] += change * motion.friction[self.joint];
    }
}
