//! Where a link of a URDF sits: on which moving link, and behind which joints that stand still.

use super::parts::{Joint, UrdfJointKind, UrdfParts};
use cft_ident_core::robot::tree::space::{
    Rotation, UNTURNED, Vector, about, add, dot, of_roll_pitch_yaw, product, times, turn,
};

/// Where a link of the URDF is: in which moving link, and how it lies there.
#[derive(Clone, Copy)]
pub(super) struct LinkSeat {
    /// Index of the moving link; `None` for the base.
    pub on: Option<usize>,
    pub rotation: Rotation,
    pub origin: Vector,
    /// The rotation in the words of the file, where one joint alone says it.
    pub rpy: Option<Vector>,
    /// Whether a joint beside the chain carries it, which stands at 0 here.
    pub held: bool,
}

impl LinkSeat {
    /// In the frame of a moving link, or of the base.
    pub(super) fn at(on: Option<usize>) -> Self {
        Self {
            on,
            rotation: UNTURNED,
            origin: [0.0; 3],
            rpy: None,
            held: false,
        }
    }

    /// Behind a joint that stands at 0, or at its offset where it follows one that does.
    pub(super) fn behind_held(self, joint: &Joint) -> Self {
        let at = joint.mimic.as_ref().map_or(0.0, |mimic| mimic.offset);
        let size = dot(&joint.axis, &joint.axis).sqrt();
        let axis = times(1.0 / size.max(f64::MIN_POSITIVE), &joint.axis);
        let turned = product(&self.rotation, &of_roll_pitch_yaw(&joint.rpy));
        let origin = add(&self.origin, &turn(&self.rotation, &joint.xyz));
        let (rotation, origin) = match joint.kind {
            UrdfJointKind::Prismatic => (turned, add(&origin, &turn(&turned, &times(at, &axis)))),
            UrdfJointKind::Revolute | UrdfJointKind::Continuous => {
                (product(&turned, &about(&axis, at)), origin)
            }
            _ => (turned, origin),
        };
        Self {
            on: self.on,
            rotation,
            origin,
            rpy: None,
            held: true,
        }
    }
}

/// Whether a joint is beside a chain that ends at a tip: it moves, no joint of the chain moves it, and it stands at 0.
pub(super) fn is_held(
    joint: Option<usize>,
    parent: LinkSeat,
    moves: &[bool],
    parts: &UrdfParts,
) -> bool {
    let Some(j) = joint else { return false };
    if parent.held {
        return true;
    }
    // a follower of a joint of the chain moves with it
    let mut chased = &parts.joints[j];
    for _ in 0..parts.joints.len() {
        let is = |other: &&Joint| Some(&other.name) == chased.mimic.as_ref().map(|m| &m.joint);
        match parts.joints.iter().position(|other| is(&other)) {
            Some(master) if moves[master] => return false,
            Some(master) => chased = &parts.joints[master],
            None => break,
        }
    }
    !moves[j] && parts.joints[j].kind != UrdfJointKind::Fixed
}
