//! `quantisation`: the logged torque of a joint is rounded to whole steps.

use super::{Built, Fault, Key, Kind, Log, Places, Unit};
use crate::simulate::SimulateError;

pub const KIND: Kind = Kind {
    name: "quantisation",
    family: "data",
    places: Places::Joints,
    keys: &[Key::size("step", Unit::Torque, |site| 0.1 * site.scale)],
    build: |site, _, values| {
        if values[0] <= 0.0 {
            return Err(SimulateError::EffectNumber {
                effect: KIND.name.to_owned(),
                key: "step".to_owned(),
                value: values[0],
                rule: "must be above 0".to_owned(),
            });
        }
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
    fn apply(&self, log: &mut Log) {
        for torque in log.torques(self.joint) {
            *torque = (*torque / self.step).round() * self.step;
        }
    }
}
