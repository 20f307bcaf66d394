//! `torque-offset`: a constant torque, in both directions and at standstill.

use super::{Effect, Key, Kind, Motion};

pub const KIND: Kind = Kind {
    name: "torque-offset",
    family: "offset",
    keys: &[Key {
        name: "c",
        unit: "torque",
        default: |site| 0.1 * site.scale,
    }],
    build: |site, values| {
        Box::new(TorqueOffset {
            joint: site.joint,
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
