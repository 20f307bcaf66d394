//! Where effects sit: at joints, at the actuators of the CFT robot, between two joints, on the whole robot.

use super::{EffectError, Values};
use crate::robot::{JointKind, Robot};

/// What an effect acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// One joint.
    Joint(usize),
    /// An actuator coordinate of the CFT robot: x_r (0) or y_r (1).
    Actuator(usize),
    /// Joint `on`, from the motion of joint `of`.
    Pair { on: usize, of: usize },
    /// Joints `motor` and `other`, through a gear train that both turn.
    Geared { motor: usize, other: usize },
    /// All joints together.
    All,
}

/// Where an effect may sit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Places {
    /// At a joint.
    Joints,
    /// At a joint, or on all of them together.
    JointsOrAll,
    /// At a joint that follows another, or between two.
    Pairs,
    /// At the actuators of the CFT robot.
    Actuators,
    /// At a joint or at an actuator.
    JointsAndActuators,
    /// On the robot as a whole.
    Whole,
}

impl Place {
    /// The joint, where it is one; none for actuator coordinates and for all joints.
    pub fn joint(self) -> Option<usize> {
        match self {
            Place::Joint(j) | Place::Pair { on: j, .. } | Place::Geared { motor: j, .. } => Some(j),
            Place::Actuator(_) | Place::All => None,
        }
    }

    /// The other joint, whose motion counts too.
    pub fn from(self) -> Option<usize> {
        match self {
            Place::Pair { of, .. } => Some(of),
            Place::Geared { other, .. } => Some(other),
            _ => None,
        }
    }

    /// Whether the effect adds torque to joint `j`.
    pub fn touches(self, j: usize) -> bool {
        match self {
            Place::Joint(i) | Place::Pair { on: i, .. } => i == j,
            Place::Geared { motor, other } => j == motor || j == other,
            // the pantograph's references move q4 and q5
            Place::Actuator(_) => j == 2 || j == 3,
            Place::All => true,
        }
    }

    /// Name in results and files: the joint's, `x_r` or `y_r`; none for all joints.
    pub fn name(self, robot: &Robot) -> Option<String> {
        match self {
            Place::Actuator(row) => {
                let screws = robot.transmission().screws();
                screws.get(row).map(|name| (*name).to_owned())
            }
            _ => self.joint().map(|j| robot.joint_names()[j].clone()),
        }
    }

    /// Whether the coordinate slides or turns.
    pub fn kind(self, robot: &Robot) -> JointKind {
        match self {
            Place::Actuator(_) => JointKind::Prismatic,
            _ => robot.joint_kind(self.joint().unwrap_or(0)),
        }
    }

    /// What files say of the place beside the joint's name: the other joint, counted from one, and whether
    /// both turn one motor.
    pub fn keys(self) -> Vec<(&'static str, f64)> {
        match self {
            Place::Pair { of, .. } => vec![("from", (of + 1) as f64)],
            Place::Geared { other, .. } => vec![("from", (other + 1) as f64), ("both", 1.0)],
            Place::Joint(_) | Place::Actuator(_) | Place::All => Vec::new(),
        }
    }
}

impl Places {
    /// All of them on a robot.
    pub fn on(self, robot: &Robot) -> Vec<Place> {
        let n = robot.joints();
        let joints = (0..n).map(Place::Joint);
        let screws = 0..robot.transmission().screws().len();
        let actuators = screws.map(Place::Actuator);
        match self {
            Places::Joints => joints.collect(),
            Places::JointsOrAll => {
                let all = (n > 1).then_some(Place::All);
                all.into_iter().chain(joints).collect()
            }
            Places::Pairs => pairs(robot),
            Places::Actuators => actuators.collect(),
            Places::JointsAndActuators => joints.chain(actuators).collect(),
            Places::Whole => vec![Place::All],
        }
    }

    /// The place that a file names.
    ///
    /// # Errors
    /// [`EffectError::Place`] where such an effect cannot sit there, [`EffectError::Joint`] for a joint that is
    /// not known, [`EffectError::Value`] for another joint that is none.
    pub fn named(
        self,
        robot: &Robot,
        joint: Option<&str>,
        values: &Values,
    ) -> Result<Place, EffectError> {
        let nowhere = || EffectError::Place {
            name: values.effect.to_owned(),
        };
        let Some(joint) = joint else {
            return match self {
                Places::JointsOrAll | Places::Whole => Ok(Place::All),
                _ => Err(nowhere()),
            };
        };
        let of_name = |place: &Place| place.name(robot).as_deref() == Some(joint);
        let actuator = |place: &Place| matches!(place, Place::Actuator(_)) && of_name(place);
        if let Some(place) = self.on(robot).into_iter().find(actuator) {
            return Ok(place);
        }
        let names = robot.joint_names();
        let on = names.iter().position(|name| name == joint);
        let on = on.ok_or_else(|| EffectError::Joint {
            name: values.effect.to_owned(),
            joint: joint.escape_debug().to_string(),
            known: names.join(", "),
        })?;
        match self {
            Places::Pairs => pair(on, names.len(), values),
            Places::Actuators | Places::Whole => Err(nowhere()),
            _ => Ok(Place::Joint(on)),
        }
    }
}

/// Every two joints: geared ones, then each that follows another.
fn pairs(robot: &Robot) -> Vec<Place> {
    let n = robot.joints();
    // the motor is the one further out: its train passes through the joint before it
    let geared = (0..n).flat_map(|motor| (0..motor).map(move |o| (motor, o)));
    // of joints of two kinds the numbers would have two units
    let alike = |(a, b): &(usize, usize)| robot.joint_kind(*a) == robot.joint_kind(*b);
    let geared = geared.filter(alike);
    let geared = geared.map(|(motor, other)| Place::Geared { motor, other });
    let pairs = (0..n).flat_map(|on| (0..n).map(move |of| (on, of)));
    let pairs = pairs.filter(|(on, of)| on != of);
    let pairs = pairs.map(|(on, of)| Place::Pair { on, of });
    geared.chain(pairs).collect()
}

/// Joint `on` with the one that the key `from` numbers.
fn pair(on: usize, joints: usize, values: &Values) -> Result<Place, EffectError> {
    let from = values.get("from")?;
    let at = from as usize;
    if from.fract() != 0.0 || at < 1 || at > joints || at - 1 == on {
        return Err(values.unusable("from", from));
    }
    let other = at - 1;
    let both = values.get("both").is_ok_and(|both| both != 0.0);
    Ok(match both {
        true => Place::Geared { motor: on, other },
        false => Place::Pair { on, of: other },
    })
}
