//! `rigid-body-terms`: the ten base parameters of the full chain that the twelve of the report leave out.
//!
//! M, C and G are linear in the parameters, so the ten alone make the inertia and the torque that are added.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::rigid_body_terms::ENTRY;
use cft_ident_core::robot::cft::dynamics::{ReportCoefficients, inertia_and_bias};

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    // on a chain of eight tubes and plates
    defaults: |_| {
        vec![
            -0.25, 0.002, 0.003, 0.0005, -0.001, -0.12, 0.002, -0.002, -0.02, 0.03,
        ]
    },
    build: |site, machine, values| {
        if machine.robot.coefficients(machine.theta).is_none() {
            return Err(site.refuse(
                ENTRY.name,
                "a single joint has one inertia and nothing that its structure drops",
            ));
        }
        let mut theta = [0.0; 22];
        for (own, value) in theta[12..].iter_mut().zip(values) {
            *own = *value;
        }
        let terms = ReportCoefficients::from_theta22(&theta);
        BuiltLaw::inertia(move |motion, mass, torque| {
            let (Some(q), Some(v)) = (motion.q.first_chunk(), motion.v.first_chunk()) else {
                return;
            };
            let (own, bias) = inertia_and_bias(q, v, &terms);
            for (mass, own) in mass.iter_mut().zip(own.as_flattened()) {
                *mass += own;
            }
            for (torque, own) in torque.iter_mut().zip(bias) {
                *torque += own;
            }
        })
    },
};
