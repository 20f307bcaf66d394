//! What a search of the set-up comes to.

use super::condition::SetupCondition;
use super::correction::{Change, Correction};
use super::estimate::SetupEstimate;
use super::physics::Driven;
use super::undecided::Undecided;
use super::undelivered::UndeliveredTorque;
use super::weight::Weight;

/// A mistake, with the errors of every joint on blocks left out.
#[derive(Debug, Clone)]
pub struct Found {
    pub change: Change,
    /// As declared, and put right; not finite where the declared positions belong to no pose.
    pub errors: [Vec<f64>; 2],
    /// Beyond doubt, all conditions hold: a fit refuses the logs.
    pub sure: bool,
    /// By what that is decided.
    pub conditions: Vec<SetupCondition>,
    /// Readings that fit alike are of other joints: these data cannot tell.
    pub open: bool,
    /// Other readings that these data do not distinguish from it.
    pub tied: Vec<Change>,
    /// Joints of them that move in proportion.
    pub together: Option<[usize; 2]>,
    /// Joints that are beyond the limits of the file as declared, where that is what shows it.
    pub beyond_limits: Vec<usize>,
}

/// What a search found.
#[derive(Debug, Clone, Default)]
pub struct Searched {
    pub found: Vec<Found>,
    /// All that is sure, together.
    pub correction: Option<Correction>,
    /// Joints whose friction drives them, where no mistake explains it.
    pub driven: Vec<Driven>,
    /// A value that is on no list, with the errors as declared and with it.
    pub estimate: Option<(SetupEstimate, [Vec<f64>; 2])>,
    /// Errors with gravity and without, where the torques hold none.
    pub without_gravity: Option<[Vec<f64>; 2]>,
    /// Gain of the measured weight over that of the file's own masses.
    pub weights: Vec<Weight>,
    /// Joints that miss much, and no mistake that repairs them.
    pub undecided: Vec<Undecided>,
    /// Joints whose torque was asked for and not delivered, where no mistake explains them.
    pub undelivered: Vec<UndeliveredTorque>,
}
