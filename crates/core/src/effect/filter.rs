//! `filter`: a logged torque or position that has passed a first-order lag.

use super::{Entry, Family, Key, Role, Unit};

pub static ENTRY: Entry = Entry {
    name: "filter",
    families: &[Family::Data],
    keys: &[
        Key::shape("cutoff", Unit::Fixed("Hz")).above_zero("must be above 0 Hz"),
        // 1 the torque, 0 the position
        Key::shape("torque", Unit::One),
    ],
    role: Role::Fault,
    no_torque: Some("it is a lag of a logged channel"),
    separate_by: "log with the drive's filter off",
    formula: "none; first-order lag of the logged torque (1) or position (0)",
    source: "a smoothing filter in the drive or the sensor",
    ..Entry::USUAL
};
