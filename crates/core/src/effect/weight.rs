//! `weight`: the moment of a weight that the declared model has no column for, as on a hinge declared without gravity.

use super::{Entry, Family, Key, Law, SpeedLadder};
use crate::robot::JointKind;

pub static ENTRY: Entry = Entry {
    name: "weight",
    families: &[Family::Position],
    keys: &[Key::torque("sin"), Key::torque("cos")],
    ladder: Some(SpeedLadder::USUAL),
    separate_by: "log a slow sweep over the whole travel with two payloads (a weight grows with them, a spring does not)",
    formula: "sin * sin(q) + cos * cos(q)",
    source: "a link that hangs on the joint, where the robot file states no gravity",
    at_rest: true,
    said: |f| format!("gravity on {}, {}", f.at, f.amplitude()),
    remedy: "state `gravity` and how the axis lies in the robot file, or keep the refined model",
    measurable: true,
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    fits: |robot, _, place| place.kind(robot) == JointKind::Revolute,
    code: Some(|to| {
        let q = to.q();
        to.added(format!("{} * sin({q}) + {} * cos({q})", to.x(0), to.x(1)));
    }),
    ..Law::linear(&ENTRY, &["sin", "cos"], |at, _, out| {
        (out[0], out[1]) = at.q().sin_cos()
    })
};
