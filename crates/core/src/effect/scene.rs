//! What effects see: a motion, and what the model as it stands makes of it.

use std::sync::OnceLock;

use crate::motion::Stretch;
use crate::robot::Robot;
use crate::robot::model::JointFriction;

/// Along one stretch: the motion, and what the model as it stands makes of it.
pub struct Scene<'a> {
    pub robot: &'a Robot,
    pub theta: &'a [f64],
    pub laws: &'a [JointFriction],
    pub stretch: &'a Stretch,
    /// Reconstructed torque per joint, effects included, timing effects not [N or Nm].
    pub hat: &'a [Vec<f64>],
    /// Load torque per joint: the reconstructed torque less friction and offset.
    pub load: &'a [Vec<f64>],
    /// Direction of each joint's friction; empty where it is that of its law.
    pub direction: &'a [Vec<f64>],
    /// Keeps what gravity along the base's x and y does on all joints, once an effect asks for it; none where
    /// samples come one by one.
    pub tilt: Option<&'a TiltTorques>,
}

/// Torques of a gravity of one along the base's x and along its y, `[direction][joint][sample]`
/// \[N or N m per m/s^2\].
pub type TiltTorques = OnceLock<[Vec<Vec<f64>>; 2]>;

impl Scene<'_> {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.stretch.len()
    }

    /// Whether the stretch holds no sample.
    pub fn is_empty(&self) -> bool {
        self.stretch.is_empty()
    }

    /// Saturating part of a joint's friction over its level at sample k: -1 and 1 at speed, between them as smooth
    /// as the declared law, or as what was added to make it smooth.
    #[inline]
    pub fn direction(&self, j: usize, k: usize) -> f64 {
        let known = self.direction.get(j).and_then(|d| d.get(k)).copied();
        known.unwrap_or_else(|| self.laws[j].direction(self.stretch.v[j][k]))
    }
}
