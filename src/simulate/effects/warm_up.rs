//! `warm-up`: the joint's friction times 1 + k (1 - exp(-t/T)), with k < 0 when it falls.

use super::{Built, Effect, Key, Kind, Motion, Places, Unit};
use crate::simulate::SimulateError;

pub const KIND: Kind = Kind {
    name: "warm-up",
    family: "slow",
    places: Places::Joints,
    keys: &[
        Key::size("k", Unit::Fixed("1"), |_| -0.2),
        Key::shape("T", Unit::Fixed("s"), |_| 20.0),
    ],
    build: |site, _, values| {
        let bad = if values[0] < -1.0 {
            Some((
                "k",
                values[0],
                "must be at least -1, or friction drives the joint",
            ))
        } else if values[1] <= 0.0 {
            Some(("T", values[1], "must be above 0 s"))
        } else {
            None
        };
        if let Some((key, value, rule)) = bad {
            return Err(SimulateError::EffectNumber {
                effect: KIND.name.to_owned(),
                key: key.to_owned(),
                value,
                rule: rule.to_owned(),
            });
        }
        Built::plant(WarmUp {
            joint: site.joint(),
            k: values[0],
            time: values[1],
        })
    },
};

#[derive(Debug)]
struct WarmUp {
    joint: usize,
    k: f64,
    time: f64,
}

impl Effect for WarmUp {
    fn torque(&self, motion: &Motion, torque: &mut [f64]) {
        let change = -self.k * (-motion.t / self.time).exp_m1();
        torque[self.joint] += change * motion.friction[self.joint];
    }
}
