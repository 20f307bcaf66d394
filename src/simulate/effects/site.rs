//! Where effects sit: the joints of a robot, the screws of the CFT robot, the robot as a whole, with the
//! scales that default sizes are fractions of.

use crate::robot::cft::dynamics::{Coefficients, inertia, solve_positive};
use crate::robot::cft::geometry::L4;
use crate::robot::cft::{JOINTS, Limits, pantograph};
use crate::robot::{JointKind, Robot};
use crate::simulate::SimulateError;
use crate::simulate::cft::CftTruth;
use crate::simulate::single_joint::{SingleJointFriction, SingleJointTruth};

/// Names of the pantograph's references, which two motors move through screws.
const SCREWS: [&str; 2] = ["x_r", "y_r"];
/// Middling speeds of q1 \[m/s\] and q2, q4, q5 \[rad/s\].
const SPEEDS: [f64; 4] = [0.2, 0.5, 0.5, 0.5];
/// Middling speed of the screws' nuts \[m/s\].
const SCREW_SPEED: f64 = 0.05;
/// Rate at which a torque of [`Site::scale`] that changes sign with the speed brings the joint to rest
/// within its steep part \[1/s\]: steps of 0.3 ms stay stable.
const SIGN_RATE: f64 = 10_000.0;

/// The place of an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// A joint, by its index.
    Joint(usize),
    /// x_r or y_r of the CFT robot, by its row in the Jacobian.
    Screw(usize),
    /// The robot as a whole.
    Whole,
}

/// What an effect is built for.
#[derive(Debug, Clone, PartialEq)]
pub struct Site {
    pub place: Place,
    /// Name of the joint or screw; empty for the robot as a whole.
    pub name: String,
    /// Whether it turns (orders are then per revolution) or slides (per metre).
    pub turns: bool,
    /// Typical friction, N or N m: what default sizes are a fraction of.
    pub scale: f64,
    /// Middling speed, m/s or rad/s.
    pub speed: f64,
    /// Inertia that the motor feels while the other joints are free to move, kg or kg m^2.
    pub inertia: f64,
    /// The least that it is in any pose, kg or kg m^2.
    pub least_inertia: f64,
    /// Lower and upper end of the travel, m or rad.
    pub travel: (f64, f64),
    /// Coulomb level of the friction law at speed, N or N m.
    pub coulomb: f64,
    /// Viscous coefficient of the friction law, N s/m or N m s/rad.
    pub viscous: f64,
}

impl Site {
    /// Index of the joint; 0 where the place is none.
    pub fn joint(&self) -> usize {
        match self.place {
            Place::Joint(index) => index,
            Place::Screw(_) | Place::Whole => 0,
        }
    }

    /// Slope w of tanh(w v) where the definition has the sign of v, s/m or s/rad.
    pub fn slope(&self) -> f64 {
        // A joint without friction still needs a slope.
        SIGN_RATE * self.inertia / self.scale.max(1e-3 * self.inertia)
    }

    /// Middle of the travel, m or rad.
    pub fn middle(&self) -> f64 {
        0.5 * (self.travel.0 + self.travel.1)
    }

    /// Half of the travel, m or rad.
    pub fn half_travel(&self) -> f64 {
        0.5 * (self.travel.1 - self.travel.0)
    }

    /// Refusal of a kind at this site.
    pub(super) fn refuse(&self, effect: &str, why: &str) -> SimulateError {
        let place = if self.name.is_empty() {
            "this robot".to_owned()
        } else {
            self.name.clone()
        };
        SimulateError::EffectPlace {
            effect: effect.to_owned(),
            place,
            why: why.to_owned(),
        }
    }
}

/// The robot that effects are built for.
#[derive(Debug, Clone, Copy)]
pub enum Machine<'a> {
    Cft(&'a CftTruth),
    SingleJoint(&'a SingleJointTruth),
    /// A serial robot, its parameters, and which of its joints turn, one bit each.
    Serial {
        robot: &'a Robot,
        theta: &'a [f64],
        turning: u8,
    },
}

impl Machine<'_> {
    /// Number of joints.
    pub fn joints(&self) -> usize {
        match self {
            Self::Cft(_) => 4,
            Self::SingleJoint(_) => 1,
            Self::Serial { robot, .. } => robot.joints(),
        }
    }

    /// Whether the joint of that index turns.
    pub fn turns(&self, joint: usize) -> bool {
        match self {
            Self::Cft(_) => joint > 0,
            Self::SingleJoint(truth) => truth.kind == JointKind::Revolute,
            Self::Serial { turning, .. } => turning & (1 << joint) != 0,
        }
    }
}

/// All places of one robot.
#[derive(Debug, Clone)]
pub struct Sites<'a> {
    pub machine: Machine<'a>,
    pub joints: Vec<Site>,
    pub screws: Vec<Site>,
    pub whole: Vec<Site>,
}

impl<'a> Sites<'a> {
    /// Places of a CFT robot. Scales are the friction of each joint at a middling speed and its inertia in
    /// the middle of the limits.
    ///
    /// # Errors
    /// [`SimulateError::Robot`] where the middle of the limits is no pose, and
    /// [`SimulateError::NotPositiveDefinite`].
    pub fn cft(truth: &'a CftTruth) -> Result<Self, SimulateError> {
        let limits = truth.setup.limits();
        let coefficients = Coefficients::from_theta22(&truth.theta);
        let felt = |x: &[f64; 4], direction: [f64; 4]| {
            let mass = inertia(&pantograph::joints(x)?, &coefficients);
            let answer = solve_positive(&mass, &direction)
                .ok_or_else(|| SimulateError::NotPositiveDefinite { x: x.to_vec() })?;
            let speed: f64 = direction.iter().zip(answer).map(|(d, a)| d * a).sum();
            Ok::<f64, SimulateError>(1.0 / speed)
        };
        let middle = limits.middles();
        let poses = poses(&limits);
        let mut joints = Vec::with_capacity(4);
        for (joint, name) in JOINTS.iter().enumerate() {
            let law = &truth.friction[joint];
            let mut direction = [0.0; 4];
            direction[joint] = 1.0;
            let mut least = f64::INFINITY;
            let mut travel = (f64::INFINITY, f64::NEG_INFINITY);
            for x in &poses {
                least = least.min(felt(x, direction)?);
                let q = pantograph::joints(x)?[joint];
                travel = (travel.0.min(q), travel.1.max(q));
            }
            joints.push(Site {
                place: Place::Joint(joint),
                name: (*name).to_owned(),
                turns: joint > 0,
                scale: law.torque(SPEEDS[joint]).abs(),
                speed: SPEEDS[joint],
                inertia: felt(&middle, direction)?,
                least_inertia: least,
                travel,
                coulomb: law.coulomb_1 + law.coulomb_2,
                viscous: law.viscous,
            });
        }
        let pose = pantograph::joints(&middle)?;
        let jacobian = pantograph::reference_jacobian(&pose);
        let mut screws = Vec::with_capacity(2);
        for (row, name) in SCREWS.iter().enumerate() {
            let [to_q4, to_q5] = jacobian[row];
            screws.push(Site {
                place: Place::Screw(row),
                name: (*name).to_owned(),
                turns: false,
                // A force on the crank of length L4 that takes the torque of the joint.
                scale: joints[3].scale / L4,
                speed: SCREW_SPEED,
                inertia: felt(&middle, [0.0, 0.0, to_q4, to_q5])?,
                least_inertia: 0.0,
                travel: (-2.0 * L4, 2.0 * L4),
                coulomb: 0.0,
                viscous: 0.0,
            });
        }
        let whole = Site {
            place: Place::Whole,
            name: String::new(),
            ..joints[0].clone()
        };
        Ok(Self {
            machine: Machine::Cft(truth),
            joints,
            screws,
            whole: vec![whole],
        })
    }

    /// The places of a serial robot, one a joint.
    pub fn serial(robot: &'a Robot, theta: &'a [f64], joints: Vec<Site>) -> Self {
        let turning = joints.iter().enumerate();
        let turning = turning.fold(0, |bits, (j, site)| bits | (u8::from(site.turns) << j));
        let whole = joints.first().map(|first| Site {
            place: Place::Whole,
            name: String::new(),
            ..first.clone()
        });
        Self {
            machine: Machine::Serial {
                robot,
                theta,
                turning,
            },
            joints,
            screws: Vec::new(),
            whole: whole.into_iter().collect(),
        }
    }

    /// The places of a single joint, scaled with its friction at one m/s or rad/s.
    pub fn single_joint(truth: &'a SingleJointTruth) -> Self {
        let (low, high) = truth.limits;
        let (coulomb, viscous) = match truth.friction {
            SingleJointFriction::DoubleTanh(law) => (law.coulomb_1 + law.coulomb_2, law.viscous),
            SingleJointFriction::ViscousCoulomb { law, .. } => (law.coulomb, law.viscous),
        };
        let joint = Site {
            place: Place::Joint(0),
            name: truth.name.clone(),
            turns: truth.kind == JointKind::Revolute,
            scale: truth.friction.torque(1.0).abs(),
            speed: 0.2,
            inertia: truth.inertia,
            least_inertia: truth.inertia,
            travel: if low.is_finite() && high.is_finite() {
                (low, high)
            } else {
                (-1.0, 1.0)
            },
            coulomb,
            viscous,
        };
        let whole = Site {
            place: Place::Whole,
            name: String::new(),
            ..joint.clone()
        };
        Self {
            machine: Machine::SingleJoint(truth),
            joints: vec![joint],
            screws: Vec::new(),
            whole: vec![whole],
        }
    }
}

/// Motor coordinates all over the limits, corners and middles included; the travel x_c4 changes nothing.
fn poses(limits: &Limits) -> Vec<[f64; 4]> {
    const STEPS: usize = 4;
    const EACH: usize = STEPS + 1;
    let share = |i: usize, k: usize| limits.lower[i] + limits.spans()[i] * k as f64 / STEPS as f64;
    let mut poses = Vec::with_capacity(2 * EACH.pow(3));
    for k in 0..EACH.pow(3) {
        let (i, j, l) = (k % EACH, k / EACH % EACH, k / (EACH * EACH));
        for x_c4 in [limits.lower[3], limits.upper[3]] {
            poses.push([share(0, i), share(1, j), share(2, l), x_c4]);
        }
    }
    poses
}
