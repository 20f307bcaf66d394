//! What the writers into a user's own file have in common: whether a link stands there where the model has it, and what is
//! left of a link's body without the branches that hang on it there.

use super::arm::{ArmJoint, ArmLink};
use super::prepared::words;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::standard::{Body, COMPUTED, STANDARD};
use cft_ident_core::robot::tree::space::{
    Rotation, UNTURNED, Vector, add, cross, dot, product, times, turn,
};

/// Numbers of frames that differ by less are one: such files have six digits.
const SIX_DIGITS: f64 = 2e-5;

/// Mass \[kg\] and inertia \[kg m^2\] of a body that is to weigh nothing and must weigh something: MuJoCo refuses a body on a
/// joint whose mass or inertia is below 1e-15, and a ten-thousandth of the torque of a finger of a gram is more than these
/// give. Half or twice is nothing to either.
pub(super) const NEGLIGIBLE: Body = Body {
    mass: 1e-9,
    centre: [0.0; 3],
    inertia: [1e-13, 0.0, 0.0, 1e-13, 0.0, 1e-13],
};

/// A pose: rotation, then origin \[m\].
pub(super) type Pose = (Rotation, Vector);

pub(super) const HERE: Pose = (UNTURNED, [0.0; 3]);

/// The pose of `inner` where `outer` stands.
pub(super) fn composed(outer: &Pose, inner: &Pose) -> Pose {
    let origin = add(&outer.1, &turn(&outer.0, &inner.1));
    (product(&outer.0, &inner.0), origin)
}

/// A link of a source, by the joint before it.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceLink {
    /// Name there of the link or body.
    pub name: String,
    /// Place of the link before it among the model's.
    pub parent: Option<usize>,
    pub kind: JointKind,
    /// Its frame in that of the link before.
    pub rotation: Rotation,
    pub origin: Vector,
    pub axis: Vector,
    /// A point of the axis in its frame \[m\].
    pub point: Vector,
    /// Name there of its joint, where one moves it.
    pub joint: Option<String>,
}

/// In what a link of the model and that of the source differ, in words. Where the base of the robot stands is no matter, how
/// it is turned is.
pub(super) fn difference(link: &ArmLink, there: &SourceLink) -> Option<String> {
    if there.parent != link.parent {
        return Some("it hangs on another link".to_owned());
    }
    if there.kind != link.kind && there.joint.is_some() {
        return Some("the one joint slides and the other turns".to_owned());
    }
    let off = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > SIX_DIGITS);
    let (rotation, origin) = match &link.joint {
        ArmJoint::Fixed => standing(link, there),
        _ => (there.rotation, there.origin),
    };
    if link.parent.is_some() && off(&link.origin, &origin) {
        let [a, b] = [words(&origin), words(&link.origin)];
        return Some(format!("its origin is {a} m and not {b} m"));
    }
    if (0..3).any(|i| off(&link.rotation[i], &rotation[i])) {
        return Some("its frame is turned otherwise".to_owned());
    }
    let beside = cross(&there.axis, &there.point);
    if off(&[0.0; 3], &beside) {
        let point = words(&there.point);
        return Some(format!(
            "its axis goes through {point} m of its frame and not through the origin"
        ));
    }
    let moves = !matches!(link.joint, ArmJoint::Fixed);
    (moves && off(&link.axis, &there.axis)).then(|| {
        let [a, b] = [words(&there.axis), words(&link.axis)];
        format!("its axis is {a} and not {b}")
    })
}

/// The frame of a link whose joint the model holds still, at the position that it has there.
fn standing(link: &ArmLink, there: &SourceLink) -> Pose {
    let at = rest(link, there);
    displaced(&(there.rotation, there.origin), there.kind, &there.axis, at)
}

/// A frame behind a joint at a position.
pub(super) fn displaced(frame: &Pose, kind: JointKind, axis: &Vector, at: f64) -> Pose {
    use cft_ident_core::robot::tree::space::about;
    match kind {
        JointKind::Revolute => (product(&frame.0, &about(axis, at)), frame.1),
        JointKind::Prismatic => (frame.0, add(&frame.1, &turn(&frame.0, &times(at, axis)))),
    }
}

/// Position at which a joint that the model holds still puts its link where the model has it, as nearly as it can.
pub(super) fn rest(link: &ArmLink, there: &SourceLink) -> f64 {
    let axis = &there.axis;
    if there.joint.is_none() {
        return 0.0;
    }
    match there.kind {
        JointKind::Prismatic => {
            let way: Vector = std::array::from_fn(|k| link.origin[k] - there.origin[k]);
            dot(&turn(&there.rotation, axis), &way)
        }
        JointKind::Revolute => {
            // a vector across the axis, and where the turn takes it
            let least = (0..3).min_by(|a, b| axis[*a].abs().total_cmp(&axis[*b].abs()));
            let mut helper = [0.0; 3];
            helper[least.unwrap_or(0)] = 1.0;
            let across = cross(axis, &helper);
            let [before, after] = [&there.rotation, &link.rotation].map(|r| turn(r, &across));
            let about = turn(&there.rotation, axis);
            dot(&about, &cross(&before, &after)).atan2(dot(&before, &after))
        }
    }
}

/// A body as it is seen from the frame in which its own has this pose.
pub(super) fn seen_from(body: &Body, pose: &Pose) -> Body {
    let [xx, xy, xz, yy, yz, zz] = body.inertia;
    let tensor = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let r = &pose.0;
    let transposed = std::array::from_fn(|i| std::array::from_fn(|j| r[j][i]));
    let t = product(&product(r, &tensor), &transposed);
    Body {
        mass: body.mass,
        centre: add(&pose.1, &turn(r, &body.centre)),
        inertia: [t[0][0], t[0][1], t[0][2], t[1][1], t[1][2], t[2][2]],
    }
}

/// What is left of a body without others, all in its frame; none where that is no body.
pub(super) fn without(body: &Body, others: &[Body]) -> Option<Body> {
    let mut rest: [f64; STANDARD] = body.standard();
    for other in others {
        for (x, of_other) in rest.iter_mut().zip(other.standard()) {
            *x -= of_other;
        }
    }
    let rest = Body::of(&rest);
    // one that is only made a body by being made thicker is another one
    rest.physical(COMPUTED).filter(|body| *body == rest)
}
