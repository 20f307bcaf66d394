//! `position-friction`: friction whose level varies with position, and flips with the direction.
//!
//! E = sgn(v) (sin sin(k q) + cos cos(k q)), k as in `ripple`, the sign as steep as the joint allows.

use super::{BuiltLaw, PlantLaw, ripple, sign};
use cft_ident_core::effect::position_friction::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| {
        let order = if site.turns { 2.0 } else { 4.0 };
        vec![order, 0.1 * site.scale, 0.0]
    },
    build: |site, _, values| {
        let (wavenumber, slope) = (ripple::wavenumber(site, values[0]), site.slope());
        let (sin, cos) = (values[1], values[2]);
        BuiltLaw::torque(site, move |m| {
            let (s, c) = (wavenumber * m.q).sin_cos();
            sign(slope, m.v) * (sin * s + cos * c)
        })
    },
};
