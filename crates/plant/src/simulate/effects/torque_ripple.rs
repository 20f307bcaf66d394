//! `torque-ripple`: a motor whose torque per current varies with its position: the log has
//! 1 + sin sin(k q) + cos cos(k q) times the torque that acts, k as in `ripple`.

use super::{BuiltLaw, Effect, PlantLaw, PlantState, ripple};
use cft_ident_core::effect::torque_ripple::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![12.0, 0.05, 0.0],
    build: |site, _, values| {
        BuiltLaw::plant(TorqueRipple {
            joint: site.joint(),
            wavenumber: ripple::wavenumber(site, values[0]),
            size: values[1].hypot(values[2]),
            phase: values[2].atan2(values[1]),
        })
    },
};

struct TorqueRipple {
    joint: usize,
    wavenumber: f64,
    size: f64,
    phase: f64,
}

impl Effect for TorqueRipple {
    fn drive(&self, motion: &PlantState, _logged: &[f64], acting: &mut [f64]) {
        let angle = self.wavenumber * motion.q[self.joint] + self.phase;
        acting[self.joint] /= 1.0 + self.size * angle.sin();
    }
}
