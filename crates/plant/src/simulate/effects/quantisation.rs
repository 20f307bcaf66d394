//! `quantisation`: the logged torque of a joint is rounded to whole steps.

use super::{Built, Fault, LoggedChannels, PlantLaw};
use cft_ident_core::effect::quantisation::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.1 * site.scale],
    build: |site, _, values| {
        Built::log(Quantisation {
            joint: site.joint(),
            step: values[0],
        })
    },
};

#[derive(Debug)]
struct Quantisation {
    joint: usize,
    step: f64,
}

impl Fault for Quantisation {
    fn apply(&self, log: &mut LoggedChannels) {
        for torque in log.torques(self.joint) {
            *torque = (*torque / self.step).round() * self.step;
        }
    }
}
