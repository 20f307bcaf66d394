//! `rigid-body-terms`: the base parameters of the full chain that the declared structure drops: for
//! the CFT robot with 12 parameters the other ten of its 22.

use super::{Entry, Family, Key, Law, PlaceRule, Unit};
use crate::robot::cft::UNPRINTED;

/// The parameters of the full chain that the report does not print.
const KEYS: [Key; 10] = {
    let mut keys = [Key::size("", Unit::Fixed("kg m^2")); 10];
    let mut i = 0;
    while i < keys.len() {
        keys[i].name = UNPRINTED[i];
        i += 1;
    }
    keys
};

pub static ENTRY: Entry = Entry {
    name: "rigid-body-terms",
    families: &[Family::Inertia],
    keys: &KEYS,
    places: PlaceRule::Whole,
    separate_by: "declare `parameters = 22` and excite all joints together, fast",
    formula: "the ten columns that the twelve parameters leave out",
    source: "links that are no thin rods, by the full chain of the report",
    at_rest: true,
    said: |_| "masses and inertias that the twelve parameters leave out".to_owned(),
    remedy: "declare `parameters = 22` in the robot file and fit again",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    fits: |robot, _, _| !robot.dropped_parameters().is_empty(),
    code: Some(|to| to.bodies(to.model.robot.dropped_links(to.linear))),
    ..Law::linear(&ENTRY, &UNPRINTED, |at, _, out| {
        let [q, v, a] = at.state::<4>();
        at.scene.robot.dropped_row(at.joint, &q, &v, &a, out);
    })
};
