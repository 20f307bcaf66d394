//! One joint with a constant inertia: tau = inertia a + F(v) + offset.

use super::SimulateError;
use super::effects::{EffectSpec, EffectValue, PlantEffects, RobotSites};
use super::joint_friction::SmoothFriction;
use super::mechanism::Mechanism;
use super::plant::Plant;
use cft_ident_core::robot::{JointKind, Robot};

/// The true parameters of a simulated single joint.
#[derive(Debug, Clone, PartialEq)]
pub struct SingleJointTruth {
    pub name: String,
    pub kind: JointKind,
    /// kg or kg m^2.
    pub inertia: f64,
    pub friction: SmoothFriction,
    /// Constant torque that the motor must supply, N or N m.
    pub offset: f64,
    /// Torque per volt, N/V or N m/V.
    pub gain: f64,
    /// One encoder count, m or rad; 0 for a perfect encoder.
    pub resolution: f64,
    /// Lower and upper end of the travel, m or rad.
    pub limits: (f64, f64),
}

/// The effects on a single joint.
pub fn effects(
    truth: &SingleJointTruth,
    specs: &[EffectSpec],
) -> Result<(PlantEffects, Vec<EffectValue>), SimulateError> {
    PlantEffects::build(specs, &RobotSites::of(&truth.plant()?)?)
}

impl SingleJointTruth {
    /// The plant.
    pub fn plant(&self) -> Result<Plant<1>, SimulateError> {
        let mut mechanism = Mechanism::new(Robot::single_joint(self.name.clone(), self.kind))?;
        ([mechanism.lower[0], mechanism.upper[0]]) = [self.limits.0, self.limits.1];
        (mechanism.resolution, mechanism.gain) = ([self.resolution], [self.gain]);
        Plant::new(
            mechanism,
            &[self.inertia],
            |_, _| self.friction,
            [self.offset],
        )
    }
}
