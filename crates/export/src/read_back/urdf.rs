//! A URDF as a mechanism: links on joints, mimic joints, `<dynamics>`.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use super::mechanism::{ReadBody, ReadJoint, ReadMechanism};
use super::{ReadError, filled, named, tensor, unit};
use cft_ident_files::config::xml::{Element, XmlTree, without_comments};

/// Reads the text of a URDF; no URDF says gravity.
///
/// # Errors
/// What is not understood.
pub fn read(text: &str, gravity: [f64; 3]) -> Result<ReadMechanism, ReadError> {
    let plain = without_comments(text);
    let tree = XmlTree::parse(&plain).map_err(|wrong| ReadError::new(wrong.problem.to_string()))?;
    let children: Vec<Element> = tree.root().children().collect();
    let all = |kind: &'static str| children.iter().filter(move |e| e.name() == kind);
    let mut out = ReadMechanism {
        gravity: Vector3::from(gravity),
        ..ReadMechanism::default()
    };
    // links without a joint before them first, then what hangs on them
    let mut waiting: Vec<(Option<usize>, Option<Element>, &str)> = Vec::new();
    for link in all("link") {
        let name = named(link, "name")?;
        let carried = all("joint").any(|joint| linked(joint, "child") == Some(name));
        if !carried {
            waiting.push((None, None, name));
        }
    }
    while let Some((parent, joint, name)) = waiting.pop() {
        if out.bodies.len() > children.len() {
            return Err(ReadError::new("links hang on each other in a circle"));
        }
        let link = all("link").find(|link| link.attribute("name") == Some(name));
        out.bodies.push(body(link, joint, parent, name)?);
        let place = out.bodies.len() - 1;
        for behind in all("joint").filter(|j| linked(j, "parent") == Some(name)) {
            let child = linked(behind, "child");
            let child = child.ok_or_else(|| ReadError::new("a joint without a child"))?;
            waiting.push((Some(place), Some(*behind), child));
        }
    }
    Ok(out)
}

fn linked<'a>(joint: &Element<'a, '_>, end: &str) -> Option<&'a str> {
    joint.child(end)?.attribute("link")
}

fn origin(of: Element) -> Result<Isometry3<f64>, ReadError> {
    let at = of.child("origin");
    let value = |key| filled(at.and_then(|origin| origin.attribute(key)), [0.0; 3]);
    let ([x, y, z], [roll, pitch, yaw]) = (value("xyz")?, value("rpy")?);
    Ok(Isometry3::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    ))
}

fn body(
    link: Option<&Element>,
    joint: Option<Element>,
    parent: Option<usize>,
    name: &str,
) -> Result<ReadBody, ReadError> {
    let mut out = ReadBody {
        name: name.to_owned(),
        parent,
        place: joint.map_or(Ok(Isometry3::identity()), origin)?,
        joints: Vec::new(),
        mass: 0.0,
        centre: Vector3::zeros(),
        inertia: Matrix3::zeros(),
        weightless: 0.0,
    };
    if let Some(inertial) = link.and_then(|link| link.child("inertial")) {
        let at = origin(inertial)?;
        let number = |part: &str, key: &str| {
            let text = inertial.child(part).and_then(|part| part.attribute(key));
            Ok::<f64, ReadError>(filled(text, [0.0])?[0])
        };
        let mut moments = [0.0; 6];
        for (x, key) in moments
            .iter_mut()
            .zip(["ixx", "iyy", "izz", "ixy", "ixz", "iyz"])
        {
            *x = number("inertia", key)?;
        }
        let turn = at.rotation.to_rotation_matrix();
        out.mass = number("mass", "value")?;
        out.centre = at.translation.vector;
        out.inertia = turn.matrix() * tensor(moments) * turn.matrix().transpose();
    }
    let Some(joint) = joint else {
        return Ok(out);
    };
    let kind = named(&joint, "type")?;
    // what floats stands still here
    if !matches!(kind, "revolute" | "continuous" | "prismatic") {
        return Ok(out);
    }
    let of = |part: &str, key: &str| joint.child(part).and_then(|part| part.attribute(key));
    let mimic = match of("mimic", "joint") {
        None => None,
        Some(master) => {
            let [factor] = filled(of("mimic", "multiplier"), [1.0])?;
            let [offset] = filled(of("mimic", "offset"), [0.0])?;
            Some((master.to_owned(), [offset, factor, 0.0, 0.0, 0.0]))
        }
    };
    let [damping] = filled(of("dynamics", "damping"), [0.0])?;
    let [friction] = filled(of("dynamics", "friction"), [0.0])?;
    out.joints.push(ReadJoint {
        name: named(&joint, "name")?.to_owned(),
        slides: kind == "prismatic",
        axis: unit(of("axis", "xyz"), [1.0, 0.0, 0.0])?,
        point: Vector3::zeros(),
        reference: 0.0,
        armature: 0.0,
        damping: [damping, 0.0, 0.0],
        friction,
        stiffness: [0.0; 3],
        rest: 0.0,
        follows: mimic,
    });
    Ok(out)
}
