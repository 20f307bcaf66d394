//! `rotor-inertia`: the inertia J of a motor, at a joint or at the CFT robot's screws.
//!
//! At x_r or y_r, J is a mass in kg on the screw's nut and the joints feel J_a^T J (J_a a + dJ_a/dt v) with the
//! Jacobian J_a of the pantograph; at a joint they feel J a.

use super::{Built, Effect, PlantLaw, PlantState};
use cft_ident_core::effect::Place;
use cft_ident_core::effect::rotor_inertia::ENTRY;
use cft_ident_core::robot::cft::pantograph::{reference_jacobian, reference_jacobian_rate};

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.25 * site.inertia],
    build: |site, _, values| match site.place {
        Place::Actuator(row) => Built::plant(AtScrew {
            row,
            mass: values[0],
        }),
        _ => Built::plant(AtJoint {
            joint: site.joint(),
            inertia: values[0],
        }),
    },
};

pub(super) struct AtJoint {
    pub joint: usize,
    pub inertia: f64,
}

impl Effect for AtJoint {
    fn inertia(&self, motion: &PlantState, mass: &mut [f64], _torque: &mut [f64]) {
        mass[self.joint * (motion.q.len() + 1)] += self.inertia;
    }
}

struct AtScrew {
    row: usize,
    mass: f64,
}

impl Effect for AtScrew {
    fn inertia(&self, motion: &PlantState, mass: &mut [f64], torque: &mut [f64]) {
        let (Some(q), Some(v)) = (motion.q.first_chunk(), motion.v.first_chunk()) else {
            return;
        };
        let own = reference_jacobian(q)[self.row];
        let rate = reference_jacobian_rate(q, v)[self.row];
        let drift = rate[0] * v[2] + rate[1] * v[3];
        for i in 0..2 {
            torque[2 + i] += self.mass * own[i] * drift;
            for j in 0..2 {
                mass[4 * (2 + i) + 2 + j] += self.mass * own[i] * own[j];
            }
        }
    }
}
