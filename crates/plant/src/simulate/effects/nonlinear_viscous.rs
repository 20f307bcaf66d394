//! `nonlinear-viscous`: friction c sgn(v) |v|^p that bends with the speed.
//!
//! Below p = 1 the slope at rest is infinite: the law is then c v (v^2 + v0^2)^((p - 1)/2), which is the
//! power beyond the small speed v0 = 1/w within which signs change.

use super::{Built, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::nonlinear_viscous::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.05 * site.scale / site.speed.powi(2), 2.0],
    build: |site, _, values| {
        let p = values[1];
        Built::plant(NonlinearViscous {
            joint: site.joint(),
            c: values[0],
            p,
            rest: 1.0 / site.slope(),
        })
    },
};

#[derive(Debug)]
struct NonlinearViscous {
    joint: usize,
    c: f64,
    p: f64,
    /// Speed v0 within which a root of the speed is made smooth, m/s or rad/s.
    rest: f64,
}

impl Effect for NonlinearViscous {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let v = motion.v[self.joint];
        let power = if self.p < 1.0 {
            v.hypot(self.rest).powf(self.p - 1.0)
        } else {
            v.abs().powf(self.p - 1.0)
        };
        torque[self.joint] += self.c * v * power;
    }
}
