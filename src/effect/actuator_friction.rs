//! `actuator-friction`: friction in the actuator coordinates, tau = J' F(J v). On the CFT robot it
//! sits in the screws x_r and y_r, where the seals and nuts are, and couples q4 and q5.

use super::{Family, Key, Kind, Place, Role, Unit};
use crate::robot::cft::pantograph::reference_jacobian;

pub const KIND: Kind = Kind {
    name: "actuator-friction",
    family: Family::Velocity,
    role: Role::Columns,
    shape: &[Key::new("slope", Unit::Text("s/m"))],
    linear: &[
        Key::new("viscous", Unit::Text("N s/m")),
        Key::new("coulomb", Unit::Text("N")),
    ],
    places: |robot, _| {
        let screws = 0..robot.transmission().screws().len();
        screws.map(Place::Actuator).collect()
    },
    starts: |cover, _| {
        if cover.joints.iter().all(|j| j.reversals < 2) {
            return Err("fewer than two reversals".into());
        }
        Ok([50.0, 200.0, 1000.0].map(|w| vec![w]).to_vec())
    },
    limits: |_, _| vec![[10.0, 1e5]],
    columns: |scene, place, shape, joint, out| {
        let Place::Actuator(r) = place else { return };
        let s = scene.stretch;
        let (mut q, mut v, mut a) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        let [viscous, coulomb] = out else { return };
        for (k, (viscous, coulomb)) in viscous.iter_mut().zip(coulomb).enumerate() {
            s.at(k, &mut q, &mut v, &mut a);
            let jacobian = reference_jacobian(&q);
            let speed = jacobian[r][0] * v[2] + jacobian[r][1] * v[3];
            let share = jacobian[r][joint - 2];
            *viscous = share * speed;
            *coulomb = share * (shape[0] * speed).tanh();
        }
    },
    separate_by: "move one actuator alone, both ways at several speeds, at three poses of the other",
};
