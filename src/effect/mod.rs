//! Effects that a declared model may lack, as the estimators see them: columns of torque along a
//! recorded motion, linear in some parameters and shaped by others.
//!
//! Each effect is one small file with a [`Kind`]; [`KINDS`] lists them in the order in which they
//! are preferred where the data do not separate them (data first, then what forges others, then what
//! is simple). The simulator integrates the same effects from files of its own.

mod actuator_friction;
mod added;
mod asymmetric_friction;
mod backlash;
mod carried;
mod counterbalance;
mod coupling;
mod cover;
mod delay;
mod drift;
mod drive_efficiency;
mod elasticity;
mod gain;
mod gravity_tilt;
mod load_friction;
mod nonlinear_viscous;
mod payload;
mod position_friction;
mod presliding;
mod refined;
mod rigid_body_terms;
mod ripple;
mod rotor_inertia;
mod spring;
mod stribeck;
mod torque_offset;
mod warm_up;

pub use added::{Added, EffectError, Told};
pub use cover::{Cover, JointCover, held_joints};
pub use refined::{Refined, Torques, shifted};

use crate::motion::Stretch;
use crate::robot::friction::sign;
use crate::robot::model::JointFriction;
use crate::robot::{JointKind, Robot};

/// Families of effects that look alike: named first, the member only where the data separate it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    Offset,
    Velocity,
    Cross,
    Load,
    Position,
    Memory,
    Timing,
    Inertia,
    Slow,
}

impl Family {
    /// Name in results and files.
    pub const fn name(self) -> &'static str {
        match self {
            Family::Offset => "offset",
            Family::Velocity => "velocity",
            Family::Cross => "cross",
            Family::Load => "load",
            Family::Position => "position",
            Family::Memory => "memory",
            Family::Timing => "timing",
            Family::Inertia => "inertia",
            Family::Slow => "slow",
        }
    }
}

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

impl Place {
    /// The joint, where it is one; none for actuator coordinates and for all joints.
    pub fn joint(self) -> Option<usize> {
        match self {
            Place::Joint(j) | Place::Pair { on: j, .. } | Place::Geared { motor: j, .. } => Some(j),
            Place::Actuator(_) | Place::All => None,
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
            Place::Joint(j) | Place::Pair { on: j, .. } | Place::Geared { motor: j, .. } => {
                Some(robot.joint_names()[j].clone())
            }
            Place::Actuator(0) => Some("x_r".to_owned()),
            Place::Actuator(_) => Some("y_r".to_owned()),
            Place::All => None,
        }
    }

    /// Whether the coordinate slides or turns.
    pub fn kind(self, robot: &Robot) -> JointKind {
        match self {
            Place::Joint(j) | Place::Pair { on: j, .. } | Place::Geared { motor: j, .. } => {
                robot.joint_kind(j)
            }
            Place::Actuator(_) => JointKind::Prismatic,
            Place::All => robot.joint_kind(0),
        }
    }
}

/// Unit of an effect's parameter, told once the coordinate is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// N or Nm.
    Torque,
    /// Torque per speed.
    Viscous,
    /// Torque per position.
    Stiffness,
    /// Torque per cube of position.
    Cubic,
    /// Torque per acceleration.
    Inertia,
    /// Torque per second.
    TorqueRate,
    /// Speed.
    Speed,
    /// Position.
    Position,
    /// Waves per revolution or metre.
    Order,
    /// A name of its own.
    Text(&'static str),
}

impl Unit {
    /// The unit for a coordinate of this kind whose torque is in `torque`.
    pub fn text(self, kind: JointKind, torque: &str) -> String {
        let position = kind.position_unit();
        match self {
            Unit::Torque => torque.to_owned(),
            Unit::Viscous => format!("{torque} s/{position}"),
            Unit::Stiffness => format!("{torque}/{position}"),
            Unit::Cubic => format!("{torque}/{position}^3"),
            Unit::Inertia if torque == "A" => format!("A s^2/{position}"),
            Unit::Inertia => match kind {
                JointKind::Prismatic => "kg".to_owned(),
                JointKind::Revolute => "kg m^2".to_owned(),
            },
            Unit::TorqueRate => format!("{torque}/s"),
            Unit::Speed => format!("{position}/s"),
            Unit::Position => position.to_owned(),
            Unit::Order => match kind {
                JointKind::Prismatic => "1/m".to_owned(),
                JointKind::Revolute => "1/rev".to_owned(),
            },
            Unit::Text(text) => text.to_owned(),
        }
    }
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    pub name: &'static str,
    pub unit: Unit,
}

impl Key {
    const fn new(name: &'static str, unit: Unit) -> Self {
        Key { name, unit }
    }
}

/// Along one stretch: the motion, and what the model as it stands makes of it.
pub struct Scene<'a> {
    pub robot: &'a Robot,
    pub theta: &'a [f64],
    pub laws: &'a [JointFriction],
    pub stretch: &'a Stretch,
    /// Reconstructed torque per joint, effects included, timing effects not [N or Nm].
    pub hat: &'a [Vec<f64>],
    /// Load torque per joint: the reconstructed torque less friction and offset.
    pub load: &'a [Vec<f64>],
}

impl Scene<'_> {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.stretch.len()
    }

    /// Whether the stretch holds no sample.
    pub fn is_empty(&self) -> bool {
        self.stretch.is_empty()
    }
}

/// Shapes to begin the search from, or what the data lack for the effect.
pub type Starts = Result<Vec<Vec<f64>>, String>;

/// Fills the columns of one joint along a scene: place, shape, joint, columns.
pub type Fill = fn(&Scene, Place, &[f64], usize, &mut [Vec<f64>]);

/// How an effect's coefficients are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Columns that are added to the torque.
    Columns,
    /// Shifts the whole torque of its joints in time; its column is the derivative by the shift.
    Shift,
    /// Cannot be found by a fit that was free while carrying it: only with the model held.
    Kept,
}

/// A kind of effect.
pub struct Kind {
    pub name: &'static str,
    pub family: Family,
    pub role: Role,
    /// Parameters that shape the columns, searched.
    pub shape: &'static [Key],
    /// Coefficients of the columns, one each.
    pub linear: &'static [Key],
    /// Where on this robot it can sit.
    pub places: fn(&Robot, &[JointFriction]) -> Vec<Place>,
    /// Shapes to try on these data, or what they lack.
    pub starts: fn(&Cover, Place) -> Starts,
    /// Limits of each shape parameter on these data.
    pub limits: fn(&Cover, Place) -> Vec<[f64; 2]>,
    /// Adds to `out` (one vector per linear coefficient, zero before) the columns of joint `joint`.
    pub columns: Fill,
    /// Experiment that separates the effect from its like.
    pub separate_by: &'static str,
}

impl std::fmt::Debug for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// All effects, in the order of preference.
pub const KINDS: &[&Kind] = &[
    &delay::KIND,
    &torque_offset::KIND,
    &gravity_tilt::KIND,
    &gain::KIND,
    &asymmetric_friction::KIND,
    &stribeck::KIND,
    &nonlinear_viscous::KIND,
    &load_friction::KIND,
    &drive_efficiency::KIND,
    &actuator_friction::KIND,
    &rotor_inertia::KIND,
    &rigid_body_terms::KIND,
    &presliding::KIND,
    &backlash::KIND,
    &ripple::KIND,
    &position_friction::KIND,
    &spring::KIND,
    &counterbalance::KIND,
    &coupling::KIND,
    &elasticity::KIND,
    &payload::KIND,
    &carried::KIND,
    &warm_up::KIND,
    &drift::KIND,
];

/// The kind of a name: the first, where robots of several kinds have one each.
pub fn kind(name: &str) -> Option<&'static Kind> {
    KINDS.iter().find(|k| k.name == name).copied()
}

/// The kind of a name on a robot: that with the robot's own columns where there are several.
pub fn kind_on(robot: &Robot, name: &str) -> Option<&'static Kind> {
    match (name, robot.tool_stays_level()) {
        ("payload", false) => Some(&carried::KIND),
        _ => kind(name),
    }
}

/// Names of all effects, each once.
pub fn names() -> impl Iterator<Item = &'static str> {
    let repeated = |i: usize| i > 0 && KINDS[i - 1].name == KINDS[i].name;
    let kinds = KINDS.iter().enumerate();
    kinds.filter_map(move |(i, kind)| (!repeated(i)).then_some(kind.name))
}

/// Whether a periodic effect's order can be that of its place; see `ripple`.
pub fn order_is_whole(cover: &Cover, place: Place, order: f64) -> bool {
    ripple::is_whole(cover, place, order)
}

/// Every joint.
fn every_joint(robot: &Robot, _: &[JointFriction]) -> Vec<Place> {
    (0..robot.joints()).map(Place::Joint).collect()
}

/// An effect without a shape fits any data.
fn no_shape(_: &Cover, _: Place) -> Starts {
    Ok(vec![Vec::new()])
}

/// No limits for no shape.
fn no_limits(_: &Cover, _: Place) -> Vec<[f64; 2]> {
    Vec::new()
}
