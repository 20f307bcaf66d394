//! Collision shapes of a URDF.

use super::xml::Element;
use cft_ident_core::number::is_usable;
use cft_ident_core::robot::tree::enclosing::EnclosedPiece;
use cft_ident_core::robot::tree::space::{Rotation, Vector, add, of_roll_pitch_yaw, product, turn};

/// A shape in the frame of its link.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LinkShape {
    pub form: ShapeForm,
    pub rotation: Rotation,
    pub origin: Vector,
}

/// What a shape is: a box around it, or the name of a mesh with its scale.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum ShapeForm {
    /// A capsule that holds it.
    Within(EnclosedPiece),
    /// The mesh of a file, as the URDF names it, and the factors of its coordinates.
    Mesh(String, Vector),
}

impl LinkShape {
    /// The same shape seen from a frame in which its own lies so.
    pub(super) fn seen_from(&self, rotation: &Rotation, origin: &Vector) -> Self {
        Self {
            form: self.form.clone(),
            rotation: product(rotation, &self.rotation),
            origin: add(origin, &turn(rotation, &self.origin)),
        }
    }

    /// Where a point of the shape's own frame is.
    pub(super) fn place(&self, point: &Vector) -> Vector {
        add(&self.origin, &turn(&self.rotation, point))
    }
}

/// The shapes of a `<link>`; `None` for one that cannot be read: collision shapes decide no torque, and spoil no file.
pub(super) fn of_link(link: Element) -> Vec<Option<LinkShape>> {
    let collisions = link.children().filter(|c| c.name() == "collision");
    collisions.map(shape).collect()
}

fn shape(collision: Element) -> Option<LinkShape> {
    let at = |key: &str| match collision.child("origin").and_then(|o| o.attribute(key)) {
        Some(text) => numbers(text),
        None => Some([0.0; 3]),
    };
    Some(LinkShape {
        form: form(collision.child("geometry")?.children().next()?)?,
        rotation: of_roll_pitch_yaw(&at("rpy")?),
        origin: at("xyz")?,
    })
}

fn form(shape: Element) -> Option<ShapeForm> {
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
        "mesh" => {
            let scale = shape.attribute("scale").map_or(Some([1.0; 3]), numbers);
            return Some(ShapeForm::Mesh(
                shape.attribute("filename")?.to_owned(),
                scale?,
            ));
        }
        _ => return None,
    };
    let end = |along: f64| {
        let mut end = [0.0; 3];
        end[axis] = along;
        end
    };
    Some(ShapeForm::Within(([end(-half), end(half)], radius)))
}

/// The three numbers of a text.
pub(super) fn numbers(text: &str) -> Option<Vector> {
    let numbers: Option<Vec<f64>> = text
        .split_whitespace()
        .map(|word| word.parse().ok().filter(|x| is_usable(*x)))
        .collect();
    numbers?.try_into().ok()
}
