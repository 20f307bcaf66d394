//! The parts of `[robot]` that describe a serial chain: `[[robot.link]]` and `[[robot.coupling]]`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::standard::Body;

/// Name of the frame that does not move.
pub(super) const BASE: &str = "base";

/// Most links that are gathered, of a URDF those that move; what a robot may have is fewer, and told by the chain.
pub(super) const MOST_LINKS: usize = 200;

/// A sine in a dependent coordinate: amplitude sin(phase + sum of `of`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SineSection {
    /// \[m or rad\]
    pub amplitude: f64,
    /// \[rad\]
    #[serde(default)]
    pub phase: f64,
    /// Coefficient of each independent joint.
    pub of: BTreeMap<String, f64>,
}

/// A coordinate that follows the independent joints, as a URDF mimic joint or a linkage does.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FollowsSection {
    /// Constant part [m or rad].
    #[serde(default)]
    pub offset: f64,
    /// Coefficient of each independent joint.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub linear: BTreeMap<String, f64>,
    /// Sines of combinations of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sine: Vec<SineSection>,
}

/// What a drawing or a URDF says of a link's mass: a prior, never taken for the answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InertialSection {
    /// \[kg\]
    pub mass: f64,
    /// Centre of gravity in the link's frame \[m\].
    pub centre: [f64; 3],
    /// Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the centre of gravity, along the link's axes \[kg m^2\].
    pub inertia: [f64; 6],
}

impl InertialSection {
    /// The same as the physical model has it.
    pub fn body(&self) -> Body {
        Body {
            mass: self.mass,
            centre: self.centre,
            inertia: self.inertia,
        }
    }
}

/// One moving link and the joint before it: a modified Denavit-Hartenberg row (`a`, `alpha`, `d`,
/// `theta`) or a URDF origin (`xyz`, `rpy`, `axis`).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkSection {
    /// Name of the link; `link_1`, `link_2`, ... where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Name of the link that it hangs on, or `base`; the link before it where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parent: Option<String>,
    /// Name of the independent joint that moves it; absent for a link that follows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Revolute where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<JointKind>,
    /// a_(i-1) \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub a: Option<f64>,
    /// alpha_(i-1) \[rad\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f64>,
    /// d_i \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub d: Option<f64>,
    /// Angle at q = 0 \[rad\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theta: Option<f64>,
    /// Position of the joint in the parent's frame \[m\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub xyz: Option<[f64; 3]>,
    /// Roll, pitch and yaw of the joint in the parent's frame \[rad\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rpy: Option<[f64; 3]>,
    /// Axis of the joint in its own frame; z where absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub axis: Option<[f64; 3]>,
    /// The coordinate of a link that follows others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub follows: Option<FollowsSection>,
    /// Prior of its mass properties.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertial: Option<InertialSection>,
}

/// A frame that is fixed to a moving link and carries nothing: a flange, a tool, a camera.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrameSection {
    /// Name of the frame.
    pub name: String,
    /// Name of the link that it is fixed to.
    pub link: String,
    /// Position in the link's frame \[m\].
    #[serde(default)]
    pub xyz: [f64; 3],
    /// Roll, pitch and yaw in the link's frame \[rad\].
    #[serde(default)]
    pub rpy: [f64; 3],
}

/// Two joints whose gear trains are coupled: the motor of the first turns with the second too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CouplingSection {
    /// Joint whose motor it is.
    pub motor: String,
    /// Joint that turns this motor too.
    pub other: String,
    /// Turns of the motor (in units of its own joint) per turn of the other joint.
    pub ratio: f64,
}
