//! `stuck-channel`: a channel that repeats its last value.

use super::{Entry, Family, Key, Role, Unit};

pub static ENTRY: Entry = Entry {
    name: "stuck-channel",
    families: &[Family::Data],
    keys: &[
        Key::shape("at", Unit::Fixed("s")),
        Key::shape("seconds", Unit::Fixed("s")),
        // 1 the torque, 0 the position
        Key::shape("torque", Unit::One),
    ],
    role: Role::Fault,
    no_torque: Some("it is a channel that repeated its last value"),
    separate_by: "log again",
    formula: "none; torque (1) or position (0) repeats its last value",
    source: "a bus that lost messages, or a logger that fills gaps",
    ..Entry::USUAL
};
