//! `gain`: a wrong torque constant or gear, so that the logged torque is (1 + k) times the acting one.

use super::{BuiltLaw, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::gain::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![0.1],
    build: |site, _, values| {
        BuiltLaw::plant(Gain {
            joint: site.joint(),
            acting: 1.0 / (1.0 + values[0]),
        })
    },
};

struct Gain {
    joint: usize,
    acting: f64,
}

impl Effect for Gain {
    fn drive(&self, _motion: &PlantState, _logged: &[f64], acting: &mut [f64]) {
        acting[self.joint] *= self.acting;
    }
}
