//! `saturation`: the logged torque of a joint stops at a limit.

use super::{Built, Fault, Key, Kind, Log, Places, Unit};
use crate::simulate::SimulateError;

pub const KIND: Kind = Kind {
    name: "saturation",
    family: "data",
    places: Places::Joints,
    keys: &[Key::size("limit", Unit::Torque, |site| site.scale)],
    build: |site, _, values| {
        if values[0] <= 0.0 {
            return Err(SimulateError::EffectNumber {
                effect: KIND.name.to_owned(),
                key: "limit".to_owned(),
                value: values[0],
                rule: "must be above 0".to_owned(),
            });
        }
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
    fn apply(&self, log: &mut Log) {
        for torque in log.torques(self.joint) {
            *torque = torque.clamp(-self.limit, self.limit);
        }
    }
}
