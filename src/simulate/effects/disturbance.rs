//! `disturbance`: somebody pushes, a torque c from the time `at` on for `seconds`.
//!
//! The torque jumps in time: the step across an edge is refused by the error control until it is so short
//! that the edge does not show.

use super::{Built, Effect, Key, Kind, Motion, Places, Unit};
use crate::simulate::SimulateError;

pub const KIND: Kind = Kind {
    name: "disturbance",
    family: "event",
    places: Places::Joints,
    keys: &[
        Key::shape("at", Unit::Fixed("s"), |_| 5.0),
        Key::shape("seconds", Unit::Fixed("s"), |_| 0.5),
        Key::size("c", Unit::Torque, |site| 0.5 * site.scale),
    ],
    build: |site, _, values| {
        if values[1] <= 0.0 {
            return Err(SimulateError::EffectNumber {
                effect: KIND.name.to_owned(),
                key: "seconds".to_owned(),
                value: values[1],
                rule: "must be above 0 s".to_owned(),
            });
        }
        Built::plant(Disturbance {
            joint: site.joint(),
            from: values[0],
            to: values[0] + values[1],
            c: values[2],
        })
    },
};

#[derive(Debug)]
struct Disturbance {
    joint: usize,
    from: f64,
    to: f64,
    c: f64,
}

impl Effect for Disturbance {
    fn torque(&self, motion: &Motion, torque: &mut [f64]) {
        if (self.from..self.to).contains(&motion.t) {
            torque[self.joint] += self.c;
        }
    }
}
