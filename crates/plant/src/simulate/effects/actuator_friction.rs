//! `actuator-friction`: friction where the CFT robot's seals and nuts are, at the screws.
//!
//! With the speed v_a = J_4 v4 + J_5 v5 of x_r or y_r and the force f = viscous v_a + coulomb tanh(slope v_a)
//! the joints q4 and q5 feel J_4 f and J_5 f: their friction depends on the pose and couples them.

use super::{BuiltLaw, PlantLaw};
use cft_ident_core::effect::EffectPlace;
use cft_ident_core::effect::actuator_friction::ENTRY;
use cft_ident_core::robot::cft::pantograph::reference_jacobian;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.2 * site.scale / site.speed, 0.3 * site.scale, 1200.0],
    build: |site, _, values| {
        let EffectPlace::Actuator(row) = site.place else {
            return Err(site.refuse(ENTRY.name, "it sits at the screws x_r and y_r"));
        };
        let (viscous, coulomb, slope) = (values[0], values[1], values[2]);
        BuiltLaw::torques(move |motion, torque| {
            let (Some(q), Some(&[_, _, v4, v5]), [_, _, tau4, tau5]) =
                (motion.q.first_chunk(), motion.v.first_chunk(), torque)
            else {
                return;
            };
            let [to_q4, to_q5] = reference_jacobian(q)[row];
            let v = to_q4 * v4 + to_q5 * v5;
            let force = viscous * v + coulomb * (slope * v).tanh();
            *tau4 += to_q4 * force;
            *tau5 += to_q5 * force;
        })
    },
};
