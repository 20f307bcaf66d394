//! `saturation`: a logged torque with flat tops.

use super::{Entry, Family, Key, Role};

pub static ENTRY: Entry = Entry {
    name: "saturation",
    families: &[Family::Data],
    keys: &[Key::torque("limit").above_zero("must be above 0")],
    role: Role::Fault,
    no_torque: Some("it is the end of the range of a torque channel"),
    separate_by: "move slower",
    formula: "none; the logged torque stays within the limit",
    source: "the range of a sensor, an amplifier or a bus message",
    ..Entry::USUAL
};
