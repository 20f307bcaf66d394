//! `payload` of the CFT robot and of a single joint: a body on the last link: mass, first moments, and its
//! second moment about the vertical axis of the link's frame, about which alone a tool that stays level
//! turns. A fit whose logs carried it absorbs it: it is looked for only with the model held.

use super::{Family, Key, Kind, Place, Role, Unit, no_limits, no_shape};
use crate::robot::tree::MOST_JOINTS;

/// What parts a payload from the inertias that a fit finds.
pub(super) const SEPARATE_BY: &str = "identify unloaded, then diagnose loaded logs with --keep";

pub const KIND: Kind = Kind {
    name: "payload",
    family: Family::Inertia,
    role: Role::Kept,
    shape: &[],
    linear: &[
        Key::new("mass", Unit::Text("kg")),
        Key::new("mx", Unit::Text("kg m")),
        Key::new("my", Unit::Text("kg m")),
        Key::new("mz", Unit::Text("kg m")),
        // told, in files and tables, as that about the body's own centre
        Key::new("inertia", Unit::Text("kg m^2")),
    ],
    places: |robot, _| match robot.tool_stays_level() {
        true => vec![Place::All],
        false => Vec::new(),
    },
    starts: no_shape,
    limits: no_limits,
    columns: |scene, _, _, joint, out| {
        let (s, n) = (scene.stretch, scene.robot.joints());
        let mut state = [[0.0; MOST_JOINTS]; 3];
        for k in 0..s.len() {
            let [q, v, a] = state.each_mut().map(|x| &mut x[..n]);
            s.at(k, q, v, a);
            let row = scene.robot.level_tool_row(joint, q, v, a);
            for (column, x) in out.iter_mut().zip(row) {
                column[k] = x;
            }
        }
    },
    separate_by: SEPARATE_BY,
};
