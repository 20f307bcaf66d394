//! `ripple`: torque that repeats with position, the same in both directions.
//!
//! E(q) = sum over h = 1, 2, 3 of sin_h sin(h k q) + cos_h cos(h k q), with k = order per radian of a
//! joint that turns (order 1/rev) and k = 2 pi order per metre of one that slides (order 1/m).

use super::{Built, Effect, Key, Kind, Machine, Motion, Places, Site, Unit};
use crate::simulate::SimulateError;

const HARMONICS: usize = 3;

/// A harmonic that is not there unless it is asked for.
const fn absent(name: &'static str) -> Key {
    Key::size(name, Unit::Torque, |_| 0.0)
}

pub const KIND: Kind = Kind {
    name: "ripple",
    family: "position",
    places: Places::Joints,
    keys: &[
        Key::shape("order", Unit::Order, |_| 12.0),
        Key::size("sin", Unit::Torque, |site| 0.1 * site.scale),
        absent("cos"),
        absent("sin2"),
        absent("cos2"),
        absent("sin3"),
        absent("cos3"),
    ],
    build,
};

/// Waves per radian of a joint that turns, or 2 pi times the waves per metre of one that slides.
pub(super) fn wavenumber(site: &Site, order: f64) -> f64 {
    if site.turns {
        order
    } else {
        std::f64::consts::TAU * order
    }
}

fn build(site: &Site, _: &Machine, values: &[f64]) -> Result<Built, SimulateError> {
    Built::plant(Ripple {
        joint: site.joint(),
        wavenumber: wavenumber(site, values[0]),
        amplitudes: std::array::from_fn(|h| [values[1 + 2 * h], values[2 + 2 * h]]),
    })
}

#[derive(Debug)]
struct Ripple {
    joint: usize,
    /// rad per m or per rad.
    wavenumber: f64,
    /// Sine and cosine part of each harmonic.
    amplitudes: [[f64; 2]; HARMONICS],
}

impl Effect for Ripple {
    fn torque(&self, motion: &Motion, torque: &mut [f64]) {
        let angle = self.wavenumber * motion.q[self.joint];
        for (h, [sin, cos]) in self.amplitudes.iter().enumerate() {
            if *sin != 0.0 || *cos != 0.0 {
                let (s, c) = ((h + 1) as f64 * angle).sin_cos();
                torque[self.joint] += sin * s + cos * c;
            }
        }
    }
}
