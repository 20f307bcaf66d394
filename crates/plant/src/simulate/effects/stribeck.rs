//! `stribeck`: more friction near standstill, c sgn(v) exp(-(v/vs)^2).

use super::{BuiltLaw, PlantLaw, sign};
use cft_ident_core::effect::stribeck::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.2 * site.scale, 0.2 * site.speed],
    build: |site, _, values| {
        let (c, per_speed, slope) = (values[0], 1.0 / values[1], site.slope());
        BuiltLaw::torque(site, move |m| {
            let hump = (-(m.v * per_speed).powi(2)).exp();
            c * sign(slope, m.v) * hump
        })
    },
};
