//! Where effects sit: the joints of a robot, the screws of the CFT robot, the robot as a whole, with the
//! scales that default sizes are fractions of.

use crate::simulate::SimulateError;
use crate::simulate::plant::Plant;
use crate::simulate::temperature::PlantTemperatures;
use cft_ident_core::effect::Place;
use cft_ident_core::explain::ErrorText;
use cft_ident_core::robot::cft::geometry::L4;
use cft_ident_core::robot::cft::pantograph;
use cft_ident_core::robot::{JointKind, Robot};

/// Middling speeds of a joint that slides \[m/s\] and of one that turns \[rad/s\].
const SLIDING_SPEED: f64 = 0.2;
const TURNING_SPEED: f64 = 0.5;
/// Middling speed of the screws' nuts \[m/s\].
const SCREW_SPEED: f64 = 0.05;
/// Rate at which a torque of [`Site::scale`] that changes sign with the speed brings the joint to rest
/// within its steep part \[1/s\]: steps of 0.3 ms stay stable.
const SIGN_RATE: f64 = 10_000.0;

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
        self.place.joint().unwrap_or(0)
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
    pub(crate) fn half_travel(&self) -> f64 {
        0.5 * (self.travel.1 - self.travel.0)
    }

    /// Refusal of a kind at this site.
    pub(super) fn refuse(&self, effect: &str, why: impl Into<ErrorText>) -> SimulateError {
        let place = if self.name.is_empty() {
            "this robot".to_owned()
        } else {
            self.name.clone()
        };
        SimulateError::EffectPlace {
            effect: effect.to_owned(),
            place,
            why: why.into(),
        }
    }
}

/// The robot that effects are built for.
#[derive(Debug, Clone, Copy)]
pub struct PlantRobot<'a> {
    pub robot: &'a Robot,
    /// Its inertial parameters.
    pub theta: &'a [f64],
}

impl PlantRobot<'_> {
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.robot.joints()
    }

    /// Whether the joint of that index turns.
    pub fn turns(&self, joint: usize) -> bool {
        self.robot.joint_kind(joint) == JointKind::Revolute
    }
}

/// All places of one robot.
#[derive(Debug, Clone)]
pub struct Sites<'a> {
    pub machine: PlantRobot<'a>,
    pub joints: Vec<Site>,
    pub screws: Vec<Site>,
    pub whole: Vec<Site>,
    /// How warm its drives are.
    pub temperatures: PlantTemperatures,
}

impl<'a> Sites<'a> {
    /// The places of a plant.
    ///
    /// # Errors
    /// [`SimulateError::Robot`] where the middle of the limits is no pose, and
    /// [`SimulateError::NotPositiveDefinite`].
    pub fn of<const J: usize>(plant: &'a Plant<J>) -> Result<Self, SimulateError> {
        let robot = &plant.mechanism.robot;
        let joints = match Workspace::of(plant)? {
            Some(workspace) => workspace.joints()?,
            None => joints(plant),
        };
        let screws = screws(plant, &joints)?;
        let whole = joints.first().map(|first| Site {
            place: Place::All,
            name: String::new(),
            ..first.clone()
        });
        Ok(Self {
            machine: PlantRobot {
                robot,
                theta: plant.theta(),
            },
            joints,
            screws,
            whole: whole.into_iter().collect(),
            temperatures: PlantTemperatures::default(),
        })
    }
}

/// The joints of a robot whose workspace only its file knows: scales are the friction at a middling speed and
/// the inertia in the middle of the travel.
fn joints<const J: usize>(plant: &Plant<J>) -> Vec<Site> {
    let m = &plant.mechanism;
    // one joint alone has its inertia in every pose
    let (least, at, speed) = match m.joints() {
        1 => (1.0, 1.0, 0.2),
        _ => (0.3, 0.5, 0.5),
    };
    let names = m.robot.joint_names().iter().enumerate();
    names
        .map(|(j, name)| {
            let [coulomb, viscous] = plant.laws[j].levels();
            Site {
                place: Place::Joint(j),
                name: name.clone(),
                turns: m.robot.joint_kind(j) == JointKind::Revolute,
                scale: plant.laws[j].torque(at).abs(),
                speed,
                inertia: plant.inertia[j],
                least_inertia: least * plant.inertia[j],
                travel: m.travel(j),
                coulomb,
                viscous,
            }
        })
        .collect()
}

/// Inertia that a motor feels that pushes along a direction of the joints at the motors' coordinates x, while
/// the others are free to move.
fn felt<const J: usize>(
    plant: &Plant<J>,
    x: &[f64; J],
    direction: &[f64; J],
) -> Result<f64, SimulateError> {
    let (mass, _) = plant.rigid(&plant.mechanism.pose(x)?, &[0.0; J]);
    let answer = plant
        .solve(&mass, direction)
        .ok_or_else(|| SimulateError::NotPositiveDefinite { x: x.to_vec() })?;
    let speed: f64 = direction.iter().zip(answer).map(|(d, a)| d * a).sum();
    Ok(1.0 / speed)
}

/// A robot whose workspace is known.
struct Workspace<'a, const J: usize> {
    plant: &'a Plant<J>,
    middle: [f64; J],
    /// Motors' coordinates all over the limits, corners and middles included; the others stay at both ends.
    poses: Vec<[f64; J]>,
}

impl<'a, const J: usize> Workspace<'a, J> {
    fn of(plant: &'a Plant<J>) -> Result<Option<Self>, SimulateError> {
        const STEPS: usize = 4;
        const EACH: usize = STEPS + 1;
        let m = &plant.mechanism;
        let limits = m.robot.transmission().limits();
        let (Some(limits), Some(practice)) = (limits, &m.practice) else {
            return Ok(None);
        };
        let spans = limits.spans();
        let share = |i: usize, k: usize| limits.lower[i] + spans[i] * k as f64 / STEPS as f64;
        let matter: Vec<usize> = (0..m.joints()).filter(|i| *i != practice.uniform).collect();
        let mut poses = Vec::with_capacity(2 * EACH.pow(matter.len() as u32));
        for k in 0..EACH.pow(matter.len() as u32) {
            for end in [0, STEPS] {
                let (mut x, mut rest) = (m.filled(|i| share(i, end)), k);
                for &i in &matter {
                    x[i] = share(i, rest % EACH);
                    rest /= EACH;
                }
                poses.push(x);
            }
        }
        Ok(Some(Self {
            plant,
            middle: m.filled(|i| limits.middles()[i]),
            poses,
        }))
    }

    /// Scales are the friction of each joint at a middling speed and its inertia in the middle of the limits.
    fn joints(&self) -> Result<Vec<Site>, SimulateError> {
        let m = &self.plant.mechanism;
        let mut joints = Vec::with_capacity(m.joints());
        for (j, name) in m.robot.joint_names().iter().enumerate() {
            let law = &self.plant.laws[j];
            let mut direction = [0.0; J];
            direction[j] = 1.0;
            let mut least = f64::INFINITY;
            let mut travel = (f64::INFINITY, f64::NEG_INFINITY);
            for x in &self.poses {
                least = least.min(felt(self.plant, x, &direction)?);
                let q = m.pose(x)?[j];
                travel = (travel.0.min(q), travel.1.max(q));
            }
            let [coulomb, viscous] = law.levels();
            let turns = m.robot.joint_kind(j) == JointKind::Revolute;
            let speed = if turns { TURNING_SPEED } else { SLIDING_SPEED };
            joints.push(Site {
                place: Place::Joint(j),
                name: name.clone(),
                turns,
                scale: law.torque(speed).abs(),
                speed,
                inertia: felt(self.plant, &self.middle, &direction)?,
                least_inertia: least,
                travel,
                coulomb,
                viscous,
            });
        }
        Ok(joints)
    }
}

/// The screws of the pantograph.
fn screws<const J: usize>(plant: &Plant<J>, joints: &[Site]) -> Result<Vec<Site>, SimulateError> {
    let m = &plant.mechanism;
    let mut screws = Vec::new();
    let Some(limits) = m.robot.transmission().limits() else {
        return Ok(screws);
    };
    let middle = m.filled(|i| limits.middles()[i]);
    let pose = m.pose(&middle)?;
    let Some(jacobian) = pose.first_chunk().map(pantograph::reference_jacobian) else {
        return Ok(screws);
    };
    for (row, name) in m.robot.transmission().screws().iter().enumerate() {
        let mut direction = [0.0; J];
        direction[2..4].copy_from_slice(&jacobian[row]);
        screws.push(Site {
            place: Place::Actuator(row),
            name: (*name).to_owned(),
            turns: false,
            // A force on the crank of length L4 that takes the torque of the joint.
            scale: joints[3].scale / L4,
            speed: SCREW_SPEED,
            inertia: felt(plant, &middle, &direction)?,
            least_inertia: 0.0,
            travel: (-2.0 * L4, 2.0 * L4),
            coulomb: 0.0,
            viscous: 0.0,
        });
    }
    Ok(screws)
}
