//! A serial robot as a plant: tau = Y(q, v, a) theta + F(v) + offset, solved for a.
//!
//! M(q) and C v + G come from the regressor with unit accelerations; its own test is Pinocchio's, in
//! fixtures/oracle. One volt stands for one unit of torque.

use super::SimulateError;
use super::controller::Control;
use super::effects::{Place, Site};
use super::plant::Plant;
use super::single_joint::{SingleJointFriction, SingleJointTruth};
use crate::robot::{JointKind, Robot};

/// The true parameters of a simulated serial robot of J joints.
#[derive(Debug, Clone)]
pub struct SerialTruth<const J: usize> {
    robot: Robot,
    theta: Vec<f64>,
    /// Per joint: friction, offset, limits, encoder; the inertia is M_jj in the middle of the limits.
    pub joints: [SingleJointTruth; J],
}

/// Poses at which the inertia matrix must be positive definite before anything is run.
const POSES: usize = 64;
/// Own frequency \[rad/s\] and damping of each joint under [`SerialTruth::control`].
const FREQUENCY: f64 = 30.0;
const DAMPING: f64 = 0.8;
/// Half a travel where no limits are known \[m or rad\].
const REACH: f64 = 1.0;

impl<const J: usize> SerialTruth<J> {
    /// The truth of a model: base parameters, and each joint's friction, offset and limits.
    ///
    /// # Errors
    /// [`SimulateError::NotPositiveDefinite`] with the pose, where the parameters are those of no body:
    /// an unconstrained fit can be so.
    pub fn new(
        robot: Robot,
        theta: Vec<f64>,
        mut joints: [SingleJointTruth; J],
        friction: impl Fn(usize, f64) -> SingleJointFriction,
    ) -> Result<Self, SimulateError> {
        let plain = Self {
            robot,
            theta,
            joints: joints.clone(),
        };
        for pose in 0..POSES {
            let q: [f64; J] = std::array::from_fn(|j| {
                // a Weyl sequence fills the box evenly; its first pose is the middle
                let share = (pose as f64 * (0.5 + j as f64).sqrt()).fract();
                let (low, high) = plain.travel(j);
                let middle = 0.5 * (low + high);
                middle + (share - if pose == 0 { 0.0 } else { 0.5 }) * (high - low)
            });
            let (mass, _) = plain.rigid(&q, &[0.0; J]);
            if plain.solve(&mass, &[1.0; J]).is_none() {
                return Err(SimulateError::NotPositiveDefinite { x: q.to_vec() });
            }
            if pose == 0 {
                for (j, joint) in joints.iter_mut().enumerate() {
                    joint.inertia = mass[j][j];
                    joint.friction = friction(j, mass[j][j]);
                }
            }
        }
        let truth = Self { joints, ..plain };
        for joint in &truth.joints {
            joint.check()?;
        }
        Ok(truth)
    }

    /// Limits of a joint, or one turn and a metre about zero.
    pub fn travel(&self, j: usize) -> (f64, f64) {
        let (low, high) = self.joints[j].limits;
        if low.is_finite() && high.is_finite() {
            (low, high)
        } else {
            (-REACH, REACH)
        }
    }

    /// Middle of every joint's travel.
    pub fn middle(&self) -> [f64; J] {
        std::array::from_fn(|j| {
            let (low, high) = self.travel(j);
            0.5 * (low + high)
        })
    }

    /// The robot with its base parameters.
    pub fn rigid_body(&self) -> (&Robot, &[f64]) {
        (&self.robot, &self.theta)
    }

    /// Gains that hold and track at 1 kHz, each joint by the inertia in the middle of the travel.
    pub fn control(&self) -> Control<J> {
        let stiffness = |j: usize| self.joints[j].inertia * FREQUENCY * FREQUENCY;
        Control {
            proportional: std::array::from_fn(stiffness),
            derivative: std::array::from_fn(|j| 2.0 * DAMPING / FREQUENCY * stiffness(j)),
            filter_hz: 100.0,
        }
    }

    /// Places where effects can sit: every joint.
    pub fn sites(&self) -> Vec<Site> {
        let joints = self.joints.iter().enumerate();
        joints
            .map(|(j, joint)| {
                let (coulomb, viscous) = match joint.friction {
                    SingleJointFriction::DoubleTanh(law) => {
                        (law.coulomb_1 + law.coulomb_2, law.viscous)
                    }
                    SingleJointFriction::ViscousCoulomb { law, .. } => (law.coulomb, law.viscous),
                };
                Site {
                    place: Place::Joint(j),
                    name: joint.name.clone(),
                    turns: joint.kind == JointKind::Revolute,
                    scale: joint.friction.torque(0.5).abs(),
                    speed: 0.5,
                    inertia: joint.inertia,
                    least_inertia: 0.3 * joint.inertia,
                    travel: self.travel(j),
                    coulomb,
                    viscous,
                }
            })
            .collect()
    }

    /// Y(q, v, a) theta.
    #[inline]
    fn inverse(&self, q: &[f64; J], v: &[f64; J], a: &[f64; J]) -> [f64; J] {
        let mut tau = [0.0; J];
        self.robot.torque(&self.theta, q, v, a, &mut tau);
        tau
    }
}

impl<const J: usize> Plant<J> for SerialTruth<J> {
    fn joint_names(&self) -> [String; J] {
        std::array::from_fn(|j| self.joints[j].name.clone())
    }

    fn coordinate_names(&self) -> [String; J] {
        self.joint_names()
    }

    fn coordinates(&self, q: &[f64; J]) -> [f64; J] {
        *q
    }

    fn coordinate_speeds(&self, _q: &[f64; J], v: &[f64; J]) -> [f64; J] {
        *v
    }

    fn joints(&self, x: &[f64; J]) -> Result<[f64; J], SimulateError> {
        Ok(*x)
    }

    fn joint_speeds(&self, _q: &[f64; J], xd: &[f64; J]) -> Result<[f64; J], SimulateError> {
        Ok(*xd)
    }

    #[inline]
    fn torque(&self, _q: &[f64; J], volts: &[f64; J]) -> [f64; J] {
        *volts
    }

    fn volts(&self, _q: &[f64; J], torque: &[f64; J]) -> Result<[f64; J], SimulateError> {
        Ok(*torque)
    }

    #[inline]
    fn rigid(&self, q: &[f64; J], v: &[f64; J]) -> ([[f64; J]; J], [f64; J]) {
        let bias = self.inverse(q, v, &[0.0; J]);
        let mut mass = [[0.0; J]; J];
        for k in 0..J {
            let mut unit = [0.0; J];
            unit[k] = 1.0;
            let tau = self.inverse(q, v, &unit);
            for (row, (tau, bias)) in mass.iter_mut().zip(tau.iter().zip(&bias)) {
                row[k] = tau - bias;
            }
        }
        (mass, bias)
    }

    #[inline]
    fn offset(&self) -> [f64; J] {
        std::array::from_fn(|j| self.joints[j].offset)
    }

    #[inline]
    fn friction(&self, v: &[f64; J]) -> [f64; J] {
        std::array::from_fn(|j| self.joints[j].friction.torque(v[j]))
    }

    /// By the Cholesky factor.
    #[inline]
    fn solve(&self, mass: &[[f64; J]; J], b: &[f64; J]) -> Option<[f64; J]> {
        let mut l = [[0.0; J]; J];
        for i in 0..J {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
                if i == j {
                    let left = mass[i][i] - sum;
                    // rounding of a matrix that is singular
                    if left.partial_cmp(&(1e-12 * mass[i][i].abs()))
                        != Some(std::cmp::Ordering::Greater)
                    {
                        return None;
                    }
                    l[i][i] = left.sqrt();
                } else {
                    l[i][j] = (mass[i][j] - sum) / l[j][j];
                }
            }
        }
        let mut x = *b;
        for i in 0..J {
            let sum: f64 = (0..i).map(|k| l[i][k] * x[k]).sum();
            x[i] = (x[i] - sum) / l[i][i];
        }
        for i in (0..J).rev() {
            let sum: f64 = (i + 1..J).map(|k| l[k][i] * x[k]).sum();
            x[i] = (x[i] - sum) / l[i][i];
        }
        Some(x)
    }

    fn limits(&self) -> ([f64; J], [f64; J]) {
        (
            std::array::from_fn(|j| self.joints[j].limits.0),
            std::array::from_fn(|j| self.joints[j].limits.1),
        )
    }

    fn resolution(&self) -> [f64; J] {
        std::array::from_fn(|j| self.joints[j].resolution)
    }
}
