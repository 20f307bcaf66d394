//! What stands in the laboratory whatever its parameters are: joints, motors, encoders, limits.

use std::collections::BTreeMap;

use super::SimulateError;
use cft_ident_core::robot::practice::OperatingDefaults;
use cft_ident_core::robot::{JointKind, Robot};
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::robot_file::CoordinateLimits;

/// Half a travel where no limits are known \[m or rad\].
const HALF_TRAVEL: f64 = 1.0;

/// A robot of n joints that n motors drive, in vectors with room for J >= n. What is beyond n is 0 in every
/// vector, and without limits.
#[derive(Debug, Clone)]
pub struct Mechanism<const J: usize> {
    pub robot: Robot,
    /// Lower and upper limit of the motors' coordinates \[m or rad\].
    pub lower: [f64; J],
    pub upper: [f64; J],
    /// One encoder count of each motor's coordinate \[m or rad\]; 0 for a perfect encoder.
    pub resolution: [f64; J],
    /// Torque per volt where the motors are at the joints and their amplifiers are known; else 1.
    pub gain: [f64; J],
    /// How it is run, where more is known than its file says.
    pub practice: Option<OperatingDefaults>,
    /// `[limits]` of the file, by name.
    pub given: BTreeMap<String, CoordinateLimits>,
}

impl<const J: usize> Mechanism<J> {
    /// A robot with the limits and encoders that are known without its file.
    pub fn new(robot: Robot) -> Result<Self, SimulateError> {
        let n = robot.joints();
        if n > J {
            return Err(SimulateError::TooManyJoints { joints: n, most: J });
        }
        let mut mechanism = Self {
            lower: [f64::NEG_INFINITY; J],
            upper: [f64::INFINITY; J],
            resolution: [0.0; J],
            gain: [1.0; J],
            practice: robot.practice(),
            given: BTreeMap::new(),
            robot,
        };
        let transmission = mechanism.robot.transmission();
        if let Some(limits) = transmission.limits() {
            mechanism.lower[..n].copy_from_slice(&limits.lower);
            mechanism.upper[..n].copy_from_slice(&limits.upper);
        }
        if let Some(steps) = transmission.encoder_steps() {
            mechanism.resolution[..n].copy_from_slice(steps);
        }
        Ok(mechanism)
    }

    /// The robot of a file: `[limits] position` where it has them, and `[noise.joint] position_resolution`
    /// where the encoders are not known without it.
    pub fn of(file: &RobotFile) -> Result<Self, SimulateError> {
        let mut mechanism = Self::new(file.robot())?;
        let known = mechanism.robot.transmission().encoder_steps().is_some();
        for (i, name) in mechanism.robot.coordinate_names().iter().enumerate() {
            if let Some([lower, upper]) = file.limits.get(name).and_then(|l| l.position) {
                (mechanism.lower[i], mechanism.upper[i]) = (lower, upper);
            }
            let noise = file.noise.joint.get(name).filter(|_| !known);
            if let Some(step) = noise.and_then(|noise| noise.position_resolution) {
                mechanism.resolution[i] = step;
            }
        }
        mechanism.given.clone_from(&file.limits.of);
        Ok(mechanism)
    }

    /// Number of joints n.
    #[inline]
    pub fn joints(&self) -> usize {
        self.robot.joints()
    }

    /// Whether joint i turns.
    pub fn turns(&self, i: usize) -> bool {
        self.robot.joint_kind(i) == JointKind::Revolute
    }

    /// Whether the motors sit at the joints, so that their coordinates are the joints' own.
    pub fn motors_at_joints(&self) -> bool {
        self.robot.transmission().coordinates().is_none()
    }

    /// Refusal of a start whose coordinate i is outside its limits.
    pub(super) fn beyond_at_start(&self, i: usize, value: f64) -> SimulateError {
        SimulateError::LimitAtStart {
            coordinate: self.robot.coordinate_names().swap_remove(i),
            value,
            lower: self.lower[i],
            upper: self.upper[i],
        }
    }

    /// Limits of a motor's coordinate, or a metre and a radian about zero.
    pub fn travel(&self, i: usize) -> (f64, f64) {
        let (low, high) = (self.lower[i], self.upper[i]);
        if low.is_finite() && high.is_finite() {
            (low, high)
        } else {
            (-HALF_TRAVEL, HALF_TRAVEL)
        }
    }

    /// Motors' coordinates in the middle of their travels.
    pub fn middle(&self) -> [f64; J] {
        self.filled(|i| {
            let (low, high) = self.travel(i);
            0.5 * (low + high)
        })
    }

    /// A vector of n values, 0 beyond.
    pub fn filled(&self, value: impl Fn(usize) -> f64) -> [f64; J] {
        let n = self.joints();
        std::array::from_fn(|i| if i < n { value(i) } else { 0.0 })
    }

    /// A vector of n numbers that somebody gives; `None` where they are not n.
    pub fn widened(&self, given: &[f64], beyond: f64) -> Option<[f64; J]> {
        let mut out = [beyond; J];
        out.get_mut(..self.joints())
            .filter(|out| out.len() == given.len())?
            .copy_from_slice(given);
        Some(out)
    }

    /// Motors' coordinates of the joints q.
    pub fn coordinates(&self, q: &[f64; J]) -> [f64; J] {
        let (n, mut x) = (self.joints(), [0.0; J]);
        self.robot.transmission().positions(&q[..n], &mut x[..n]);
        x
    }

    /// Speeds of the motors' coordinates.
    pub fn coordinate_speeds(&self, q: &[f64; J], v: &[f64; J]) -> [f64; J] {
        let (n, mut xd) = (self.joints(), [0.0; J]);
        let transmission = self.robot.transmission();
        transmission.velocities(&q[..n], &v[..n], &mut xd[..n]);
        xd
    }

    /// Joints of the motors' coordinates x.
    ///
    /// # Errors
    /// [`SimulateError::Robot`] where no pose belongs to them.
    pub fn pose(&self, x: &[f64; J]) -> Result<[f64; J], SimulateError> {
        let (n, mut q) = (self.joints(), [0.0; J]);
        self.robot.transmission().joints(&x[..n], &mut q[..n])?;
        Ok(q)
    }

    /// Joint speeds at the pose q of the motors' speeds.
    pub(super) fn joint_speeds(
        &self,
        q: &[f64; J],
        xd: &[f64; J],
    ) -> Result<[f64; J], SimulateError> {
        let (n, mut v) = (self.joints(), [0.0; J]);
        let transmission = self.robot.transmission();
        transmission.joint_velocities(&q[..n], &xd[..n], &mut v[..n])?;
        Ok(v)
    }

    /// Joint torques of the volts at the pose q, eq. (66).
    #[inline]
    pub fn torque(&self, q: &[f64; J], volts: &[f64; J]) -> [f64; J] {
        let (n, mut tau) = (self.joints(), [0.0; J]);
        let driving: [f64; J] = std::array::from_fn(|i| self.gain[i] * volts[i]);
        let transmission = self.robot.transmission();
        transmission.torques(&q[..n], &driving[..n], &mut tau[..n]);
        tau
    }

    /// Volts that give the joint torques at the pose q, eq. (65).
    ///
    /// # Errors
    /// [`SimulateError::Robot`] where the pose is singular.
    pub fn volts(&self, q: &[f64; J], torque: &[f64; J]) -> Result<[f64; J], SimulateError> {
        let (n, mut volts) = (self.joints(), [0.0; J]);
        let transmission = self.robot.transmission();
        transmission.volts(&q[..n], &torque[..n], &mut volts[..n])?;
        Ok(std::array::from_fn(|i| volts[i] / self.gain[i]))
    }
}
