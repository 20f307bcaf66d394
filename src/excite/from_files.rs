//! From robot, model and trajectory files to a machine and its series, and back.

use std::f64::consts::TAU;

use crate::config::robot_file::CoordinateLimits;
use crate::config::trajectory::{Fourier, FourierCoordinate};
use crate::config::{ModelFile, RobotFile};
use crate::inertia::columns::{Own, RegressorColumns};
use crate::robot::cft::pantograph::TURN_OFFSET;
use crate::robot::cft::{COORDINATES, JOINTS, geometry};
use crate::robot::model::{JointFriction, Model};
use crate::robot::{JointKind, Robot};
use crate::simulate::CftTruth;
use crate::simulate::cft_experiment::coordinate_speeds;

use super::ExciteError;
use super::limits::{Channel, Quantity};
use super::machine::{Machine, Motors};
use super::series::Series;

/// Volts that the amplifiers give where `[control] saturation_v` says nothing.
const VOLTS: f64 = 10.0;
/// Least sin q5: links 4 and 5 stay 12 degrees off the line. Inside Table 5 it is above 0.6.
const CLEARANCE: f64 = 0.2;
/// Share of the speed limit within which the sign of a Coulomb column is smoothed in a search.
const SIGN: f64 = 0.005;

/// The machine of a robot file, with the torques of a model, or of the synthetic CFT robot.
///
/// Limits of the CFT robot are those of Table 5, 4000 revolutions per minute of every motor and
/// 10 V (or `[control] saturation_v`), where `[limits]` does not have others. `noise` is left 1.
///
/// # Errors
/// [`ExciteError`] where the model lacks a parameter or belongs to another robot, or a limit is
/// given where none can be kept.
pub fn machine(
    file: &RobotFile,
    model: Option<(&str, &ModelFile)>,
) -> Result<Machine, ExciteError> {
    let robot = file.robot();
    let n = robot.joints();
    let model = match model {
        Some((name, given)) => {
            given.belongs_to(name, file)?;
            given.model(name)?
        }
        None => nominal(file, &robot),
    };
    let mut own = vec![Vec::new(); n];
    if file.friction.fitted_with_inertias {
        for own in &mut own {
            own.extend([Own::Viscous, Own::Coulomb]);
            if file.friction.offset {
                own.push(Own::Offset);
            }
        }
    }
    let setup = robot.transmission().setup();
    let motors = setup.map_or(Motors::Joints, Motors::Cft);
    let mut machine = Machine {
        columns: RegressorColumns {
            joints: n,
            shared: robot.parameters().len(),
            own,
            known: vec![None; n],
        },
        model,
        motors,
        channels: Vec::new(),
        noise: vec![1.0; n],
        coulomb_speed: vec![1.0; n],
    };
    machine.channels = match motors {
        Motors::Cft(_) => cft_channels(file, &machine)?,
        Motors::Joints => joint_channels(file, &machine),
    };
    for i in 0..n {
        let of = |quantity| {
            let mut all = machine.channels.iter();
            all.find(|c| c.index == i && c.quantity == quantity)
        };
        let speed = of(Quantity::Speed).map(|c| c.upper);
        let travel = of(Quantity::Position).map(|c| c.upper - c.lower);
        machine.coulomb_speed[i] = SIGN * speed.or(travel).unwrap_or(1.0);
    }
    Ok(machine)
}

/// Numbers of a robot that no model was given for: the synthetic CFT robot; a single joint of
/// inertia 1 with the friction that its file starts from.
fn nominal(file: &RobotFile, robot: &Robot) -> Model {
    match robot.transmission().setup() {
        Some(setup) => {
            let truth = CftTruth::synthetic(setup);
            Model {
                theta: truth.theta[..robot.parameters().len()].to_vec(),
                friction: truth.friction.map(JointFriction::DoubleTanh).to_vec(),
                offset: vec![0.0; 4],
                robot: robot.clone(),
            }
        }
        None => {
            let friction = robot.joint_names().iter().map(|joint| {
                let start = file.friction.joint.get(joint).cloned().unwrap_or_default();
                match (start.viscous, start.coulomb) {
                    (None, None) => JointFriction::None,
                    (viscous, coulomb) => {
                        JointFriction::ViscousCoulomb(crate::robot::friction::ViscousCoulomb {
                            viscous: viscous.unwrap_or(0.0),
                            coulomb: coulomb.unwrap_or(0.0),
                        })
                    }
                }
            });
            Model {
                theta: vec![1.0; robot.parameters().len()],
                friction: friction.collect(),
                offset: vec![0.0; robot.joints()],
                robot: robot.clone(),
            }
        }
    }
}

fn cft_channels(file: &RobotFile, machine: &Machine) -> Result<Vec<Channel>, ExciteError> {
    let Motors::Cft(setup) = machine.motors else {
        return Ok(Vec::new());
    };
    let (table, gains, speeds) = (setup.limits(), setup.gains(), coordinate_speeds());
    let saturation = file.control.saturation_v.unwrap_or(VOLTS);
    let mut channels = Vec::new();
    for (i, name) in COORDINATES.iter().enumerate() {
        let given = file.limits.get(*name).cloned().unwrap_or_default();
        let unit = machine.coordinate_unit(i);
        let [mut lower, mut upper] = given.position.unwrap_or([table.lower[i], table.upper[i]]);
        let mut speed = given.speed.unwrap_or(speeds[i]);
        let mut acceleration = given.acceleration.unwrap_or(f64::INFINITY);
        // q1 and q2 are x_c4 and x_c3 but for a constant.
        let same = [None, None, Some((1, TURN_OFFSET)), Some((0, -geometry::DS))][i];
        if let Some((joint, shift)) = same
            && let Some(of_joint) = file.limits.get(JOINTS[joint])
        {
            if let Some([low, high]) = of_joint.position {
                (lower, upper) = (lower.max(low + shift), upper.min(high + shift));
            }
            speed = speed.min(of_joint.speed.unwrap_or(f64::INFINITY));
            acceleration = acceleration.min(of_joint.acceleration.unwrap_or(f64::INFINITY));
        }
        let symmetric =
            |quantity, unit: &str, most: f64| Channel::symmetric(quantity, i, name, unit, most);
        channels.push(Channel {
            lower,
            upper,
            ..symmetric(Quantity::Position, unit, 0.0)
        });
        channels.push(symmetric(Quantity::Speed, &format!("{unit}/s"), speed));
        if acceleration.is_finite() {
            let unit = format!("{unit}/s^2");
            channels.push(symmetric(Quantity::Acceleration, &unit, acceleration));
        }
        // a limit on a motor's force is one on its volts
        let force = given.torque.map_or(f64::INFINITY, |force| force / gains[i]);
        let volts = given
            .volts
            .unwrap_or(f64::INFINITY)
            .min(saturation)
            .min(force);
        channels.push(symmetric(Quantity::Drive, "V", volts));
    }
    for (joint, name) in JOINTS.iter().enumerate() {
        let Some(given) = file.limits.get(*name) else {
            continue;
        };
        if given.volts.is_some() {
            return Err(ExciteError::VoltsOfJoint {
                joint: (*name).to_owned(),
            });
        }
        let kind = machine.model.robot.joint_kind(joint);
        of_joint(given, joint, name, kind, joint < 2, &mut channels);
    }
    channels.push(Channel {
        lower: CLEARANCE,
        upper: f64::INFINITY,
        ..Channel::symmetric(Quantity::Clearance, 3, "q5", "", 0.0)
    });
    Ok(channels)
}

/// Limits of a joint that is no designed coordinate (torque alone where it is one, `same`).
fn of_joint(
    given: &CoordinateLimits,
    joint: usize,
    name: &str,
    kind: JointKind,
    same: bool,
    channels: &mut Vec<Channel>,
) {
    let unit = kind.position_unit();
    let symmetric =
        |quantity, unit: &str, most: f64| Channel::symmetric(quantity, joint, name, unit, most);
    if let Some(torque) = given.torque {
        channels.push(symmetric(Quantity::Torque, kind.torque_unit(), torque));
    }
    if same {
        return;
    }
    if let Some([lower, upper]) = given.position {
        channels.push(Channel {
            lower,
            upper,
            ..symmetric(Quantity::JointPosition, unit, 0.0)
        });
    }
    if let Some(speed) = given.speed {
        channels.push(symmetric(Quantity::JointSpeed, &format!("{unit}/s"), speed));
    }
    if let Some(most) = given.acceleration {
        let unit = format!("{unit}/s^2");
        channels.push(symmetric(Quantity::JointAcceleration, &unit, most));
    }
}

fn joint_channels(file: &RobotFile, machine: &Machine) -> Vec<Channel> {
    let robot = &machine.model.robot;
    let mut channels = Vec::new();
    for (i, name) in robot.joint_names().iter().enumerate() {
        let Some(given) = file.limits.get(name) else {
            continue;
        };
        let kind = robot.joint_kind(i);
        let unit = kind.position_unit();
        let symmetric =
            |quantity, unit: &str, most: f64| Channel::symmetric(quantity, i, name, unit, most);
        if let Some([lower, upper]) = given.position {
            channels.push(Channel {
                lower,
                upper,
                ..symmetric(Quantity::Position, unit, 0.0)
            });
        }
        if let Some(speed) = given.speed {
            channels.push(symmetric(Quantity::Speed, &format!("{unit}/s"), speed));
        }
        if let Some(most) = given.acceleration {
            channels.push(symmetric(
                Quantity::Acceleration,
                &format!("{unit}/s^2"),
                most,
            ));
        }
        // one volt is one unit of torque
        let most = [given.torque, given.volts, file.control.saturation_v];
        let most = most.into_iter().flatten().fold(f64::INFINITY, f64::min);
        if most.is_finite() {
            channels.push(symmetric(Quantity::Drive, kind.torque_unit(), most));
        }
    }
    channels
}

/// The series of a trajectory file, in the machine's designed coordinates. Coordinates that the file
/// leaves out rest in the middle of their limits.
///
/// # Errors
/// [`ExciteError`] for a coordinate that the machine does not have, and for a series of the CFT
/// robot in joint coordinates.
pub fn series_of(machine: &Machine, file: &Fourier) -> Result<Series, ExciteError> {
    let names = machine.coordinate_names();
    if file.coordinates != machine.designed() {
        return Err(ExciteError::OtherCoordinates {
            wanted: names.join(", "),
        });
    }
    let harmonics = file.series.iter().map(|c| c.a.len()).max().unwrap_or(0);
    let mut series = Series::still(TAU * file.fundamental_hz, names.len(), harmonics);
    for (i, offset) in series.offset.iter_mut().enumerate() {
        let mut all = machine.channels.iter();
        let position = all.find(|c| c.quantity == Quantity::Position && c.index == i);
        *offset = position.map_or(0.0, |c| 0.5 * (c.lower + c.upper));
    }
    for given in &file.series {
        let Some(i) = names.iter().position(|name| *name == given.name) else {
            return Err(ExciteError::UnknownCoordinate {
                name: given.name.clone(),
                known: names.join(", "),
            });
        };
        series.offset[i] = given.offset;
        series.a[i][..given.a.len()].copy_from_slice(&given.a);
        series.b[i][..given.b.len()].copy_from_slice(&given.b);
    }
    Ok(series)
}

/// The trajectory file of a series in the machine's designed coordinates.
pub fn trajectory(machine: &Machine, series: &Series) -> Fourier {
    let of = |(i, name): (usize, String)| FourierCoordinate {
        name,
        offset: series.offset[i],
        a: series.a[i].clone(),
        b: series.b[i].clone(),
    };
    Fourier {
        coordinates: machine.designed(),
        fundamental_hz: series.fundamental / TAU,
        start_s: None,
        blend_s: None,
        periods: None,
        series: machine
            .coordinate_names()
            .into_iter()
            .enumerate()
            .map(of)
            .collect(),
    }
}
