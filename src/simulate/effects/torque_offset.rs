//! `torque-offset`: a constant torque, in both directions and at standstill.

use super::{Built, Effect, Key, Kind, Motion, Places, Unit};

pub const KIND: Kind = Kind {
    name: "torque-offset",
    family: "offset",
    places: Places::Joints,
    keys: &[Key::size("c", Unit::Torque, |site| 0.1 * site.scale)],
    build: |site, _, values| {
        Built::plant(TorqueOffset {
            joint: site.joint(),
            c: values[0],
        })
    },
};

#[derive(Debug)]
struct TorqueOffset {
    joint: usize,
    c: f64,
}

impl Effect for TorqueOffset {
    fn torque(&self, _motion: &Motion, torque: &mut [f64]) {
        torque[self.joint] += self.c;
    }
}
