//! `gain-change`: a motor whose torque constant changes over time (signal 1) or with its current (signal 2), while the
//! log has the torque that the nominal constant would give.
//!
//! The torque that acts is the logged one over 1 + k (1 - exp(-x/scale)). Where x is the size of the acting torque
//! itself, that is found by Newton's method.

use super::{BuiltLaw, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::gain_change::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![1.0, 20.0, 0.1],
    build: |site, _, values| {
        BuiltLaw::plant(GainChange {
            joint: site.joint(),
            by_time: values[0] < 1.5,
            scale: values[1],
            k: values[2],
        })
    },
};

struct GainChange {
    joint: usize,
    by_time: bool,
    scale: f64,
    k: f64,
}

impl GainChange {
    /// Size of the acting torque under which that size is logged.
    fn acting(&self, logged: f64) -> f64 {
        const MOST_STEPS: usize = 20;
        let mut acting = logged;
        for _ in 0..MOST_STEPS {
            let left = (-acting / self.scale).exp();
            let gain = 1.0 + self.k * (1.0 - left);
            let slope = gain + self.k * left * acting / self.scale;
            let step = (acting * gain - logged) / slope;
            acting = (acting - step).max(0.0);
            if step.abs() <= 1e-14 * logged {
                break;
            }
        }
        acting
    }
}

impl Effect for GainChange {
    fn drive(&self, motion: &PlantState, logged: &[f64], acting: &mut [f64]) {
        let own = logged[self.joint].abs();
        acting[self.joint] *= match self.by_time {
            true => 1.0 / (1.0 + self.k - self.k * (-motion.t / self.scale).exp()),
            false if own > 0.0 => self.acting(own) / own,
            false => 1.0,
        };
    }
}
