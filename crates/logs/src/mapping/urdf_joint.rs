//! What a URDF says of a joint.

use cft_ident_core::robot::JointKind;

/// A joint of the robot, where a URDF names it.
#[derive(Debug, Clone, PartialEq)]
pub struct UrdfJoint {
    pub name: String,
    pub kind: JointKind,
    /// Its largest torque [N or Nm].
    pub torque: Option<f64>,
    /// Its least and its greatest position [m or rad].
    pub position: Option<[f64; 2]>,
}
