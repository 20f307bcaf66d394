//! `saturation`: the logged torque of a joint stops at a limit.

use super::{Built, Fault, LoggedChannels, PlantLaw};
use cft_ident_core::effect::saturation::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![site.scale],
    build: |site, _, values| {
        Built::log(Saturation {
            joint: site.joint(),
            limit: values[0],
        })
    },
};

#[derive(Debug)]
struct Saturation {
    joint: usize,
    limit: f64,
}

impl Fault for Saturation {
    fn apply(&self, log: &mut LoggedChannels) {
        for torque in log.torques(self.joint) {
            *torque = torque.clamp(-self.limit, self.limit);
        }
    }
}
