//! `payload` of the CFT robot and of a single joint: a body on the last link: mass, first moments, and its
//! second moment about the vertical axis of the link's frame, about which alone a tool that stays level
//! turns. A fit whose logs carried it absorbs it: it is looked for only with the model held.

use super::{Family, Key, Kind, Place, Role, Unit, no_limits, no_shape};
use crate::robot::Robot;
use crate::robot::cft::links::{PseudoInertia, base_parameters};
use crate::robot::cft::regressor::regressor22;

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
    places: |robot, _| match robot {
        Robot::Serial(_) => Vec::new(),
        Robot::Cft(_) | Robot::SingleJoint(_) => vec![Place::All],
    },
    starts: no_shape,
    limits: no_limits,
    columns: |scene, _, _, joint, out| {
        let s = scene.stretch;
        match scene.robot {
            Robot::Cft(_) => {
                let bodies = bodies();
                let (mut q, mut v, mut a) = ([0.0; 4], [0.0; 4], [0.0; 4]);
                let mut y = [[0.0; 22]; 4];
                for k in 0..s.len() {
                    s.at(k, &mut q, &mut v, &mut a);
                    regressor22(&q, &v, &a, &mut y);
                    for (column, body) in out.iter_mut().zip(&bodies) {
                        column[k] = y[joint].iter().zip(body).map(|(y, b)| y * b).sum();
                    }
                }
            }
            Robot::SingleJoint(_) => out[0].copy_from_slice(&s.a[joint]),
            Robot::Serial(_) => {}
        }
    },
    separate_by: SEPARATE_BY,
};

/// Base parameters of a unit mass, unit first moments and a unit second moment along x in the frame of
/// the last link.
fn bodies() -> [[f64; 22]; 5] {
    let place = [(3, 3), (0, 3), (1, 3), (2, 3), (0, 0)];
    place.map(|(r, c)| {
        let mut links = [PseudoInertia([[0.0; 4]; 4]); 8];
        links[7].0[r][c] = 1.0;
        links[7].0[c][r] = 1.0;
        base_parameters(&links)
    })
}
