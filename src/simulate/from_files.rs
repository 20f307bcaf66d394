//! From robot, model and trajectory files to plants, references and settings.

use super::SimulateError;
use super::cft::CftTruth;
use super::cft_experiment::{Mover, OneJointMove};
use super::controller::Control;
use super::plant::Plant;
use super::reference::{Fourier, Frame, LadderPlan, Path, Points, Reference, TURN, middle_part};
use super::sensors::{Noise, Sensors};
use super::settings::Settings;
use super::single_joint::{SingleJointFriction, SingleJointTruth};
use crate::config::robot_file::{FrictionLawKind, RobotFile};
use crate::config::trajectory::{self, Coordinates, SingleJointMove, Trajectory};
use crate::config::{ModelFile, robot_file};
use crate::robot::JointKind;
use crate::robot::cft::pantograph::joints;
use crate::robot::cft::{COORDINATES, JOINTS, Limits, Setup};

/// Time within which a Fourier series reaches full speed, where its file does not say \[s\].
const BLEND: f64 = 2.0;
/// Duration of a ladder where none is given \[s\].
pub(super) const SECONDS: f64 = 20.0;
/// Ratio of the fastest to the slowest plateau of a single joint's ladder.
const SPEED_RATIO: f64 = 300.0;

/// A reference of J coordinates, or why there is none.
type Outcome<const J: usize> = Result<Reference<J>, SimulateError>;

/// True parameters of the CFT robot: those of the model, or the synthetic ones.
///
/// # Errors
/// [`SimulateError::Config`] where the model lacks a parameter or belongs to another robot.
pub fn cft_truth(
    robot: &RobotFile,
    model: Option<(&str, &ModelFile)>,
) -> Result<CftTruth, SimulateError> {
    let setup = robot.robot.setup.unwrap_or_default();
    let mut truth = CftTruth::synthetic(setup);
    if let Some((file, model)) = model {
        model.belongs_to(file, robot)?;
        truth.theta = [0.0; 22];
        for (own, value) in truth.theta.iter_mut().zip(model.inertial(file)?) {
            *own = value;
        }
        for (law, joint) in truth.friction.iter_mut().zip(JOINTS) {
            *law = model.double_tanh(file, joint)?;
        }
    }
    Ok(truth)
}

/// Limits of x_c1..x_c4: those of the set-up, and `[limits] position` where the file has it.
pub fn cft_limits(robot: &RobotFile, setup: Setup) -> Limits {
    let mut limits = setup.limits();
    for (i, name) in COORDINATES.iter().enumerate() {
        if let Some([lower, upper]) = robot.limits.get(*name).and_then(|l| l.position) {
            (limits.lower[i], limits.upper[i]) = (lower, upper);
        }
    }
    limits
}

/// True parameters of a single joint: those of the model.
///
/// The encoder's count is `[noise.joint] position_resolution`, the travel `[limits] position`, and one volt
/// stands for one unit of torque.
///
/// # Errors
/// [`SimulateError::Unsupported`] without a model; [`SimulateError::Config`] where it lacks a parameter.
pub fn single_joint_truth(
    robot: &RobotFile,
    model: Option<(&str, &ModelFile)>,
) -> Result<SingleJointTruth, SimulateError> {
    let Some((file, model)) = model else {
        return Err(SimulateError::Unsupported {
            what: "a single joint has no parameters of its own; give a model with -m".to_owned(),
        });
    };
    model.belongs_to(file, robot)?;
    let name = robot.joint_names().swap_remove(0);
    let inertia = model.inertial(file)?[0];
    let friction = match robot.friction_law() {
        FrictionLawKind::DoubleTanh => {
            SingleJointFriction::DoubleTanh(model.double_tanh(file, &name)?)
        }
        FrictionLawKind::ViscousCoulomb => {
            SingleJointFriction::viscous_coulomb(model.viscous_coulomb(file, &name)?, inertia)
        }
    };
    let noise = robot.noise.joint.get(&name);
    let limits = robot.limits.get(&name).and_then(|limits| limits.position);
    Ok(SingleJointTruth {
        kind: robot.robot.kind.unwrap_or(JointKind::Revolute),
        inertia,
        friction,
        offset: model.offset(&name),
        gain: 1.0,
        resolution: noise.and_then(|n| n.position_resolution).unwrap_or(0.0),
        limits: limits.map_or((f64::NEG_INFINITY, f64::INFINITY), |[low, high]| {
            (low, high)
        }),
        name,
    })
}

/// Gains of `[control]` over the usual ones.
///
/// # Errors
/// [`SimulateError::Parameter`] when there are not as many gains as motors.
pub fn control<const J: usize>(
    robot: &RobotFile,
    usual: Control<J>,
) -> Result<Control<J>, SimulateError> {
    let section = &robot.control;
    let gains = |name: &'static str, given: &[f64], usual: [f64; J]| match given {
        [] => Ok(usual),
        given => <[f64; J]>::try_from(given).map_err(|_| SimulateError::Parameter {
            name,
            value: given.len() as f64,
            rule: "must be one gain per motor",
        }),
    };
    // Gains without a derivative part are the report's P controller.
    let derivative = if section.kp.is_empty() {
        usual.derivative
    } else {
        [0.0; J]
    };
    Ok(Control {
        proportional: gains("number of gains kp", &section.kp, usual.proportional)?,
        derivative: gains("number of gains kd", &section.kd, derivative)?,
        filter_hz: section.derivative_filter_hz.unwrap_or(usual.filter_hz),
    })
}

/// Rate and sensors of `[control]` and `[sensors]`; duration and seed are left as they are by default.
///
/// # Errors
/// [`SimulateError::Parameter`] when there are not as many noise levels as joints, or both kinds.
pub fn settings<const J: usize>(robot: &RobotFile) -> Result<Settings<J>, SimulateError> {
    let mut settings = Settings::new(SECONDS);
    settings.rate_hz = robot.control.rate_hz.unwrap_or(settings.rate_hz);
    let robot_file::SensorsSection {
        quantisation,
        volt_noise,
        ref torque_noise,
        torque_noise_relative,
        jitter,
        dropouts,
    } = robot.sensors;
    let torque_noise = match (torque_noise.as_slice(), torque_noise_relative) {
        ([], None) => Noise::None,
        ([], Some(share)) => Noise::Relative(share),
        ([one], None) => Noise::Absolute([*one; J]),
        (levels, None) => {
            let levels = <[f64; J]>::try_from(levels).map_err(|_| SimulateError::Parameter {
                name: "number of levels torque_noise",
                value: levels.len() as f64,
                rule: "must be one per joint",
            })?;
            Noise::Absolute(levels)
        }
        (_, Some(share)) => {
            return Err(SimulateError::Parameter {
                name: "torque_noise_relative",
                value: share,
                rule: "torque_noise is given too; keep one of them",
            });
        }
    };
    settings.sensors = Sensors {
        quantisation: quantisation.unwrap_or(true),
        jitter: jitter.unwrap_or(0.0),
        dropouts: dropouts.unwrap_or(0.0),
        volt_noise: volt_noise.map_or(Noise::None, |std| Noise::Absolute([std; J])),
        torque_noise,
    };
    Ok(settings)
}

/// Reference of a trajectory file for the CFT robot. Coordinates that a Fourier file leaves out are held
/// in the middle of their limits.
///
/// # Errors
/// [`SimulateError`] where the trajectory names what the robot does not have, or does not fit.
pub fn cft_reference(
    robot: &RobotFile,
    trajectory: &Trajectory,
    setup: Setup,
    seconds: Option<f64>,
    seed: u64,
) -> Outcome<4> {
    let limits = cft_limits(robot, setup);
    let middle = limits.middles();
    let places = |coordinates: Coordinates| -> Result<(Frame, [&str; 4], [f64; 4]), SimulateError> {
        Ok(match coordinates {
            Coordinates::Cartesian => (Frame::Motors, COORDINATES, middle),
            Coordinates::Joint => (Frame::Joints, JOINTS, joints(&middle)?),
        })
    };
    match trajectory {
        Trajectory::Fourier(file) => {
            let (frame, names, rest) = places(file.coordinates)?;
            fourier(file, frame, names, rest)
        }
        Trajectory::Points(file) => {
            let (frame, _, _) = places(file.coordinates)?;
            points(file, frame)
        }
        Trajectory::SingleJoint(file) => OneJointMove {
            range: file.range.map(|[low, high]| (low, high)),
            speeds: Some(file.speeds.clone()),
            acceleration: file.acceleration,
            turn: file.turn_s,
            mover: Mover::named(&file.joint)?,
            limits: Some(limits),
            ..OneJointMove::new(0, seconds.unwrap_or(SECONDS), Some(seed))
        }
        .reference(setup),
    }
}

/// Reference of a trajectory file for a single joint.
///
/// # Errors
/// As [`cft_reference`].
pub fn single_joint_reference(
    robot: &RobotFile,
    truth: &SingleJointTruth,
    trajectory: &Trajectory,
    seconds: Option<f64>,
    seed: u64,
) -> Outcome<1> {
    match trajectory {
        Trajectory::Fourier(file) => fourier(file, Frame::Joints, [truth.name.as_str()], [0.0]),
        Trajectory::Points(file) => points(file, Frame::Joints),
        Trajectory::SingleJoint(file) if file.joint != truth.name => {
            Err(SimulateError::UnknownJoint {
                name: file.joint.clone(),
                known: truth.name.clone(),
            })
        }
        Trajectory::SingleJoint(file) => {
            let seconds = seconds.unwrap_or(SECONDS);
            single_joint_ladder(robot, truth, LadderOf::File(file), seconds, seed)
        }
    }
}

/// Which ladder a single joint runs.
#[derive(Debug, Clone, Copy)]
pub enum LadderOf<'a> {
    /// That of a file.
    File(&'a SingleJointMove),
    /// Ten speeds over the middle part of the range, 1 for all of it.
    Usual { part: f64 },
}

/// Ladder of a single joint over the range of its limits (or of the file), at the file's speeds or at ten up
/// to the speed limit.
///
/// # Errors
/// [`SimulateError::Reference`] where no range is known or the ladder does not fit into it.
pub fn single_joint_ladder(
    robot: &RobotFile,
    truth: &SingleJointTruth,
    ladder: LadderOf,
    seconds: f64,
    seed: u64,
) -> Outcome<1> {
    let (file, part) = match ladder {
        LadderOf::File(file) => (Some(file), 1.0),
        LadderOf::Usual { part } => (None, part),
    };
    let limits = robot.limits.get(&truth.name).cloned().unwrap_or_default();
    let (lower, upper) = truth.limits();
    let margin = 0.05 * (upper[0] - lower[0]);
    let range = file
        .and_then(|file| file.range)
        .map_or((lower[0] + margin, upper[0] - margin), |[low, high]| {
            (low, high)
        });
    if !(range.0.is_finite() && range.1.is_finite()) {
        return Err(SimulateError::Reference {
            what: format!(
                "the travel of {} is not known; write `[limits.{}] position = [low, high]` into the robot file",
                truth.name, truth.name
            ),
        });
    }
    // Without a limit a full stroke takes about a second.
    let acceleration = file
        .and_then(|file| file.acceleration)
        .or(limits.acceleration);
    let acceleration = acceleration.unwrap_or(8.0 * (range.1 - range.0));
    // strokes last as long as those of the whole range, so that the controller follows them as well
    let (range, acceleration) = (middle_part(range, part), part * acceleration);
    let ladder = match file {
        Some(file) => LadderPlan {
            range,
            speeds: file.speeds.clone(),
            acceleration,
            turn: file.turn_s.unwrap_or(TURN),
            seconds,
        }
        .build_seeded(Some(seed))?,
        None => {
            let fastest = LadderPlan::fastest(range, acceleration);
            let top = fastest.min(limits.speed.unwrap_or(fastest));
            LadderPlan::usual(
                range,
                (top / SPEED_RATIO, top),
                acceleration,
                seconds,
                Some(seed),
            )?
        }
    };
    Ok(Reference {
        frame: Frame::Joints,
        path: Path::Ladder {
            moving: 0,
            pose: [ladder.at(0.0).0],
            ladder,
        },
    })
}

pub(super) fn fourier<const J: usize>(
    file: &trajectory::Fourier,
    frame: Frame,
    names: [&str; J],
    rest: [f64; J],
) -> Outcome<J> {
    let terms = file
        .series
        .iter()
        .map(|series| series.a.len())
        .max()
        .unwrap_or(0);
    let mut series = Fourier {
        offset: rest,
        a: vec![[0.0; J]; terms],
        b: vec![[0.0; J]; terms],
        fundamental: std::f64::consts::TAU * file.fundamental_hz,
        start: file.start_s.unwrap_or(0.0),
        blend: file.blend_s.unwrap_or(BLEND),
        periods: file.periods,
    };
    for coordinate in &file.series {
        let Some(i) = names.iter().position(|name| *name == coordinate.name) else {
            return Err(SimulateError::UnknownJoint {
                name: coordinate.name.clone(),
                known: names.join(", "),
            });
        };
        series.offset[i] = coordinate.offset;
        for (l, (a, b)) in coordinate.a.iter().zip(&coordinate.b).enumerate() {
            series.a[l][i] = *a;
            series.b[l][i] = *b;
        }
    }
    Ok(Reference {
        frame,
        path: Path::Fourier(series),
    })
}

pub(super) fn points<const J: usize>(file: &trajectory::Points, frame: Frame) -> Outcome<J> {
    let mut list = Vec::with_capacity(file.points.len());
    let first = file.points.first().map_or(0.0, |point| point.t);
    for (k, point) in file.points.iter().enumerate() {
        let Ok(pose) = <[f64; J]>::try_from(point.position.as_slice()) else {
            return Err(SimulateError::Reference {
                what: format!(
                    "point {} has {} coordinates and the robot has {J}",
                    k + 1,
                    point.position.len()
                ),
            });
        };
        list.push((point.t - first, pose));
    }
    Ok(Reference {
        frame,
        path: Path::Points(Points::new(&list)?),
    })
}
