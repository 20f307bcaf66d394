//! One-joint experiments: one joint, or one motor's coordinate, runs over its range at a ladder of speeds.

use super::SimulateError;
use super::mechanism::Mechanism;
use super::reference::{
    JointTravel, LadderPlan, LadderReference, Path, Reference, ReferenceFrame, TURN, middle_part,
    travel,
};
use cft_ident_core::explain::ErrorText;
use cft_ident_core::robot::Robot;
use cft_ident_files::config::trajectory::SingleJointMove;

/// Share of the motors' top speed that a ladder uses.
const SPEED_SHARE: f64 = 0.95;
/// Distance to every limit, as a fraction of its span.
const MARGIN: f64 = 0.05;
/// Ratio of the fastest to the slowest plateau, where nothing is known of the speeds that matter.
const SPEED_RATIO: f64 = 300.0;
/// Strokes per second^2 that the acceleration stands for where nothing bounds it: a full one takes about a second.
const STROKES: f64 = 8.0;

/// What moves in a one-joint experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MovedAxis {
    /// A joint, by its index.
    Joint(usize),
    /// A motor's coordinate, by its index; on the CFT robot q4 and q5 move together with x_c1 and x_c2.
    Motor(usize),
}

impl MovedAxis {
    /// The joint or motor's coordinate of that name.
    pub fn named(robot: &Robot, name: &str) -> Result<Self, SimulateError> {
        let mut known = robot.joint_names().to_vec();
        let joints = known.len();
        if let Some(motors) = robot.transmission().coordinates() {
            known.extend(motors.iter().map(|&motor| motor.to_owned()));
        }
        let place = SimulateError::place_of(&known, name)?;
        Ok(match place.checked_sub(joints) {
            None => Self::Joint(place),
            Some(motor) => Self::Motor(motor),
        })
    }

    fn index(self) -> usize {
        match self {
            Self::Joint(index) | Self::Motor(index) => index,
        }
    }

    fn name(self, robot: &Robot) -> String {
        match self {
            Self::Joint(index) => robot.joint_names()[index].clone(),
            Self::Motor(index) => robot.coordinate_names().swap_remove(index),
        }
    }
}

/// One joint moves over its range at a ladder of speeds, the others are commanded to hold.
#[derive(Debug, Clone, PartialEq)]
pub struct OneJointMove {
    pub mover: MovedAxis,
    /// Range of the mover, m or rad; what the limits leave with a margin, the others in their middle, where absent.
    pub range: Option<(f64, f64)>,
    /// Middle part of the range that the limits leave; all of it, 1, unless asked for.
    pub part: f64,
    /// Plateau speeds, m/s or rad/s; ten in equal ratios up to the motors' limit where absent.
    pub speeds: Option<Vec<f64>>,
    /// Largest acceleration, m/s^2 or rad/s^2; by what is known of robot and limits where absent.
    pub acceleration: Option<f64>,
    /// Time from zero speed to a slow plateau \[s\]; that of the usual ladder where absent.
    pub turn: Option<f64>,
    /// Duration \[s\].
    pub seconds: f64,
    /// Shuffles the order of the speeds and the end at which the motion starts.
    pub seed: Option<u64>,
}

impl OneJointMove {
    /// The default ladder of a joint.
    pub fn new(joint: usize, seconds: f64, seed: Option<u64>) -> Self {
        Self {
            mover: MovedAxis::Joint(joint),
            range: None,
            part: 1.0,
            speeds: None,
            acceleration: None,
            turn: None,
            seconds,
            seed,
        }
    }

    /// The ladder of a file.
    pub fn of(
        file: &SingleJointMove,
        robot: &Robot,
        seconds: f64,
        seed: u64,
    ) -> Result<Self, SimulateError> {
        Ok(Self {
            mover: MovedAxis::named(robot, &file.joint)?,
            range: file.range.map(|[low, high]| (low, high)),
            speeds: Some(file.speeds.clone()),
            acceleration: file.acceleration,
            turn: file.turn_s,
            ..Self::new(0, seconds, Some(seed))
        })
    }

    /// The reference that the controller follows.
    ///
    /// # Errors
    /// [`SimulateError`] when there is no such joint, its travel is not known or the ladder does not fit.
    pub fn reference<const J: usize>(
        &self,
        mechanism: &Mechanism<J>,
    ) -> Result<Reference<J>, SimulateError> {
        let (m, place) = (mechanism, self.mover.index());
        if place >= m.joints() {
            let (name, known) = (format!("number {place}"), m.robot.joint_names());
            return Err(SimulateError::unknown_joint(name, known));
        }
        let (frame, mut pose, room) = self.room(m)?;
        let range = self.within(&room);
        // what stands at the joint itself is looked at while it runs
        let beyond = range.0 < room.range.0 - 1e-9 || range.1 > room.range.1 + 1e-9;
        if beyond && !m.motors_at_joints() {
            let (name, (from, to)) = (self.mover.name(&m.robot), room.range);
            return Err(SimulateError::reference(format!(
                "{name} cannot move over [{}, {}]: at this pose the limits leave [{from:.4}, {to:.4}]",
                range.0, range.1
            )));
        }
        let ladder = self.ladder(m, range, &room)?;
        pose[place] = ladder.at(0.0).0;
        let path = Path::Ladder {
            moving: place,
            pose,
            ladder,
        };
        Ok(Reference { frame, path })
    }

    /// The range that the mover runs over.
    pub(crate) fn travel<const J: usize>(
        &self,
        mechanism: &Mechanism<J>,
    ) -> Result<(f64, f64), SimulateError> {
        Ok(self.within(&self.room(mechanism)?.2))
    }

    fn within(&self, room: &JointTravel) -> (f64, f64) {
        self.range.unwrap_or(middle_part(room.range, self.part))
    }

    /// Frame and pose of the others, and the room that the limits leave the mover.
    fn room<const J: usize>(
        &self,
        m: &Mechanism<J>,
    ) -> Result<(ReferenceFrame, [f64; J], JointTravel), SimulateError> {
        let (place, middle) = (self.mover.index(), m.middle());
        let speeds = match &m.practice {
            Some(practice) => m.filled(|i| practice.speeds[i]),
            None => [f64::INFINITY; J],
        };
        if let (MovedAxis::Joint(_), false) = (self.mover, m.motors_at_joints()) {
            let pose = m.pose(&middle)?;
            let room = travel(m, &pose, place, MARGIN, &speeds)?;
            return Ok((ReferenceFrame::Joints, pose, room));
        }
        let gap = MARGIN * (m.upper[place] - m.lower[place]);
        let room = JointTravel {
            range: (m.lower[place] + gap, m.upper[place] - gap),
            top_speed: speeds[place],
        };
        let known = self.range.unwrap_or(room.range);
        if !(known.0.is_finite() && known.1.is_finite()) {
            let name = self.mover.name(&m.robot);
            let remedy =
                format!("write `[limits.{name}] position = [low, high]` into the robot file");
            let what = ErrorText::new(format!("the travel of {name} is not known"));
            return Err(SimulateError::reference(what.remedy(remedy)));
        }
        let frame = match self.mover {
            MovedAxis::Joint(_) => ReferenceFrame::Joints,
            MovedAxis::Motor(_) => ReferenceFrame::Motors,
        };
        Ok((frame, middle, room))
    }

    fn ladder<const J: usize>(
        &self,
        m: &Mechanism<J>,
        range: (f64, f64),
        room: &JointTravel,
    ) -> Result<LadderReference, SimulateError> {
        let place = self.mover.index();
        let given = m.given.get(&self.mover.name(&m.robot));
        let of_practice = m.practice.as_ref().map(|practice| match self.mover {
            MovedAxis::Joint(_) => practice.joint_ladders[place],
            MovedAxis::Motor(_) => practice.coordinate_ladders[place],
        });
        let whole = self.range.unwrap_or(room.range);
        let acceleration = (of_practice.map(|[_, acceleration]| acceleration))
            .or_else(|| given?.acceleration)
            .unwrap_or(STROKES * (whole.1 - whole.0));
        // strokes last as long as those of the whole range, so that the controller follows them as well
        let acceleration = self.acceleration.unwrap_or(self.part * acceleration);
        if let Some(speeds) = &self.speeds {
            let plan = LadderPlan {
                range,
                speeds: speeds.clone(),
                acceleration,
                turn: self.turn.unwrap_or(TURN),
                seconds: self.seconds,
            };
            // any turn may be given
            return plan.within_range(plan.build_seeded(self.seed)?);
        }
        let ends = match of_practice {
            Some([lowest, _]) => (lowest, SPEED_SHARE * room.top_speed),
            None => {
                let fastest = LadderPlan::fastest(range, acceleration);
                let top = given.and_then(|given| given.speed);
                let top = fastest.min(top.unwrap_or(fastest));
                (top / SPEED_RATIO, top)
            }
        };
        LadderPlan::usual(range, ends, acceleration, self.seconds, self.seed)
    }
}
