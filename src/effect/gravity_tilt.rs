//! `gravity-tilt`: gravity has components gx and gy along the base's x and y, which the model does not
//! know: a base that stands askew. Two numbers explain it on all joints; the columns are those of
//! [`Tilt`](crate::robot::undeclared::Tilt).

use super::{Family, Key, Kind, Place, Role, Scene, Unit, no_limits, no_shape};
use crate::robot::tree::MOST_JOINTS;

pub const KIND: Kind = Kind {
    name: "gravity-tilt",
    family: Family::Offset,
    role: Role::Columns,
    shape: &[],
    linear: &[
        Key::new("gx", Unit::Text("m/s^2")),
        Key::new("gy", Unit::Text("m/s^2")),
    ],
    places: |robot, _| match robot.knows_links() {
        true => vec![Place::All],
        false => Vec::new(),
    },
    starts: no_shape,
    limits: no_limits,
    columns,
    separate_by: "the same motion with the arm turned by a quarter and by half a turn about q2",
};

fn columns(scene: &Scene, _: Place, _: &[f64], joint: usize, out: &mut [Vec<f64>]) {
    let [gx, gy] = out else { return };
    let (n, tilt) = (scene.robot.joints(), scene.robot.tilt(scene.theta));
    let mut state = [[0.0; MOST_JOINTS]; 3];
    for (k, (gx, gy)) in gx.iter_mut().zip(gy).enumerate() {
        let [q, v, a] = &mut state;
        scene.stretch.at(k, &mut q[..n], &mut v[..n], &mut a[..n]);
        [*gx, *gy] = tilt.torque(joint, &q[..n]);
    }
}
