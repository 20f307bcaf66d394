//! The smallest robot with every term of the dynamics, for tests and examples.

use super::tree::{Coordinate, Link, Tree, space};
use super::{JointKind, Robot};

/// Two links, both about z, 0.4 m between the axes, in a gravity \[m/s^2\].
pub fn double_pendulum(gravity: [f64; 3], drive_inertia: bool) -> Robot {
    let link = |name: &str, parent, origin, joint| Link {
        name: name.to_owned(),
        parent,
        rotation: space::UNTURNED,
        origin,
        axis: [0.0, 0.0, 1.0],
        kind: JointKind::Revolute,
        coordinate: Coordinate::Joint(joint),
    };
    let links = vec![
        link("upper", None, [0.0; 3], 0),
        link("lower", Some(0), [0.4, 0.0, 0.0], 1),
    ];
    let tree = Tree::new(links, 2, gravity).unwrap();
    let names = vec!["q1".to_owned(), "q2".to_owned()];
    Robot::of_tree(tree, names, drive_inertia, Vec::new())
}
