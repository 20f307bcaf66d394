//! `rotor-inertia`: J a of a rotor or screw that the links' inertias do not hold. In the CFT robot's
//! actuator coordinates x_r and y_r the screws move with the pantograph's Jacobian:
//! tau = J' m (J a + Jdot v).

use super::{
    EffectPlace, Entry, Family, Key, Law, PlaceRule, RobotProperty, Rule, SpeedLadder, Unit,
};
use crate::robot::cft::pantograph::{reference_jacobian, reference_jacobian_rate};

pub static ENTRY: Entry = Entry {
    name: "rotor-inertia",
    families: &[Family::Inertia],
    keys: &[Key::size("J", Unit::Inertia)],
    places: PlaceRule::JointsAndActuators,
    must: &[Rule::not_negative("J", "a rotor has mass")],
    ladder: Some(SpeedLadder::USUAL),
    separate_by: "log fast reversals of one actuator at several poses of the arm",
    formula: "J a; at a screw J_a' J (J_a a + dJ_a/dt v)",
    source: "a rotor or screw that the links' inertias do not hold",
    at_rest: true,
    said: |f| format!("inertia of {} in the drive of {}", f.size("J"), f.at),
    remedy: "use the refined model, or declare the drive's inertia in the robot file",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    code: Some(|to| match to.place {
        EffectPlace::Actuator(_) | EffectPlace::Actuators => {
            let inertia = to.x(0);
            to.of_screws(|_, acceleration| format!("{inertia} * {acceleration}"));
        }
        _ => to.added(format!("{} * {}", to.x(0), to.a())),
    }),
    property: |place, _, linear| {
        let inertia = linear[0];
        let of = |joint| RobotProperty::Drive { joint, inertia };
        place.joint().map(of)
    },
    ..Law::linear(&ENTRY, &["J"], |at, _, out| match at.place {
        EffectPlace::Joint(_) => out[0] = at.a(),
        place => {
            let [q, v, a] = at.state();
            let (jacobian, rate) = (reference_jacobian(&q), reference_jacobian_rate(&q, &v));
            for r in place.rows() {
                let acceleration = jacobian[r][0] * a[2]
                    + jacobian[r][1] * a[3]
                    + rate[r][0] * v[2]
                    + rate[r][1] * v[3];
                out[0] += jacobian[r][at.joint - 2] * acceleration;
            }
        }
    })
};
