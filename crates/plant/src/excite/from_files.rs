//! From robot, model and trajectory files to a machine and its series, and back.

use std::f64::consts::TAU;

use crate::simulate::Mechanism;
use cft_ident_core::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident_core::robot::JointKind;
use cft_ident_files::config::robot_file::CoordinateLimits;
use cft_ident_files::config::trajectory::{FourierCoordinate, FourierSection};
use cft_ident_files::config::{ModelFile, RobotFile};

use super::ExciteError;
use super::foreseen::TorqueSource;
use super::limits::{BoundedQuantity, Quantity};
use super::machine::{ForeseenRobot, NoiseSource};
use super::series::{MAX_COORDINATES, Series};
use super::space::DesignSpace;

/// Share of the speed limit within which the sign of a Coulomb column is smoothed in a search.
const SIGN: f64 = 0.005;

/// The machine of a robot file, with the torques of a model, or of what else is known of its masses; where
/// nothing is, limits of torque are none of its channels.
///
/// Limits are those of `[limits]` and `[control] saturation_v`, and where these say nothing what is known of
/// the robot: of the CFT robot Table 5, 4000 revolutions per minute of every motor and 10 V. `noise` is left 1.
///
/// # Errors
/// [`ExciteError`] where the model lacks a parameter or belongs to another robot, or a limit is
/// given where none can be kept.
pub fn machine(
    file: &RobotFile,
    model: Option<(&str, &ModelFile)>,
) -> Result<ForeseenRobot, ExciteError> {
    let robot = file.robot();
    let n = robot.joints();
    let (model, source) = TorqueSource::of(file, &robot, model)?;
    let own = match (file.friction.fitted_with_inertias, file.friction.offset) {
        (false, _) => Vec::new(),
        (true, false) => vec![JointTerm::Viscous, JointTerm::Coulomb],
        (true, true) => vec![JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset],
    };
    let mut machine = ForeseenRobot {
        columns: RegressorColumns {
            joints: n,
            shared: robot.parameters().len(),
            own: vec![own; n],
            known: vec![None; n],
            rest_speed: Vec::new(),
        },
        model,
        source,
        mechanism: Mechanism::of(file)?,
        space: DesignSpace::default(),
        channels: Vec::new(),
        noise: vec![1.0; n],
        noise_source: NoiseSource::One,
        coulomb_speed: vec![1.0; n],
    };
    machine.channels = channels(file, &machine.mechanism)?;
    if !machine.source.known() {
        machine.channels.retain(|c| !c.quantity.is_of_torque());
    }
    let (space, of_places) = DesignSpace::of(file, &machine.model.robot);
    machine.space = space;
    machine.channels.extend(of_places);
    for i in 0..n {
        let of = |quantity| BoundedQuantity::find(&machine.channels, quantity, i);
        let speed = of(Quantity::Speed).map(|c| c.upper);
        let travel = of(Quantity::Position).map(|c| c.upper - c.lower);
        machine.coulomb_speed[i] = SIGN * speed.or(travel).unwrap_or(1.0);
    }
    Ok(machine)
}

/// Limits of the motors' coordinates, of joints that are none of these, and where motors could lose hold of a joint.
fn channels(
    file: &RobotFile,
    mechanism: &Mechanism<MAX_COORDINATES>,
) -> Result<Vec<BoundedQuantity>, ExciteError> {
    let robot = &mechanism.robot;
    let mut channels = Vec::new();
    for i in 0..robot.joints() {
        of_coordinate(file, mechanism, i, &mut channels);
    }
    if mechanism.motors_at_joints() {
        return Ok(channels);
    }
    for (joint, name) in robot.joint_names().iter().enumerate() {
        let Some(given) = file.limits.get(name) else {
            continue;
        };
        if given.volts.is_some() {
            return Err(ExciteError::VoltsOfJoint {
                joint: name.clone(),
            });
        }
        let mut of_motors = (0..robot.joints()).filter_map(|i| robot.transmission().joint_of(i));
        let same = of_motors.any(|(own, _)| own == joint);
        let kind = robot.joint_kind(joint);
        of_joint(given, joint, name, kind, same, &mut channels);
    }
    if let Some(practice) = &mechanism.practice {
        let (joint, least) = practice.clearance;
        let (name, open) = (&robot.joint_names()[joint], [least, f64::INFINITY]);
        let of = Quantity::Clearance;
        channels.push(BoundedQuantity::between(of, joint, name, "", open));
    }
    Ok(channels)
}

/// Limits of the coordinate of motor i.
fn of_coordinate(
    file: &RobotFile,
    mechanism: &Mechanism<MAX_COORDINATES>,
    i: usize,
    channels: &mut Vec<BoundedQuantity>,
) {
    let (robot, practice) = (&mechanism.robot, mechanism.practice.as_ref());
    let (names, kind) = (robot.coordinate_names(), robot.coordinate_kind(i));
    let (name, unit) = (&names[i], kind.position_unit());
    let given = file.limits.get(name).cloned().unwrap_or_default();
    let [mut lower, mut upper] = [mechanism.lower[i], mechanism.upper[i]];
    let speed = given.speed.or(practice.map(|practice| practice.speeds[i]));
    let mut speed = speed.unwrap_or(f64::INFINITY);
    let mut acceleration = given.acceleration.unwrap_or(f64::INFINITY);
    // a joint that is the coordinate but for a constant
    if let Some((joint, shift)) = robot.transmission().joint_of(i)
        && let Some(of_joint) = file.limits.get(&robot.joint_names()[joint])
    {
        if let Some([low, high]) = of_joint.position {
            (lower, upper) = (lower.max(low + shift), upper.min(high + shift));
        }
        speed = speed.min(of_joint.speed.unwrap_or(f64::INFINITY));
        acceleration = acceleration.min(of_joint.acceleration.unwrap_or(f64::INFINITY));
    }
    let mut add = |quantity, unit: &str, [low, high]: [f64; 2]| {
        if low.is_finite() && high.is_finite() {
            let span = [low, high];
            channels.push(BoundedQuantity::between(quantity, i, name, unit, span));
        }
    };
    add(Quantity::Position, unit, [lower, upper]);
    add(Quantity::Speed, &format!("{unit}/s"), [-speed, speed]);
    let most = acceleration;
    add(
        Quantity::Acceleration,
        &format!("{unit}/s^2"),
        [-most, most],
    );
    // a limit on a motor's force is one on its volts; one volt is one unit of torque where no gain is known
    let gain = robot.transmission().gains().map_or(1.0, |gains| gains[i]);
    let force = given.torque.map(|force| force / gain);
    let amplifier = practice.map(|practice| practice.volts);
    let saturation = file.control.saturation_v.or(amplifier);
    let most = [given.volts, saturation, force].into_iter().flatten();
    let most = most.fold(f64::INFINITY, f64::min);
    let unit = match mechanism.motors_at_joints() {
        true => kind.torque_unit(),
        false => "V",
    };
    add(Quantity::Drive, unit, [-most, most]);
}

/// Limits of a joint that is no designed coordinate (torque alone where it is one, `same`).
fn of_joint(
    given: &CoordinateLimits,
    joint: usize,
    name: &str,
    kind: JointKind,
    same: bool,
    channels: &mut Vec<BoundedQuantity>,
) {
    let unit = kind.position_unit();
    let both = |most: f64| [-most, most];
    let mut add = |quantity, unit: &str, span: Option<[f64; 2]>| {
        let of = |span| BoundedQuantity::between(quantity, joint, name, unit, span);
        channels.extend(span.map(of));
    };
    add(Quantity::Torque, kind.torque_unit(), given.torque.map(both));
    if !same {
        let (speed, acceleration) = (given.speed.map(both), given.acceleration.map(both));
        add(Quantity::JointPosition, unit, given.position);
        add(Quantity::JointSpeed, &format!("{unit}/s"), speed);
        add(
            Quantity::JointAcceleration,
            &format!("{unit}/s^2"),
            acceleration,
        );
    }
}

/// The series of a trajectory file, in the machine's designed coordinates. Coordinates that the file
/// leaves out rest in the middle of their limits.
///
/// # Errors
/// [`ExciteError`] for a coordinate that the machine does not have, and for a series of the CFT
/// robot in joint coordinates.
pub fn series_of(machine: &ForeseenRobot, file: &FourierSection) -> Result<Series, ExciteError> {
    let names = machine.coordinate_names();
    if file.coordinates != machine.designed() {
        return Err(ExciteError::OtherCoordinates {
            wanted: names.join(", "),
        });
    }
    let harmonics = file.series.iter().map(|c| c.a.len()).max().unwrap_or(0);
    let mut series = Series::still(TAU * file.fundamental_hz, names.len(), harmonics);
    for (i, offset) in series.offset.iter_mut().enumerate() {
        let position = BoundedQuantity::find(&machine.channels, Quantity::Position, i);
        *offset = position.map_or(0.0, BoundedQuantity::middle);
    }
    for given in &file.series {
        let i = place_of(&names, &given.name)?;
        series.offset[i] = given.offset;
        series.a[i][..given.a.len()].copy_from_slice(&given.a);
        series.b[i][..given.b.len()].copy_from_slice(&given.b);
    }
    Ok(series)
}

/// Where a name stands among the machine's.
pub(super) fn place_of(names: &[String], name: &str) -> Result<usize, ExciteError> {
    let unknown = || ExciteError::UnknownCoordinate {
        name: name.to_owned(),
        known: names.join(", "),
    };
    names.iter().position(|n| n == name).ok_or_else(unknown)
}

/// The trajectory file of a series in the machine's designed coordinates.
pub fn trajectory(machine: &ForeseenRobot, series: &Series) -> FourierSection {
    let names = machine.coordinate_names();
    let of = |(i, name): (usize, String)| FourierCoordinate {
        name,
        offset: series.offset[i],
        a: series.a[i].clone(),
        b: series.b[i].clone(),
    };
    FourierSection {
        coordinates: machine.designed(),
        fundamental_hz: series.fundamental / TAU,
        start_s: None,
        blend_s: None,
        periods: None,
        series: names.into_iter().enumerate().map(of).collect(),
    }
}
