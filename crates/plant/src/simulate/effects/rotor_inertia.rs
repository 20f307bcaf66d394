//! `rotor-inertia`: the inertia J of a motor, at a joint or at the CFT robot's screws.
//!
//! At x_r or y_r, J is a mass in kg on the screw's nut and the joints feel J_a^T J (J_a a + dJ_a/dt v) with the
//! Jacobian J_a of the pantograph; at a joint they feel J a.

use super::{BuiltLaw, PlantLaw};
use crate::simulate::SimulateError;
use cft_ident_core::effect::EffectPlace;
use cft_ident_core::effect::rotor_inertia::ENTRY;
use cft_ident_core::robot::cft::pantograph::{reference_jacobian, reference_jacobian_rate};

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.25 * site.inertia],
    build: |site, _, values| match site.place {
        EffectPlace::Actuator(row) => at_screw(row, values[0]),
        _ => at_joint(site.joint(), values[0]),
    },
};

/// Inertia of one joint, kg or kg m^2.
pub(super) fn at_joint(joint: usize, inertia: f64) -> Result<BuiltLaw, SimulateError> {
    BuiltLaw::inertia(move |motion, mass, _| mass[joint * (motion.q.len() + 1)] += inertia)
}

fn at_screw(row: usize, moving: f64) -> Result<BuiltLaw, SimulateError> {
    BuiltLaw::inertia(move |motion, mass, torque| {
        let (Some(q), Some(v)) = (motion.q.first_chunk(), motion.v.first_chunk()) else {
            return;
        };
        let own = reference_jacobian(q)[row];
        let rate = reference_jacobian_rate(q, v)[row];
        let drift = rate[0] * v[2] + rate[1] * v[3];
        for i in 0..2 {
            torque[2 + i] += moving * own[i] * drift;
            for j in 0..2 {
                mass[4 * (2 + i) + 2 + j] += moving * own[i] * own[j];
            }
        }
    })
}
