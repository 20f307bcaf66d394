//! `drive-efficiency`: a drive that loses part of the load's power, but only while it drives the load.
//!
//! E = k tau_l H(tau_l v) with tau_l = M a + C v + G, solved with the balance as in `load-friction`; the step
//! is as steep in v as the joint allows and exact in tau_l, where the torque is continuous.

use super::{BuiltLaw, Effect, PlantLaw, PlantState, step};
use cft_ident_core::effect::drive_efficiency::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![0.1],
    build: |site, _, values| {
        BuiltLaw::plant(DriveEfficiency {
            joint: site.joint(),
            k: values[0],
            slope: site.slope(),
        })
    },
};

struct DriveEfficiency {
    joint: usize,
    k: f64,
    slope: f64,
}

impl Effect for DriveEfficiency {
    fn load(&self, motion: &PlantState, share: &mut [[f64; 2]]) {
        let forward = step(self.slope, motion.v[self.joint]);
        let [positive, negative] = &mut share[self.joint];
        *positive += self.k * forward;
        *negative += self.k * (1.0 - forward);
    }
}
