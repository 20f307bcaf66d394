//! `actuator-friction`: friction where the CFT robot's seals and nuts are, at the screws.
//!
//! With the speed v_a = J_4 v4 + J_5 v5 of x_r or y_r and the force f = viscous v_a + coulomb tanh(slope v_a)
//! the joints q4 and q5 feel J_4 f and J_5 f: their friction depends on the pose and couples them.

use super::{Built, Effect, PlantLaw, PlantState, Site};
use crate::simulate::SimulateError;
use cft_ident_core::effect::Place;
use cft_ident_core::effect::actuator_friction::ENTRY;
use cft_ident_core::robot::cft::pantograph::reference_jacobian;

pub static LAW: PlantLaw = PlantLaw {
    entry: &ENTRY,
    defaults: |site| vec![0.2 * site.scale / site.speed, 0.3 * site.scale, 1200.0],
    build,
};

fn build(site: &Site, _: &super::PlantRobot, values: &[f64]) -> Result<Built, SimulateError> {
    let Place::Actuator(row) = site.place else {
        return Err(site.refuse(ENTRY.name, "it sits at the screws x_r and y_r"));
    };
    Built::plant(ActuatorFriction {
        row,
        viscous: values[0],
        coulomb: values[1],
        slope: values[2],
    })
}

struct ActuatorFriction {
    row: usize,
    viscous: f64,
    coulomb: f64,
    slope: f64,
}

impl Effect for ActuatorFriction {
    fn torque(&self, motion: &PlantState, torque: &mut [f64]) {
        let (Some(q), Some(&[_, _, v4, v5]), [_, _, tau4, tau5]) =
            (motion.q.first_chunk(), motion.v.first_chunk(), torque)
        else {
            return;
        };
        let [to_q4, to_q5] = reference_jacobian(q)[self.row];
        let v = to_q4 * v4 + to_q5 * v5;
        let force = self.viscous * v + self.coulomb * (self.slope * v).tanh();
        *tau4 += to_q4 * force;
        *tau5 += to_q5 * force;
    }
}
