//! `spring`: k (q - q0) + k3 (q - q0)^3, a cable or a return spring.

use super::{Built, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::spring::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.3 * site.scale / site.half_travel(), site.middle(), 0.0],
    build: |site, _, values| {
        Built::plant(Spring {
            joint: site.joint(),
            k: values[0],
            rest: values[1],
            cubic: values[2],
        })
    },
};

#[derive(Debug)]
struct Spring {
    joint: usize,
    k: f64,
    rest: f64,
    cubic: f64,
}

impl Effect for Spring {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let x = motion.q[self.joint] - self.rest;
        torque[self.joint] += x * (self.k + self.cubic * x * x);
    }
}
