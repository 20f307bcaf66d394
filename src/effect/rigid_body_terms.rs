//! `rigid-body-terms`: the base parameters of the full chain that the declared structure drops: for
//! the CFT robot with 12 parameters the other ten of its 22.

use super::{Family, Key, Kind, Place, Role, Unit, no_limits, no_shape};
use crate::robot::cft::UNPRINTED;

/// Name and unit of an extra parameter of the full chain.
const fn extra(i: usize) -> Key {
    Key::new(UNPRINTED[i], Unit::Text("kg m^2"))
}

pub const KIND: Kind = Kind {
    name: "rigid-body-terms",
    family: Family::Inertia,
    role: Role::Columns,
    shape: &[],
    linear: &[
        extra(0),
        extra(1),
        extra(2),
        extra(3),
        extra(4),
        extra(5),
        extra(6),
        extra(7),
        extra(8),
        extra(9),
    ],
    places: |robot, _| match robot.dropped_parameters() {
        [] => Vec::new(),
        _ => vec![Place::All],
    },
    starts: no_shape,
    limits: no_limits,
    columns: |scene, _, _, joint, out| {
        let s = scene.stretch;
        let (mut q, mut v, mut a) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        let mut row = [0.0; UNPRINTED.len()];
        for k in 0..s.len() {
            s.at(k, &mut q, &mut v, &mut a);
            scene.robot.dropped_row(joint, &q, &v, &a, &mut row);
            for (column, x) in out.iter_mut().zip(&row) {
                column[k] = *x;
            }
        }
    },
    separate_by: "declare `parameters = 22` and excite all joints together, fast",
};
