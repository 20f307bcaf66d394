//! `delay`: the logged torque is late by d (early where d is negative), on one joint or on all.

use super::{Family, Key, Kind, Place, Role, Unit, no_limits, no_shape};

pub const KIND: Kind = Kind {
    name: "delay",
    family: Family::Timing,
    role: Role::Shift,
    shape: &[],
    linear: &[Key::new("d", Unit::Text("s"))],
    places: |robot, _| {
        let n = robot.joints();
        let all = (n > 1).then_some(Place::All);
        all.into_iter().chain((0..n).map(Place::Joint)).collect()
    },
    starts: no_shape,
    limits: no_limits,
    columns: |scene, _, _, joint, out| {
        // tau(t - d) = tau - d dtau/dt + ..
        let hat = &scene.hat[joint];
        let step = scene.stretch.dt;
        for k in 1..hat.len().saturating_sub(1) {
            out[0][k] = -(hat[k + 1] - hat[k - 1]) / (2.0 * step);
        }
    },
    separate_by: "log one signal twice, once beside the positions and once beside the torques",
};
