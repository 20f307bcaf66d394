//! The robot that is simulated: a mechanism with parameters that are true.
//!
//! Per joint the balance is tau = M a + C v + G + F(v) + E, eq. (60) with the effects E that a declared
//! model may lack.

use super::SimulateError;
use super::joint_friction::SmoothFriction;
use super::mechanism::Mechanism;
use cft_ident_core::explain::ErrorText;
use cft_ident_core::robot::dynamics::RobotDynamics;
use cft_ident_core::robot::model::JointFriction;
use cft_ident_files::config::robot_file::{FrictionLawKind, RobotFile};
use cft_ident_files::config::{ConfigError, ModelFile};

/// Poses at which the inertia matrix must be positive definite, and steps of a grid over at most [`GRIDDED`] coordinates.
const POSES: usize = 64;
const STEPS: usize = 12;
const GRIDDED: usize = 3;

/// A mechanism of n joints with its true parameters.
#[derive(Debug, Clone)]
pub struct Plant<const J: usize> {
    pub mechanism: Mechanism<J>,
    dynamics: RobotDynamics,
    /// Friction and constant torque that the motors supply beside load and friction, per joint.
    pub laws: Vec<SmoothFriction>,
    pub offset: [f64; J],
    /// M_jj in the middle of the travel, kg or kg m^2.
    pub inertia: [f64; J],
}

impl<const J: usize> Plant<J> {
    /// The mechanism with inertial parameters in the order of the regressor's columns; `friction` makes the
    /// law of joint j with the inertia M_jj in the middle of the travel.
    ///
    /// # Errors
    /// [`SimulateError::Robot`] where the middle of the limits is no pose.
    pub fn new(
        mechanism: Mechanism<J>,
        theta: &[f64],
        friction: impl Fn(usize, f64) -> SmoothFriction,
        offset: [f64; J],
    ) -> Result<Self, SimulateError> {
        let mut plant = Self {
            dynamics: mechanism.robot.dynamics(theta),
            laws: Vec::new(),
            offset,
            inertia: [0.0; J],
            mechanism,
        };
        let middle = plant.mechanism.pose(&plant.mechanism.middle())?;
        let (mass, _) = plant.rigid(&middle, &[0.0; J]);
        plant.inertia = plant.mechanism.filled(|j| mass[j][j]);
        let law = |j| friction(j, plant.inertia[j]);
        plant.laws = (0..plant.joints()).map(law).collect();
        Ok(plant)
    }

    /// The robot of a file with the parameters of a model, or with its nominal ones.
    ///
    /// # Errors
    /// [`SimulateError::Unsupported`] without a model where no numbers stand for the robot,
    /// [`SimulateError::Config`] where the model lacks a parameter or belongs to another robot, and as
    /// [`Self::check`].
    pub fn of(file: &RobotFile, model: Option<(&str, &ModelFile)>) -> Result<Self, SimulateError> {
        let mechanism = Mechanism::of(file)?;
        let robot = &mechanism.robot;
        let mut offset = [0.0; J];
        let plant = match (model, robot.nominal()) {
            (Some((name, model)), _) => {
                model.belongs_to(name, file)?;
                let theta = model.inertial(name)?;
                let law = file.friction_law();
                let laws = robot.joint_names().iter();
                let laws = laws.map(|joint| law_of(law, (name, model), joint));
                let laws = laws.collect::<Result<Vec<_>, _>>()?;
                for (offset, joint) in offset.iter_mut().zip(robot.joint_names()) {
                    *offset = model.offset(joint);
                }
                Self::new(mechanism, &theta, |j, inertia| laws[j](inertia), offset)?
            }
            (None, Some(nominal)) => {
                let law = |j: usize, _| SmoothFriction::DoubleTanh(nominal.friction[j]);
                Self::new(mechanism, &nominal.theta, law, offset)?
            }
            (None, None) => {
                let what = match robot.joints() {
                    1 => "a single joint has no parameters of its own",
                    _ => "a serial robot has no parameters of its own",
                };
                return Err(SimulateError::Unsupported {
                    what: ErrorText::new(what).remedy("give a model with -m"),
                });
            }
        };
        plant.check()?;
        Ok(plant)
    }

    /// Number of joints n.
    #[inline]
    pub fn joints(&self) -> usize {
        self.mechanism.joints()
    }

    /// Inertial parameters.
    pub fn theta(&self) -> &[f64] {
        self.dynamics.theta()
    }

    /// # Errors
    /// [`SimulateError::Parameter`] for the first number that no joint can have, and
    /// [`SimulateError::NotPositiveDefinite`] with the pose where the parameters are those of no body: an
    /// unconstrained fit can be so.
    pub fn check(&self) -> Result<(), SimulateError> {
        let (n, m) = (self.joints(), &self.mechanism);
        if n == 1 {
            // the inertia of a single joint is a parameter, reported by its name
            self.check_joint(0)?;
        }
        let finite = self.theta().iter().all(|x| x.is_finite());
        for x in m.poses() {
            let (mass, _) = self.rigid(&m.pose(&x)?, &[0.0; J]);
            if !finite || self.solve(&mass, &[1.0; J]).is_none() {
                let x = x[..n].to_vec();
                return Err(SimulateError::NotPositiveDefinite { x });
            }
        }
        // friction that is smoothed by the inertia is a number only where this is one
        (0..n).try_for_each(|j| self.check_joint(j))
    }

    fn check_joint(&self, j: usize) -> Result<(), SimulateError> {
        let m = &self.mechanism;
        // that of one joint is a parameter; else M as a whole is looked at
        let inertia = self.joints() > 1 || (self.inertia[j] > 0.0 && self.inertia[j].is_finite());
        let gain = m.gain[j] > 0.0 && m.gain[j].is_finite();
        let rule = "must be above 0: no machine moves so; give a model whose parameters can exist (`lsq` of torques in N or N m writes them beside its fit)";
        SimulateError::require(inertia, "inertia", self.inertia[j], rule)?;
        let friction = self.laws[j].is_finite();
        SimulateError::require(friction, "friction", f64::NAN, "must be finite")?;
        let offset = self.offset[j];
        SimulateError::require(offset.is_finite(), "offset", offset, "must be finite")?;
        SimulateError::require(gain, "gain", m.gain[j], "must be above 0")?;
        let step = m.resolution[j];
        SimulateError::require(step >= 0.0, "resolution", step, "must be 0 or more")?;
        let rule = "must lie below the upper limit";
        SimulateError::require(m.lower[j] < m.upper[j], "lower limit", m.lower[j], rule)
    }

    /// Inertia matrix M(q), and C(q, v) v + G(q).
    #[inline]
    pub fn rigid(&self, q: &[f64; J], v: &[f64; J]) -> ([[f64; J]; J], [f64; J]) {
        let n = self.joints();
        let (mut mass, mut bias) = ([[0.0; J]; J], [0.0; J]);
        self.dynamics.inertia_and_bias(
            &q[..n],
            &v[..n],
            &mut mass.as_flattened_mut()[..n * n],
            &mut bias[..n],
        );
        spread(&mut mass, n);
        (mass, bias)
    }

    /// Friction F(v) of each joint.
    #[inline]
    pub fn friction(&self, v: &[f64; J]) -> [f64; J] {
        let law = |i: usize| self.laws.get(i).map_or(0.0, |law| law.torque(v[i]));
        std::array::from_fn(law)
    }

    /// Inertia matrix M(q), and C(q, v) v + G(q) + F(v) with the offset.
    #[inline]
    pub fn dynamics(&self, q: &[f64; J], v: &[f64; J]) -> ([[f64; J]; J], [f64; J]) {
        let (mass, mut bias) = self.rigid(q, v);
        let friction = self.friction(v);
        for i in 0..J {
            bias[i] += friction[i] + self.offset[i];
        }
        (mass, bias)
    }

    /// x with M x = b; `None` where M is not positive definite.
    #[inline]
    pub fn solve(&self, mass: &[[f64; J]; J], b: &[f64; J]) -> Option<[f64; J]> {
        let (n, mut mass, mut x) = (self.joints(), *mass, *b);
        gather(&mut mass, n);
        let solved = self
            .dynamics
            .solve(&mut mass.as_flattened_mut()[..n * n], &mut x[..n]);
        solved.then_some(x)
    }
}

/// The friction of a joint in a model, once its inertia is known.
type Law = Box<dyn Fn(f64) -> SmoothFriction>;

/// The law whose parameters the model holds of the joint; one of `declared` is asked for where it holds none.
fn law_of(
    declared: FrictionLawKind,
    (name, model): (&str, &ModelFile),
    joint: &str,
) -> Result<Law, ConfigError> {
    let bent = |law| -> Law { Box::new(move |_| SmoothFriction::DoubleTanh(law)) };
    let straight =
        |law| -> Law { Box::new(move |inertia| SmoothFriction::viscous_coulomb(law, inertia)) };
    Ok(match (model.joint_friction(name, joint)?, declared) {
        (JointFriction::DoubleTanh(law), _) => bent(law),
        (JointFriction::ViscousCoulomb(law), _) => straight(law),
        (JointFriction::None, FrictionLawKind::DoubleTanh) => bent(model.double_tanh(name, joint)?),
        (JointFriction::None, FrictionLawKind::ViscousCoulomb) => {
            straight(model.viscous_coulomb(name, joint)?)
        }
    })
}

/// A matrix of n x n numbers in a row to one of J x J, with ones on the diagonal beyond.
#[inline]
pub(super) fn spread<const J: usize>(mass: &mut [[f64; J]; J], n: usize) {
    if n == J {
        return;
    }
    let flat = mass.as_flattened_mut();
    for i in (0..n).rev() {
        flat.copy_within(i * n..(i + 1) * n, i * J);
        flat[i * J + n..(i + 1) * J].fill(0.0);
    }
    for (i, row) in mass.iter_mut().enumerate().skip(n) {
        row.fill(0.0);
        row[i] = 1.0;
    }
}

/// The first n x n numbers of a J x J matrix in a row: the inverse of [`spread`].
#[inline]
pub(super) fn gather<const J: usize>(mass: &mut [[f64; J]; J], n: usize) {
    if n == J {
        return;
    }
    let flat = mass.as_flattened_mut();
    for i in 1..n {
        flat.copy_within(i * J..i * J + n, i * n);
    }
}

impl<const J: usize> Mechanism<J> {
    /// Motors' coordinates all over the limits: a grid where few of them matter, else a Weyl sequence, which fills the box.
    fn poses(&self) -> Vec<[f64; J]> {
        let n = self.joints();
        let uniform = self.practice.as_ref().map(|practice| practice.uniform);
        let matter: Vec<usize> = (0..n).filter(|i| Some(*i) != uniform).collect();
        if matter.len() > GRIDDED {
            let pose = |pose: usize| {
                self.filled(|j| {
                    let share = (pose as f64 * (0.5 + j as f64).sqrt()).fract();
                    let (low, high) = self.travel(j);
                    let middle = 0.5 * (low + high);
                    middle + (share - if pose == 0 { 0.0 } else { 0.5 }) * (high - low)
                })
            };
            return (0..POSES).map(pose).collect();
        }
        let each = STEPS + 1;
        let pose = |mut rest: usize| {
            let mut x = self.filled(|i| self.travel(i).0);
            // the last coordinate runs fastest
            for &i in matter.iter().rev() {
                let (low, high) = self.travel(i);
                x[i] = low + (high - low) * (rest % each) as f64 / STEPS as f64;
                rest /= each;
            }
            x
        };
        (0..each.pow(matter.len() as u32)).map(pose).collect()
    }
}
