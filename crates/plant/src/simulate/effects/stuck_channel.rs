//! `stuck-channel`: a channel shows its last value from the time `at` on for `seconds`.

use super::{Built, Fault, LoggedChannels, PlantLaw};
use cft_ident_core::effect::stuck_channel::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |_| vec![5.0, 1.0, 1.0],
    build: |site, _, values| {
        Built::log(StuckChannel {
            joint: site.joint(),
            from: values[0],
            to: values[0] + values[1],
            torque: values[2] != 0.0,
        })
    },
};

#[derive(Debug)]
struct StuckChannel {
    joint: usize,
    from: f64,
    to: f64,
    torque: bool,
}

impl Fault for StuckChannel {
    fn apply(&self, log: &mut LoggedChannels) {
        let mut last = None;
        for (t, value) in log.channel(self.joint, self.torque) {
            match last {
                Some(last) if (self.from..self.to).contains(&t) => *value = last,
                _ => last = Some(*value),
            }
        }
    }
}
