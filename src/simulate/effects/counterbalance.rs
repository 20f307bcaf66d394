//! `counterbalance`: a spring between a point of the base and a point of the link.
//!
//! The base's point lies at the distance a from the axis in the direction `angle`, the link's at the distance
//! b in the direction q, so that the spring is l = sqrt(a^2 + b^2 - 2 a b cos(q - angle)) long and the motor
//! supplies d/dq of stiffness (l - free_length)^2/2.

use super::{Built, Effect, Key, Kind, Motion, Places, Unit};
use crate::simulate::SimulateError;

pub const KIND: Kind = Kind {
    name: "counterbalance",
    family: "position",
    places: Places::Joints,
    keys: &[
        Key::size("stiffness", Unit::Fixed("N/m"), |site| {
            0.4 * site.scale / (LONG * SHORT)
        }),
        Key::shape("free_length", Unit::Fixed("m"), |_| 0.5 * LONG),
        Key::shape("a", Unit::Fixed("m"), |_| LONG),
        Key::shape("b", Unit::Fixed("m"), |_| SHORT),
        Key::shape("angle", Unit::Fixed("rad"), |site| {
            site.middle() - std::f64::consts::FRAC_PI_2
        }),
    ],
    build: |site, _, values| {
        if !site.turns {
            return Err(site.refuse(
                KIND.name,
                "its lever turns about an axis, and this joint slides; use `spring`",
            ));
        }
        let (a, b) = (values[2], values[3]);
        if !(a > 0.0 && b > 0.0) || a == b {
            return Err(SimulateError::EffectNumber {
                effect: KIND.name.to_owned(),
                key: "a - b".to_owned(),
                value: a - b,
                rule: "a and b must be above 0 and differ, or the spring's length reaches 0"
                    .to_owned(),
            });
        }
        Built::plant(Counterbalance {
            joint: site.joint(),
            stiffness: values[0],
            free_length: values[1],
            a,
            b,
            angle: values[4],
        })
    },
};

/// Default distances of the two points from the axis \[m\].
const LONG: f64 = 0.4;
const SHORT: f64 = 0.1;

#[derive(Debug)]
struct Counterbalance {
    joint: usize,
    stiffness: f64,
    free_length: f64,
    a: f64,
    b: f64,
    angle: f64,
}

impl Effect for Counterbalance {
    fn torque(&self, motion: &Motion, torque: &mut [f64]) {
        let (s, c) = (motion.q[self.joint] - self.angle).sin_cos();
        let moment = self.a * self.b * s;
        let length = (self.a * self.a + self.b * self.b - 2.0 * self.a * self.b * c).sqrt();
        torque[self.joint] += self.stiffness * (length - self.free_length) * moment / length;
    }
}
