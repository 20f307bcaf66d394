//! Experiments on the CFT robot with sound defaults: gains, one-joint ladders, the Table 3 run.
//!
//! The gains put each motor coordinate's own mode at about 60 rad/s (x_c1, x_c2) and 45 rad/s (x_c3,
//! x_c4) with a damping of 0.6, for the inertia that its motor sees in the middle of the limits (229 kg
//! on y_r, 270 kg on x_r, 1.3 kg m^2 on x_c3, 129 kg on x_c4).

use super::SimulateError;
use super::cft::{CftPlant, CftTruth};
use super::controller::Control;
use super::effects::{EffectSpec, EffectValue, Effects, Sites};
use super::plant::Plant;
use super::recording::Recording;
use super::reference::{
    Fourier, Frame, LadderPlan, Path, Reference, TURN, Travel, middle_part, travel,
};
use super::run::{Drive, Start, run};
use super::settings::Settings;
use crate::robot::cft::actuation::{Limits, Setup};
use crate::robot::cft::pantograph::{DOWNWARD_RATIO, OUTWARD_RATIO, joints};
use crate::robot::cft::{COORDINATES, JOINTS};

/// Top speed of every motor: 4000 revolutions per minute \[rad/s\].
const MOTOR_SPEED: f64 = 4000.0 * std::f64::consts::TAU / 60.0;

/// Motor angle to y_r, x_r, x_c3, x_c4, gear and conversion ratio of Table 6 \[m/rad, rad/rad\].
const CONVERSION: [f64; 4] = [
    0.5 * 0.005 / std::f64::consts::TAU,
    0.5 * 0.005 / std::f64::consts::TAU,
    6.16 / (182.0 * std::f64::consts::TAU),
    0.06 / (6.0 * std::f64::consts::TAU),
];

/// Share of the motors' top speed that a ladder uses.
const SPEED_SHARE: f64 = 0.95;
/// Distance to every limit, as a fraction of its span.
const MARGIN: f64 = 0.05;
/// Slowest plateau of q1 \[m/s\] and of q2, q4, q5 \[rad/s\]: a third of the speed at which friction
/// with a slope of 200 s/m or 60 s/rad bends.
const LOWEST: [f64; 4] = [0.0015, 0.005, 0.005, 0.005];

/// Top speeds of the motor coordinates (x_c1, x_c2, x_c3, x_c4) at 4000 revolutions per minute:
/// 0.167 m/s on y_r and x_r (seven and six times that on x_c1 and x_c2), 2.26 rad/s, 0.667 m/s.
pub fn coordinate_speeds() -> [f64; 4] {
    let ratio = [DOWNWARD_RATIO, OUTWARD_RATIO, 1.0, 1.0];
    std::array::from_fn(|i| ratio[i] * CONVERSION[i] * MOTOR_SPEED)
}

impl Control<4> {
    /// Gains that hold and track well on the set-up at 1 kHz.
    pub fn cft(setup: Setup) -> Self {
        // Volts per newton differ by a factor of four between the set-ups.
        let scale = Setup::Tuedacs.gains()[0] / setup.gains()[0];
        Self {
            proportional: [270.0, 375.0, 80.0, 2400.0].map(|kp| scale * kp),
            derivative: [5.4, 7.5, 2.1, 64.0].map(|kd| scale * kd),
            filter_hz: 50.0,
        }
    }
}

/// What moves in a one-joint experiment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mover {
    /// A joint, by its index in (q1, q2, q4, q5).
    Joint(usize),
    /// A motor coordinate, by its index in (x_c1, x_c2, x_c3, x_c4); q4 and q5 then move together.
    Motor(usize),
}

impl Mover {
    /// The joint or motor coordinate of that name.
    ///
    /// # Errors
    /// [`SimulateError::UnknownJoint`].
    pub fn named(name: &str) -> Result<Self, SimulateError> {
        let place = |names: [&str; 4]| names.iter().position(|known| *known == name);
        let joint = place(JOINTS).map(Self::Joint);
        let motor = || place(COORDINATES).map(Self::Motor);
        joint
            .or_else(motor)
            .ok_or_else(|| SimulateError::UnknownJoint {
                name: name.to_owned(),
                known: [JOINTS, COORDINATES].concat().join(", "),
            })
    }

    fn index(self) -> usize {
        match self {
            Self::Joint(index) | Self::Motor(index) => index,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Joint(_) => JOINTS[self.index()],
            Self::Motor(_) => COORDINATES[self.index()],
        }
    }
}

/// One joint moves over its range at a ladder of speeds, the others are commanded to hold.
#[derive(Debug, Clone, PartialEq)]
pub struct OneJointMove {
    pub mover: Mover,
    /// Limits of the motor coordinates; those of the set-up where absent.
    pub limits: Option<Limits>,
    /// Motor coordinates (x_c1..x_c4) around which it moves; the middle of the limits where absent.
    pub pose: Option<[f64; 4]>,
    /// Range of the mover, m or rad; what the limits leave, with a margin, where absent.
    pub range: Option<(f64, f64)>,
    /// Middle part of the range that the limits leave; all of it, 1, unless asked for.
    pub part: f64,
    /// Plateau speeds, m/s or rad/s; ten in equal ratios up to the motors' limit where absent.
    pub speeds: Option<Vec<f64>>,
    /// Largest acceleration, m/s^2 or rad/s^2; by mover and set-up where absent.
    pub acceleration: Option<f64>,
    /// Time from zero speed to a slow plateau \[s\]; that of the usual ladder where absent.
    pub turn: Option<f64>,
    /// Duration \[s\].
    pub seconds: f64,
    /// Shuffles the order of the speeds and the end at which the motion starts.
    pub seed: Option<u64>,
}

impl OneJointMove {
    /// The default ladder of joint 0..3 (q1, q2, q4, q5).
    pub fn new(joint: usize, seconds: f64, seed: Option<u64>) -> Self {
        Self {
            mover: Mover::Joint(joint),
            limits: None,
            pose: None,
            range: None,
            part: 1.0,
            speeds: None,
            acceleration: None,
            turn: None,
            seconds,
            seed,
        }
    }

    /// The reference that the controller follows.
    ///
    /// # Errors
    /// [`SimulateError`] when there is no such joint or the ladder does not fit.
    pub fn reference(&self, setup: Setup) -> Result<Reference<4>, SimulateError> {
        let place = self.mover.index();
        if place >= 4 {
            return Err(SimulateError::UnknownJoint {
                name: format!("number {place}"),
                known: JOINTS.join(", "),
            });
        }
        let limits = self.limits.unwrap_or(setup.limits());
        let plant = CftPlant::new(&CftTruth::synthetic(setup)).with_limits(limits);
        let middle = self.pose.unwrap_or(limits.middles());
        let (frame, mut pose, room) = match self.mover {
            Mover::Joint(_) => {
                let pose = joints(&middle)?;
                let room = travel(&plant, &pose, place, MARGIN, &coordinate_speeds())?;
                (Frame::Joints, pose, room)
            }
            Mover::Motor(_) => {
                let gap = MARGIN * limits.spans()[place];
                let room = Travel {
                    range: (limits.lower[place] + gap, limits.upper[place] - gap),
                    top_speed: coordinate_speeds()[place],
                };
                (Frame::Motors, middle, room)
            }
        };
        let range = self.range.unwrap_or(middle_part(room.range, self.part));
        if range.0 < room.range.0 - 1e-9 || range.1 > room.range.1 + 1e-9 {
            return Err(SimulateError::Reference {
                what: format!(
                    "{} cannot move over [{}, {}]: at this pose the limits leave [{:.4}, {:.4}]",
                    self.mover.name(),
                    range.0,
                    range.1,
                    room.range.0,
                    room.range.1
                ),
            });
        }
        let (lowest, acceleration) = match self.mover {
            Mover::Joint(_) => (LOWEST[place], acceleration(setup)[place]),
            Mover::Motor(_) => {
                // The motor's own share of the joint values: x_c4 is q1, x_c3 is q2.
                let of =
                    |joints: [f64; 4]| [0.3 * joints[2], 0.3 * joints[3], joints[1], joints[0]];
                (of(LOWEST)[place], of(acceleration(setup))[place])
            }
        };
        // strokes last as long as those of the whole range, so that the controller follows them as well
        let acceleration = self.acceleration.unwrap_or(self.part * acceleration);
        let top = SPEED_SHARE * room.top_speed;
        let ladder = match &self.speeds {
            None => LadderPlan::usual(range, (lowest, top), acceleration, self.seconds, self.seed)?,
            Some(speeds) => LadderPlan {
                range,
                speeds: speeds.clone(),
                acceleration,
                turn: self.turn.unwrap_or(TURN),
                seconds: self.seconds,
            }
            .build_seeded(self.seed)?,
        };
        pose[place] = ladder.at(0.0).0;
        Ok(Reference {
            frame,
            path: Path::Ladder {
                moving: place,
                pose,
                ladder,
            },
        })
    }
}

/// Accelerations that leave the amplifiers a reserve, for q1, q2, q4, q5 in m/s^2 and rad/s^2.
const fn acceleration(setup: Setup) -> [f64; 4] {
    match setup {
        Setup::Tuedacs => [3.0, 8.0, 10.0, 10.0],
        Setup::Dspace => [0.6, 6.0, 6.0, 6.0],
    }
}

/// The Table 3 run on the set-up: on dSPACE x_c4 moves about the middle of its own limits.
pub fn excitation(setup: Setup) -> Reference<4> {
    excitation_of(setup, Fourier::table_3())
}

/// [`excitation`], begun anywhere in its period.
pub fn excitation_at_random_phase(setup: Setup, seed: u64) -> Reference<4> {
    excitation_of(setup, Fourier::table_3().at_random_phase(seed))
}

fn excitation_of(setup: Setup, mut series: Fourier<4>) -> Reference<4> {
    if setup == Setup::Dspace {
        series.offset[3] = setup.limits().middles()[3];
    }
    Reference {
        frame: Frame::Motors,
        path: Path::Fourier(series),
    }
}

/// The effects on a CFT robot.
///
/// # Errors
/// As [`Effects::build`].
pub fn effects(
    truth: &CftTruth,
    specs: &[EffectSpec],
) -> Result<(Effects, Vec<EffectValue>), SimulateError> {
    Effects::build(specs, &Sites::cft(truth)?)
}

/// Runs a reference with the default gains, from the settled start.
///
/// # Errors
/// As [`run`].
pub fn follow(
    truth: &CftTruth,
    specs: &[EffectSpec],
    reference: Reference<4>,
    settings: &Settings<4>,
) -> Result<Recording<4>, SimulateError> {
    truth.check()?;
    let (effects, _) = effects(truth, specs)?;
    let drive = Drive::Follow {
        reference,
        control: Control::cft(truth.setup),
    };
    run(
        &CftPlant::new(truth),
        effects,
        &Start::Settled,
        &drive,
        settings,
    )
}

/// Largest distance between the wanted and the actual motor coordinates, and its root mean square.
pub fn tracking_error<P: Plant<4>>(plant: &P, recording: &Recording<4>) -> ([f64; 4], [f64; 4]) {
    let mut worst = [0.0; 4];
    let mut squares = [0.0; 4];
    for (q, target) in recording.actual.q.iter().zip(&recording.actual.target) {
        let x = plant.coordinates(q);
        for i in 0..4 {
            let error = (x[i] - target[i]).abs();
            worst[i] = f64::max(worst[i], error);
            squares[i] += error * error;
        }
    }
    let rows = recording.rows().max(1) as f64;
    (worst, squares.map(|s| (s / rows).sqrt()))
}
