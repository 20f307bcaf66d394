//! `rotor-inertia`: J a of a rotor or screw that the links' inertias do not hold. In the CFT robot's
//! actuator coordinates x_r and y_r the screws move with the pantograph's Jacobian:
//! tau = J' m (J a + Jdot v).

use super::entry::{Entry, Family, Key, Ladder};
use super::law::Law;
use super::physics::Rule;
use super::place::{Place, Places};
use super::site::Property;
use super::unit::Unit;
use crate::robot::cft::pantograph::{reference_jacobian, reference_jacobian_rate};

pub static ENTRY: Entry = Entry {
    name: "rotor-inertia",
    families: &[Family::Inertia],
    keys: &[Key::size("J", Unit::Inertia)],
    places: Places::JointsAndActuators,
    must: &[Rule::not_negative("J", "a rotor has mass")],
    ladder: Some(Ladder::USUAL),
    separate_by: "log fast reversals of one actuator at several poses of the arm",
    formula: "J a; at a screw J_a' J (J_a a + dJ_a/dt v)",
    source: "a rotor or screw that the links' inertias do not hold",
    at_rest: true,
    said: |f| format!("inertia of {} in the drive of {}", f.size("J"), f.at),
    remedy: "use the refined model, or declare the drive's inertia in the robot file",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    code: Some(|to| match to.place() {
        Place::Actuator(_) => {
            let inertia = to.x(0);
            to.of_screw(|_, acceleration| format!("{inertia} * {acceleration}"));
        }
        _ => to.added(format!("{} * {}", to.x(0), to.a())),
    }),
    property: |place, _, linear| {
        let inertia = linear[0];
        let of = |joint| Property::Drive { joint, inertia };
        place.joint().map(of)
    },
    ..Law::linear(&ENTRY, &["J"], |scene, place, _, joint, out| match place {
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
    })
};
