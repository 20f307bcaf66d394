//! `quantisation`: a logged torque of few digits.

use super::{Entry, Family, Key, Role};

pub static ENTRY: Entry = Entry {
    name: "quantisation",
    families: &[Family::Data],
    keys: &[Key::torque("step").above_zero("must be above 0")],
    role: Role::Fault,
    no_torque: Some("it is the grain of a logged channel"),
    separate_by: "log the raw current",
    formula: "none; the logged torque is rounded to whole steps",
    source: "a drive that sends per mille of its rated torque, or a log with few digits",
    ..Entry::USUAL
};
