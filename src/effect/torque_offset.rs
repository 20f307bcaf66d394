//! `torque-offset`: a constant torque, in both directions and at standstill.

use super::{Family, Key, Kind, Role, Unit, every_joint, no_limits, no_shape};

pub const KIND: Kind = Kind {
    name: "torque-offset",
    family: Family::Offset,
    role: Role::Columns,
    shape: &[],
    linear: &[Key::new("c", Unit::Torque)],
    places: every_joint,
    starts: no_shape,
    limits: no_limits,
    columns: |_, _, _, _, out| out[0].fill(1.0),
    separate_by: "hold the joint still at several poses under brake-free control, then move it \
                  both ways at three or more constant speeds",
};
