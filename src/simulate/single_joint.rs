//! One joint with a constant inertia as a plant: tau = inertia a + F(v) + offset.

use super::SimulateError;
use super::plant::Plant;
use crate::robot::JointKind;
use crate::robot::friction::{DoubleTanh, ViscousCoulomb};

/// Friction law of a simulated single joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SingleJointFriction {
    /// Law (18).
    DoubleTanh(DoubleTanh),
    /// Fv v + Fc sgn(v). At zero speed the jump is replaced by tanh(w v), w = `steepness` in s/m or
    /// s/rad: a differential equation with a jump has no solution at rest.
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

impl SingleJointTruth {
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

impl SingleJointFriction {
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
    fn dynamics(&self, _q: &[f64; 1], v: &[f64; 1]) -> ([[f64; 1]; 1], [f64; 1]) {
        ([[self.inertia]], [self.friction.torque(v[0]) + self.offset])
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
