//! `disturbance`: somebody pushes. The diagnosis finds such an episode and cuts it out; it has no parameter.

use super::{Entry, Family, Key, Role, Unit};

pub static ENTRY: Entry = Entry {
    name: "disturbance",
    families: &[Family::Event],
    keys: &[
        Key::shape("at", Unit::Fixed("s")),
        Key::shape("seconds", Unit::Fixed("s")).above_zero("must be above 0 s"),
        Key::torque("c"),
    ],
    role: Role::Fault,
    no_torque: Some("it is an episode of one log, and no law tells when the next one comes"),
    separate_by: "cut it out",
    formula: "c from at to at + seconds",
    source: "somebody or something that pushes the arm",
    ..Entry::USUAL
};
