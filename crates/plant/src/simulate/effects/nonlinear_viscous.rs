//! `nonlinear-viscous`: friction c sgn(v) |v|^p that bends with the speed.
//!
//! Below p = 1 the slope at rest is infinite: the law is then c v (v^2 + v0^2)^((p - 1)/2), which is the
//! power beyond the small speed v0 = 1/w within which signs change.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::nonlinear_viscous::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.05 * site.scale / site.speed.powi(2), 2.0],
    build: |site, _, values| {
        let (c, p, rest) = (values[0], values[1], 1.0 / site.slope());
        BuiltLaw::torque(site, move |m| {
            let size = if p < 1.0 { m.v.hypot(rest) } else { m.v.abs() };
            c * m.v * size.powf(p - 1.0)
        })
    },
};
