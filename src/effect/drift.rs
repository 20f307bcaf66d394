//! `drift`: a torque that grows with time, c t, in both directions.

use super::{Family, Key, Kind, Role, Unit, every_joint, no_limits, no_shape};

pub const KIND: Kind = Kind {
    name: "drift",
    family: Family::Slow,
    role: Role::Columns,
    shape: &[],
    linear: &[Key::new("c", Unit::TorqueRate)],
    places: every_joint,
    starts: no_shape,
    limits: no_limits,
    columns: |scene, _, _, _, out| {
        let s = scene.stretch;
        for (k, x) in out[0].iter_mut().enumerate() {
            *x = s.began + s.dt * k as f64;
        }
    },
    separate_by: "hold the joint still at one pose at the begin and at the end of the log",
};
