//! What effects see: a motion, and what the model as it stands makes of it.

use std::sync::OnceLock;

use super::EffectPlace;
use crate::motion::Stretch;
use crate::robot::Robot;
use crate::robot::model::JointFriction;

/// Along one stretch: the motion, and what the model as it stands makes of it.
pub struct EffectScene<'a> {
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

impl EffectScene<'_> {
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

/// One sample of a scene, as the law of an effect at a place sees it.
#[derive(Clone, Copy)]
pub(super) struct Instant<'a> {
    pub scene: &'a EffectScene<'a>,
    pub place: EffectPlace,
    pub shape: &'a [f64],
    /// The joint whose row is filled; that of the place where it is one joint.
    pub joint: usize,
    pub k: usize,
}

impl Instant<'_> {
    pub fn q(&self) -> f64 {
        self.scene.stretch.q[self.joint][self.k]
    }

    pub fn v(&self) -> f64 {
        self.scene.stretch.v[self.joint][self.k]
    }

    pub fn a(&self) -> f64 {
        self.scene.stretch.a[self.joint][self.k]
    }

    pub fn load(&self) -> f64 {
        self.scene.load[self.joint][self.k]
    }

    pub fn direction(&self) -> f64 {
        self.scene.direction(self.joint, self.k)
    }

    /// Since the begin of the log [s].
    pub fn time(&self) -> f64 {
        let s = self.scene.stretch;
        s.began + s.dt * self.k as f64
    }

    /// Position, speed and acceleration of all joints, of which there are at most N.
    pub fn state<const N: usize>(&self) -> [[f64; N]; 3] {
        let mut state = [[0.0; N]; 3];
        let [q, v, a] = &mut state;
        self.scene.stretch.at(self.k, q, v, a);
        state
    }
}
