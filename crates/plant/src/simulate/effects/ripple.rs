//! `ripple`: torque that repeats with position, the same in both directions.
//!
//! E(q) = sum over h = 1, 2, 3 of sin_h sin(h k q) + cos_h cos(h k q), with k = order per radian of a
//! joint that turns (order 1/rev) and k = 2 pi order per metre of one that slides (order 1/m).

use super::{BuiltLaw, EffectSite, PlantLaw};
use cft_ident_core::effect::ripple::ENTRY;

const HARMONICS: usize = 3;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![12.0, 0.1 * site.scale, 0.0, 0.0, 0.0, 0.0, 0.0],
    build: |site, _, values| {
        let (joint, wavenumber) = (site.joint(), wavenumber(site, values[0]));
        // sine and cosine part of each harmonic
        let amplitudes: [[f64; 2]; HARMONICS] =
            std::array::from_fn(|h| [values[1 + 2 * h], values[2 + 2 * h]]);
        BuiltLaw::torques(move |motion, torque| {
            let angle = wavenumber * motion.q[joint];
            for (h, [sin, cos]) in amplitudes.iter().enumerate() {
                if *sin != 0.0 || *cos != 0.0 {
                    let (s, c) = ((h + 1) as f64 * angle).sin_cos();
                    torque[joint] += sin * s + cos * c;
                }
            }
        })
    },
};

/// Waves per radian of a joint that turns, or 2 pi times the waves per metre of one that slides.
pub(super) fn wavenumber(site: &EffectSite, order: f64) -> f64 {
    if site.turns {
        order
    } else {
        std::f64::consts::TAU * order
    }
}
