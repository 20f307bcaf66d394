//! `rotor-inertia`: J a of a rotor or screw that the links' inertias do not hold. In the CFT robot's
//! actuator coordinates x_r and y_r the screws move with the pantograph's Jacobian:
//! tau = J' m (J a + Jdot v).

use super::{Family, Key, Kind, Place, Role, Unit, no_limits, no_shape};
use crate::robot::cft::pantograph::{reference_jacobian, reference_jacobian_rate};

pub const KIND: Kind = Kind {
    name: "rotor-inertia",
    family: Family::Inertia,
    role: Role::Columns,
    shape: &[],
    linear: &[Key::new("J", Unit::Inertia)],
    places: |robot, _| {
        let joints = (0..robot.joints()).map(Place::Joint);
        let screws = 0..robot.transmission().screws().len();
        joints.chain(screws.map(Place::Actuator)).collect()
    },
    starts: no_shape,
    limits: no_limits,
    columns: |scene, place, _, joint, out| match place {
        Place::Joint(j) => out[0].copy_from_slice(&scene.stretch.a[j]),
        Place::Actuator(r) => {
            let s = scene.stretch;
            let (mut q, mut v, mut a) = ([0.0; 4], [0.0; 4], [0.0; 4]);
            for (k, out) in out[0].iter_mut().enumerate() {
                s.at(k, &mut q, &mut v, &mut a);
                let (jacobian, rate) = (reference_jacobian(&q), reference_jacobian_rate(&q, &v));
                let acceleration = jacobian[r][0] * a[2]
                    + jacobian[r][1] * a[3]
                    + rate[r][0] * v[2]
                    + rate[r][1] * v[3];
                *out = jacobian[r][joint - 2] * acceleration;
            }
        }
        _ => {}
    },
    separate_by: "fast reversals of one actuator at several poses of the arm",
};
