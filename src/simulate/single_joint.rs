//! One joint with a constant inertia as a plant: tau = inertia a + F(v) + offset.

use super::SimulateError;
use super::controller::Control;
use super::effects::{EffectSpec, EffectValue, Effects, Sites};
use super::plant::Plant;
use crate::robot::JointKind;
use crate::robot::friction::{DoubleTanh, ViscousCoulomb};

/// Friction law of a simulated single joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SingleJointFriction {
    /// Law (18).
    DoubleTanh(DoubleTanh),
    /// Fv v + Fc sgn(v), with tanh(w v) in the place of the sign, w = `steepness` in s/m or s/rad: a
    /// differential equation with a jump has no solution at rest.
    ViscousCoulomb { law: ViscousCoulomb, steepness: f64 },
}

/// The true parameters of a simulated single joint.
#[derive(Debug, Clone, PartialEq)]
pub struct SingleJointTruth {
    pub name: String,
    pub kind: JointKind,
    /// kg or kg m^2.
    pub inertia: f64,
    pub friction: SingleJointFriction,
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
///
/// # Errors
/// As [`Effects::build`].
pub fn effects(
    truth: &SingleJointTruth,
    specs: &[EffectSpec],
) -> Result<(Effects, Vec<EffectValue>), SimulateError> {
    Effects::build(specs, &Sites::single_joint(truth))
}

impl SingleJointTruth {
    /// Gains that hold and track well at 1 kHz.
    pub fn control(&self) -> Control<1> {
        let stiffness = self.inertia * FREQUENCY * FREQUENCY / self.gain;
        Control {
            proportional: [stiffness],
            derivative: [2.0 * DAMPING / FREQUENCY * stiffness],
            filter_hz: 50.0,
        }
    }

    /// # Errors
    /// [`SimulateError::Parameter`] for the first number that no joint can have.
    pub fn check(&self) -> Result<(), SimulateError> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let (low, high) = self.limits;
        let friction = match self.friction {
            SingleJointFriction::DoubleTanh(law) => law.parameters().iter().all(|x| x.is_finite()),
            SingleJointFriction::ViscousCoulomb { law, steepness } => {
                law.viscous.is_finite() && law.coulomb.is_finite() && positive(steepness)
            }
        };
        let findings = [
            (
                positive(self.inertia),
                "inertia",
                self.inertia,
                "must be above 0",
            ),
            (friction, "friction", f64::NAN, "must be finite"),
            (
                self.offset.is_finite(),
                "offset",
                self.offset,
                "must be finite",
            ),
            (positive(self.gain), "gain", self.gain, "must be above 0"),
            (
                self.resolution >= 0.0,
                "resolution",
                self.resolution,
                "must be 0 or more",
            ),
            (
                low < high,
                "lower limit",
                low,
                "must lie below the upper limit",
            ),
        ];
        for (good, name, value, rule) in findings {
            if !good {
                return Err(SimulateError::Parameter { name, value, rule });
            }
        }
        Ok(())
    }
}

/// Rate at which a viscous-Coulomb joint comes to rest within its steep part: half a sample at 1 kHz
/// \[1/s\].
const REST_RATE: f64 = 2000.0;
/// Own frequency \[rad/s\] and damping of the joint under [`SingleJointTruth::control`].
const FREQUENCY: f64 = 45.0;
const DAMPING: f64 = 0.6;

impl SingleJointFriction {
    /// Viscous and Coulomb friction, as steep at rest as a 1 kHz log can resolve.
    pub fn viscous_coulomb(law: ViscousCoulomb, inertia: f64) -> Self {
        let steepness = if law.coulomb > 0.0 {
            REST_RATE * inertia / law.coulomb
        } else {
            1.0
        };
        Self::ViscousCoulomb { law, steepness }
    }

    /// F(v) in N or N m.
    #[inline]
    pub fn torque(&self, v: f64) -> f64 {
        match self {
            Self::DoubleTanh(law) => law.torque(v),
            Self::ViscousCoulomb { law, steepness } => {
                law.viscous * v + law.coulomb * (steepness * v).tanh()
            }
        }
    }
}

impl Plant<1> for SingleJointTruth {
    fn joint_names(&self) -> [String; 1] {
        [self.name.clone()]
    }

    fn coordinate_names(&self) -> [String; 1] {
        [self.name.clone()]
    }

    fn coordinates(&self, q: &[f64; 1]) -> [f64; 1] {
        *q
    }

    fn coordinate_speeds(&self, _q: &[f64; 1], v: &[f64; 1]) -> [f64; 1] {
        *v
    }

    fn joints(&self, x: &[f64; 1]) -> Result<[f64; 1], SimulateError> {
        Ok(*x)
    }

    fn joint_speeds(&self, _q: &[f64; 1], xd: &[f64; 1]) -> Result<[f64; 1], SimulateError> {
        Ok(*xd)
    }

    #[inline]
    fn torque(&self, _q: &[f64; 1], volts: &[f64; 1]) -> [f64; 1] {
        [self.gain * volts[0]]
    }

    fn volts(&self, _q: &[f64; 1], torque: &[f64; 1]) -> Result<[f64; 1], SimulateError> {
        Ok([torque[0] / self.gain])
    }

    #[inline]
    fn rigid(&self, _q: &[f64; 1], _v: &[f64; 1]) -> ([[f64; 1]; 1], [f64; 1]) {
        ([[self.inertia]], [0.0])
    }

    #[inline]
    fn offset(&self) -> [f64; 1] {
        [self.offset]
    }

    #[inline]
    fn friction(&self, v: &[f64; 1]) -> [f64; 1] {
        [self.friction.torque(v[0])]
    }

    #[inline]
    fn solve(&self, mass: &[[f64; 1]; 1], b: &[f64; 1]) -> Option<[f64; 1]> {
        (mass[0][0] > 0.0).then(|| [b[0] / mass[0][0]])
    }

    fn limits(&self) -> ([f64; 1], [f64; 1]) {
        ([self.limits.0], [self.limits.1])
    }

    fn resolution(&self) -> [f64; 1] {
        [self.resolution]
    }
}
