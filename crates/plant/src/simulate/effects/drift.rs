//! `drift`: a torque c t, and a random walk with the rms `walk` per root of a second.
//!
//! The walk has knots every [`KNOT`] seconds and runs straight between them: it is continuous, its knots
//! fall on the samples of a 1 kHz log, and the same seed gives the same walk at every step length.

use rand::RngExt;
use rand_distr::StandardNormal;

use super::{BuiltLaw, Effect, InitialCondition, PlantLaw, PlantState};
use crate::simulate::chance::{ChancePurpose, stream_of};
use cft_ident_core::effect::drift::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.01 * site.scale, 0.0],
    build: |site, _, values| {
        BuiltLaw::plant(DriftEffect {
            joint: site.joint(),
            c: values[0],
            walk: values[1],
            knots: Vec::new(),
        })
    },
};

/// Time between two knots of the walk \[s\].
const KNOT: f64 = 0.01;

struct DriftEffect {
    joint: usize,
    c: f64,
    walk: f64,
    /// The walk at 0, KNOT, 2 KNOT...; empty without one.
    knots: Vec<f64>,
}

impl Effect for DriftEffect {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let at = (motion.t / KNOT).max(0.0);
        let (before, share) = (at.floor(), at.fract());
        let knot = |k: usize| self.knots.get(k).or(self.knots.last()).copied();
        let left = knot(before as usize).unwrap_or(0.0);
        let right = knot(before as usize + 1).unwrap_or(0.0);
        torque[self.joint] += self.c * motion.t + left + share * (right - left);
    }

    fn begin(&mut self, beginning: &InitialCondition, _z: &mut [f64]) {
        if self.walk == 0.0 {
            return;
        }
        let mut chance = stream_of(beginning.seed, ChancePurpose::Drift, self.joint);
        let count = (beginning.seconds / KNOT).ceil() as usize + 2;
        let step = self.walk * KNOT.sqrt();
        let mut value = 0.0;
        let knot = |_| {
            let here = value;
            let draw: f64 = chance.sample(StandardNormal);
            value += step * draw;
            here
        };
        self.knots = (0..count).map(knot).collect();
    }
}
