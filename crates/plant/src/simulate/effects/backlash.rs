//! `backlash`: after a reversal the joint crosses a gap, and what lies behind it is missing.
//!
//! A play operator of width `gap` follows the position. While the joint is inside the play the torque
//! c sgn(v) of what lies behind is missing, so that -c sgn(v) is added. The play is memory: it moves with
//! each accepted step ([`Effect::moved`]), and while it is pushed it adds no torque, so that a step never
//! sees it jump. Where the gap closes the missing torque ends within the last [`CONTACT`] of half of it, a stiff
//! but continuous contact that the error control steps through. Where it opens, at a reversal, c sgn(v) passes
//! through zero of itself.

use super::{BuiltLaw, Effect, InitialCondition, PlantLaw, PlantState, sign};
use cft_ident_core::effect::backlash::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.01 * site.half_travel(), 0.3 * site.scale],
    build: |site, _, values| {
        BuiltLaw::plant(BacklashEffect {
            joint: site.joint(),
            half: 0.5 * values[0],
            c: values[1],
            slope: site.slope(),
            centre: None,
        })
    },
};

/// Share of half the gap within which contact comes about.
const CONTACT: f64 = 0.005;

/// Play between the motor and the link of a joint.
struct BacklashEffect {
    joint: usize,
    half: f64,
    c: f64,
    slope: f64,
    /// What lies behind the gap, in the middle of which the motion begins; m or rad.
    centre: Option<f64>,
}

impl Effect for BacklashEffect {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let Some(centre) = self.centre else {
            return;
        };
        let (off, v) = (motion.q[self.joint] - centre, motion.v[self.joint]);
        let to_contact = self.half - off.abs();
        let opening = off * v < 0.0;
        let missing = match opening {
            true => 1.0,
            false => (to_contact / (CONTACT * self.half)).clamp(0.0, 1.0),
        };
        torque[self.joint] -= self.c * missing * sign(self.slope, v);
    }

    fn begin(&mut self, beginning: &InitialCondition, _z: &mut [f64]) {
        self.centre = beginning.q.get(self.joint).copied();
    }

    fn moved(&mut self, motion: &PlantState) -> bool {
        let q = motion.q[self.joint];
        if let Some(centre) = &mut self.centre {
            *centre = centre.clamp(q - self.half, q + self.half);
        }
        // Contact adds no torque before and after the play is pushed.
        false
    }
}
