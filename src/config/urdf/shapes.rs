//! Collision shapes of a URDF as capsules that hold them.

use super::xml::Element;
use crate::number::is_usable;
use crate::robot::tree::space::{Vector, add, of_roll_pitch_yaw, turn};

/// A shape in the frame of its link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// Ends of the piece and radius \[m\] of a capsule that holds it.
    Within([Vector; 2], f64),
    /// A mesh, or what cannot be read: collision shapes decide no torque, and spoil no file.
    Unknown,
}

/// The shapes of a `<link>`.
pub(super) fn of_link(link: Element) -> Vec<Shape> {
    let collisions = link.children().filter(|c| c.name() == "collision");
    let within = |collision| within(collision).unwrap_or(Shape::Unknown);
    collisions.map(within).collect()
}

fn within(collision: Element) -> Option<Shape> {
    let geometry = collision.child("geometry")?;
    let shape = geometry.children().next()?;
    let size = |key: &str| {
        let value = shape.attribute(key)?.trim().parse::<f64>().ok();
        value.filter(|x| is_usable(*x) && *x > 0.0)
    };
    // the axis of the piece, half its length, and the radius about it
    let (axis, half, radius) = match shape.name() {
        "sphere" => (2, 0.0, size("radius")?),
        "cylinder" | "capsule" => (2, 0.5 * size("length")?, size("radius")?),
        "box" => {
            let sides = numbers(shape.attribute("size")?)?;
            let longer = |a: &usize, b: &usize| sides[*a].total_cmp(&sides[*b]);
            let axis = (0..3).max_by(longer)?;
            let (one, other) = (sides[(axis + 1) % 3], sides[(axis + 2) % 3]);
            let radius = 0.5 * one.hypot(other);
            (axis, 0.5 * sides[axis], Some(radius).filter(|r| *r > 0.0)?)
        }
        _ => return None,
    };
    let at = |key: &str| match collision.child("origin").and_then(|o| o.attribute(key)) {
        Some(text) => numbers(text),
        None => Some([0.0; 3]),
    };
    let (origin, rotation) = (at("xyz")?, of_roll_pitch_yaw(&at("rpy")?));
    let end = |along: f64| {
        let mut end = [0.0; 3];
        end[axis] = along;
        add(&origin, &turn(&rotation, &end))
    };
    Some(Shape::Within([end(-half), end(half)], radius))
}

fn numbers(text: &str) -> Option<Vector> {
    let numbers: Option<Vec<f64>> = text
        .split_whitespace()
        .map(|word| word.parse().ok().filter(|x| is_usable(*x)))
        .collect();
    numbers?.try_into().ok()
}
