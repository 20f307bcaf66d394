//! gravity(q) in Python, from the links alone: forces at levers, not the regressor that was fitted.

use std::fmt::Write;

use cft_ident_core::robot::tree::{Coordinate, Tree};
use cft_ident_core::robot::{JointKind, Robot};

/// The module; none of a robot whose links follow others, or that knows no links.
pub fn gravity_in_python(robot: &Robot, theta: &[f64], lines: &[String]) -> Option<String> {
    if !robot.knows_links() || robot.groupings().is_empty() {
        return None;
    }
    let tree = robot.tree();
    let mut out = String::from("\"\"\"Torque that holds an arm against gravity.\n");
    for line in lines {
        let _ = writeln!(out, "{line}");
    }
    out += "\"\"\"\nfrom math import cos, sin\n\n";
    let _ = writeln!(out, "GRAVITY = {:?}", tree.gravity().to_vec());
    out += "# parent, joint, revolute, rotation and origin in the parent, axis, mass, mass times centre\nLINKS = [\n";
    let bodies = bodies(robot, tree, theta)?;
    for (link, (mass, first)) in tree.links().iter().zip(&bodies) {
        let Coordinate::Joint(joint) = link.coordinate else {
            return None;
        };
        let parent = link.parent.map_or("None".to_owned(), |k| k.to_string());
        let revolute = if link.kind == JointKind::Revolute {
            "True"
        } else {
            "False"
        };
        let _ = writeln!(
            out,
            "    ({parent}, {joint}, {revolute}, {:?}, {:?}, {:?}, {mass:?}, {first:?}),  # {}",
            link.rotation,
            link.origin,
            link.axis,
            link.name.replace(['\n', '\r'], " ")
        );
    }
    out += "]\n";
    out += include_str!("gravity.py.in");
    Some(out)
}

/// Mass and first moment of each link, as the base parameters hold them.
fn bodies(robot: &Robot, tree: &Tree, theta: &[f64]) -> Option<Vec<(f64, [f64; 3])>> {
    const STANDARD: usize = 10;
    let mut out = vec![(0.0, [0.0; 3]); tree.links().len()];
    for (grouping, value) in robot.groupings().iter().zip(theta) {
        let (link, kind) = (grouping.kept / STANDARD, grouping.kept % STANDARD);
        let Some((mass, first)) = out.get_mut(link) else {
            continue;
        };
        match kind {
            6..=8 => first[kind - 6] = *value,
            9 => *mass = *value,
            _ => {}
        }
    }
    Some(out)
}
