//! `disturbance`: somebody pushes, a torque c from the time `at` on for `seconds`.
//!
//! The torque jumps in time: the step across an edge is refused by the error control until it is so short
//! that the edge does not show.

use super::{Built, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::disturbance::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![5.0, 0.5, 0.5 * site.scale],
    build: |site, _, values| {
        Built::plant(Disturbance {
            joint: site.joint(),
            from: values[0],
            to: values[0] + values[1],
            c: values[2],
        })
    },
};

#[derive(Debug)]
struct Disturbance {
    joint: usize,
    from: f64,
    to: f64,
    c: f64,
}

impl Effect for Disturbance {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        if (self.from..self.to).contains(&motion.t) {
            torque[self.joint] += self.c;
        }
    }
}
