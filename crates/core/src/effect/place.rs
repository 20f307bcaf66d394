//! Where effects sit: at joints, at the actuators of the CFT robot, between two joints, on the whole robot.

use super::{EffectError, EffectValues};
use crate::robot::{JointKind, Robot};

/// What an effect acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum EffectPlace {
    /// One joint.
    Joint(usize),
    /// An actuator coordinate of the CFT robot: x_r (0) or y_r (1).
    Actuator(usize),
    /// All of these together, with the same numbers: drives of one make.
    Actuators,
    /// Joint `on`, from the motion of joint `of`.
    Pair { on: usize, of: usize },
    /// Joints `motor` and `other`, through a gear train that both turn.
    Geared { motor: usize, other: usize },
    /// All joints together.
    All,
}

/// Where an effect may sit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaceRule {
    /// At a joint.
    Joints,
    /// At a joint, or on all of them together.
    JointsOrAll,
    /// At a joint that follows another, or between two.
    Pairs,
    /// At a joint that another one has a part in.
    Others,
    /// At the actuators of the CFT robot, all of them or one.
    Actuators,
    /// At a joint, at all actuators or at one.
    JointsAndActuators,
    /// On the robot as a whole.
    Whole,
}

impl EffectPlace {
    /// The joint, where it is one; none for actuator coordinates and for all joints.
    pub fn joint(self) -> Option<usize> {
        match self {
            EffectPlace::Joint(j)
            | EffectPlace::Pair { on: j, .. }
            | EffectPlace::Geared { motor: j, .. } => Some(j),
            EffectPlace::Actuator(_) | EffectPlace::Actuators | EffectPlace::All => None,
        }
    }

    /// The other joint, whose motion counts too.
    pub fn from(self) -> Option<usize> {
        match self {
            EffectPlace::Pair { of, .. } => Some(of),
            EffectPlace::Geared { other, .. } => Some(other),
            _ => None,
        }
    }

    /// Whether the effect adds torque to joint `j`.
    pub fn touches(self, j: usize) -> bool {
        match self {
            EffectPlace::Joint(i) | EffectPlace::Pair { on: i, .. } => i == j,
            EffectPlace::Geared { motor, other } => j == motor || j == other,
            // the pantograph's references move q4 and q5
            EffectPlace::Actuator(_) | EffectPlace::Actuators => j == 2 || j == 3,
            EffectPlace::All => true,
        }
    }

    /// Name in results and files: the joint's, `x_r` or `y_r`; none for all of them.
    pub fn name(self, robot: &Robot) -> Option<String> {
        match self {
            EffectPlace::Actuator(row) => {
                let screws = robot.transmission().screws();
                screws.get(row).map(|name| (*name).to_owned())
            }
            _ => self.joint().map(|j| robot.joint_names()[j].clone()),
        }
    }

    /// Rows of the pantograph's Jacobian that it has.
    pub(super) fn rows(self) -> std::ops::Range<usize> {
        match self {
            EffectPlace::Actuator(row) => row..row + 1,
            EffectPlace::Actuators => 0..2,
            _ => 0..0,
        }
    }

    /// Whether the coordinate slides or turns.
    pub fn kind(self, robot: &Robot) -> JointKind {
        match self {
            EffectPlace::Actuator(_) | EffectPlace::Actuators => JointKind::Prismatic,
            _ => robot.joint_kind(self.joint().unwrap_or(0)),
        }
    }

    /// Its name in a sentence: `q1`, `x_r and y_r`, `all joints`.
    pub(super) fn words(self, robot: &Robot) -> String {
        match self {
            EffectPlace::Actuators => robot.transmission().screws().join(" and "),
            _ => self.name(robot).unwrap_or_else(|| "all joints".to_owned()),
        }
    }

    /// What files say of the place beside the joint's name: the other joint, counted from one, and whether
    /// both turn one motor.
    pub fn keys(self) -> Vec<(&'static str, f64)> {
        match self {
            EffectPlace::Pair { of, .. } => vec![("from", (of + 1) as f64)],
            EffectPlace::Geared { other, .. } => vec![("from", (other + 1) as f64), ("both", 1.0)],
            EffectPlace::Joint(_)
            | EffectPlace::Actuator(_)
            | EffectPlace::Actuators
            | EffectPlace::All => Vec::new(),
        }
    }
}

impl PlaceRule {
    /// All of them on a robot.
    pub fn on(self, robot: &Robot) -> Vec<EffectPlace> {
        let n = robot.joints();
        let joints = (0..n).map(EffectPlace::Joint);
        let screws = robot.transmission().screws().len();
        // one number for several comes first: it is preferred to one for each
        let together = (screws > 1).then_some(EffectPlace::Actuators);
        let actuators = together
            .into_iter()
            .chain((0..screws).map(EffectPlace::Actuator));
        match self {
            PlaceRule::Joints => joints.collect(),
            PlaceRule::JointsOrAll => {
                let all = (n > 1).then_some(EffectPlace::All);
                all.into_iter().chain(joints).collect()
            }
            PlaceRule::Pairs => pairs(robot),
            PlaceRule::Others => directed(n).collect(),
            PlaceRule::Actuators => actuators.collect(),
            PlaceRule::JointsAndActuators => joints.chain(actuators).collect(),
            PlaceRule::Whole => vec![EffectPlace::All],
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
        values: &EffectValues,
    ) -> Result<EffectPlace, EffectError> {
        let nowhere = || EffectError::Place {
            name: values.effect.to_owned(),
        };
        let Some(joint) = joint else {
            return match self {
                PlaceRule::JointsOrAll | PlaceRule::Whole => Ok(EffectPlace::All),
                _ if self.on(robot).contains(&EffectPlace::Actuators) => Ok(EffectPlace::Actuators),
                _ => Err(nowhere()),
            };
        };
        let of_name = |place: &EffectPlace| place.name(robot).as_deref() == Some(joint);
        let actuator =
            |place: &EffectPlace| matches!(place, EffectPlace::Actuator(_)) && of_name(place);
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
            PlaceRule::Pairs | PlaceRule::Others => pair(on, names.len(), values),
            PlaceRule::Actuators | PlaceRule::Whole => Err(nowhere()),
            _ => Ok(EffectPlace::Joint(on)),
        }
    }
}

/// Every two joints: geared ones, then each that follows another.
fn pairs(robot: &Robot) -> Vec<EffectPlace> {
    let n = robot.joints();
    // the motor is the one further out: its train passes through the joint before it
    let geared = (0..n).flat_map(|motor| (0..motor).map(move |o| (motor, o)));
    // of joints of two kinds the numbers would have two units
    let alike = |(a, b): &(usize, usize)| robot.joint_kind(*a) == robot.joint_kind(*b);
    let geared = geared.filter(alike);
    let geared = geared.map(|(motor, other)| EffectPlace::Geared { motor, other });
    geared.chain(directed(n)).collect()
}

/// Each joint with each other that has a part in it.
fn directed(n: usize) -> impl Iterator<Item = EffectPlace> {
    let pairs = (0..n).flat_map(move |on| (0..n).map(move |of| (on, of)));
    let pairs = pairs.filter(|(on, of)| on != of);
    pairs.map(|(on, of)| EffectPlace::Pair { on, of })
}

/// Joint `on` with the one that the key `from` numbers.
fn pair(on: usize, joints: usize, values: &EffectValues) -> Result<EffectPlace, EffectError> {
    let from = values.get("from")?;
    let at = from as usize;
    if from.fract() != 0.0 || at < 1 || at > joints || at - 1 == on {
        return Err(values.unusable("from", from));
    }
    let other = at - 1;
    let both = values.get("both").is_ok_and(|both| both != 0.0);
    Ok(match both {
        true => EffectPlace::Geared { motor: on, other },
        false => EffectPlace::Pair { on, of: other },
    })
}
