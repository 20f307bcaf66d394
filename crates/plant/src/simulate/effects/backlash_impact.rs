//! `backlash-impact`: a load that is loose on its motor within a gap, encoder and friction on the motor's side.
//!
//! Where it lies against an end of the gap it is pushed by a stiff, well damped contact and never pulled; between the
//! ends nothing acts on it but its own weight. Both sides are integrated, as those of an elastic drive are
//! ([`TwoSides`]).

use super::elasticity::{TwoSides, rotor};
use super::{BuiltLaw, PlantLaw};
use crate::simulate::SimulateError;
use cft_ident_core::effect::backlash_impact::ENTRY;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| {
        let gap = if site.turns { 0.01 } else { 5e-4 };
        vec![gap, site.inertia - rotor(site)]
    },
    build: |site, _, values| {
        let (gap, inertia) = (values[0], values[1]);
        let contact = std::f64::consts::TAU * CONTACT_HZ;
        let mut sides = TwoSides::of(site, inertia * contact * contact, inertia, DAMPING);
        sides.gap = gap;
        if !sides.can_be(site, inertia) {
            let rule = "must be below the joint's, and leave the motor less than the joint's least";
            return Err(SimulateError::number(ENTRY.name, "inertia", inertia, rule));
        }
        BuiltLaw::plant(sides)
    },
};

/// Frequency of the load on its contact \[Hz\]: above what a log of a robot's torque shows.
const CONTACT_HZ: f64 = 60.0;
/// Damping ratio of the contact: the load does not bounce.
const DAMPING: f64 = 0.7;
