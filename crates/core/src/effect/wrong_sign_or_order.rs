//! `wrong-sign-or-order`: the torque of a joint has the other sign, or is that of another joint.

use super::{Entry, Family, Key, Role, Unit};

pub static ENTRY: Entry = Entry {
    name: "wrong-sign-or-order",
    families: &[Family::Data],
    keys: &[Key::size("sign", Unit::One), Key::size("swap", Unit::One)],
    role: Role::Fault,
    no_torque: Some("it is a channel that was logged with another sign or place"),
    separate_by: "push the joint by hand and look at the signs",
    formula: "none; the torque channel is turned (sign=1), or changes places with joint swap",
    source: "wiring, or columns that a script exchanged",
    ..Entry::USUAL
};
