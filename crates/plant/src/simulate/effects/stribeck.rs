//! `stribeck`: more friction near standstill, c sgn(v) exp(-(v/vs)^2).

use super::{Built, Effect, PlantLaw, PlantState, sign};
use cft_ident_core::effect::stribeck::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.2 * site.scale, 0.2 * site.speed],
    build: |site, _, values| {
        Built::plant(Stribeck {
            joint: site.joint(),
            c: values[0],
            per_speed: 1.0 / values[1],
            slope: site.slope(),
        })
    },
};

#[derive(Debug)]
struct Stribeck {
    joint: usize,
    c: f64,
    per_speed: f64,
    slope: f64,
}

impl Effect for Stribeck {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let v = motion.v[self.joint];
        let hump = (-(v * self.per_speed).powi(2)).exp();
        torque[self.joint] += self.c * sign(self.slope, v) * hump;
    }
}
