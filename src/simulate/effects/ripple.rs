//! `ripple`: torque that repeats with position, the same in both directions.
//!
//! E(q) = sum over h = 1, 2, 3 of sin_h sin(h k q) + cos_h cos(h k q), with k = order per radian of a
//! joint that turns (order 1/rev) and k = 2 pi order per metre of one that slides (order 1/m).

use super::{Effect, Key, Kind, Motion, Site};

const HARMONICS: usize = 3;

/// A harmonic that is not there unless it is asked for.
const fn absent(name: &'static str) -> Key {
    Key {
        name,
        unit: "torque",
        default: |_| 0.0,
    }
}

pub const KIND: Kind = Kind {
    name: "ripple",
    family: "position",
    keys: &[
        Key {
            name: "order",
            unit: "order",
            default: |_| 12.0,
        },
        Key {
            name: "sin",
            unit: "torque",
            default: |site| 0.1 * site.scale,
        },
        absent("cos"),
        absent("sin2"),
        absent("cos2"),
        absent("sin3"),
        absent("cos3"),
    ],
    build,
};

fn build(site: &Site, values: &[f64]) -> Box<dyn Effect> {
    let per_unit = if site.turns {
        1.0
    } else {
        std::f64::consts::TAU
    };
    Box::new(Ripple {
        joint: site.joint,
        wavenumber: per_unit * values[0],
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

#[cfg(test)]
mod tests {
    use super::*;

    fn torque(turns: bool, q: f64) -> f64 {
        let site = Site {
            joint: 0,
            turns,
            scale: 10.0,
            unit: "Nm",
        };
        let effect = build(&site, &[4.0, 0.3, 0.2, 0.0, 0.1, 0.0, 0.0]);
        let mut torque = [0.0];
        let motion = Motion {
            t: 0.0,
            q: &[q],
            v: &[0.0],
            z: &[],
        };
        effect.torque(&motion, &mut torque);
        torque[0]
    }

    #[test]
    fn order_counts_waves_per_revolution_or_per_metre() {
        for q in [0.0, 0.1, 0.7] {
            let wave = std::f64::consts::TAU / 4.0;
            assert!((torque(true, q) - torque(true, q + wave)).abs() < 1e-13);
            assert!((torque(false, q) - torque(false, q + 0.25)).abs() < 1e-13);
        }
        assert!((torque(true, 0.0) - 0.3).abs() < 1e-15);
    }
}
