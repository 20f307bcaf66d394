//! `gain`: a wrong torque constant or gear, so that the logged torque is (1 + k) times the acting one.

use super::{Built, Effect, Key, Kind, Places, Unit};
use crate::simulate::SimulateError;

pub const KIND: Kind = Kind {
    name: "gain",
    family: "load",
    places: Places::Joints,
    keys: &[Key::size("k", Unit::Fixed("1"), |_| 0.1)],
    build: |site, _, values| {
        if !(-0.9..=9.0).contains(&values[0]) {
            return Err(SimulateError::EffectNumber {
                effect: KIND.name.to_owned(),
                key: "k".to_owned(),
                value: values[0],
                rule: "must lie in -0.9..9".to_owned(),
            });
        }
        Built::plant(Gain {
            joint: site.joint(),
            acting: 1.0 / (1.0 + values[0]),
        })
    },
};

#[derive(Debug)]
struct Gain {
    joint: usize,
    acting: f64,
}

impl Effect for Gain {
    fn drive(&self, acting: &mut [f64]) {
        acting[self.joint] *= self.acting;
    }
}
