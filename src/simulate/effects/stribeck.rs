//! `stribeck`: more friction near standstill, c sgn(v) exp(-(v/vs)^2).

use super::{Built, Effect, Key, Kind, Motion, Places, Unit, sign};
use crate::simulate::SimulateError;

pub const KIND: Kind = Kind {
    name: "stribeck",
    family: "velocity",
    places: Places::Joints,
    keys: &[
        Key::size("c", Unit::Torque, |site| 0.2 * site.scale),
        Key::shape("vs", Unit::Speed, |site| 0.2 * site.speed),
    ],
    build: |site, _, values| {
        if values[1] <= 0.0 {
            return Err(SimulateError::EffectNumber {
                effect: KIND.name.to_owned(),
                key: "vs".to_owned(),
                value: values[1],
                rule: "must be above 0".to_owned(),
            });
        }
        Built::plant(Stribeck {
            joint: site.joint(),
            c: values[0],
            per_speed: 1.0 / values[1],
            slope: site.slope(),
        })
    },
};

#[derive(Debug)]
struct Stribeck {
    joint: usize,
    c: f64,
    per_speed: f64,
    slope: f64,
}

impl Effect for Stribeck {
    fn torque(&self, motion: &Motion, torque: &mut [f64]) {
        let v = motion.v[self.joint];
        let hump = (-(v * self.per_speed).powi(2)).exp();
        torque[self.joint] += self.c * sign(self.slope, v) * hump;
    }
}
