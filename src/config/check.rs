//! What a robot file may say: everything that no type can rule out.

use std::collections::BTreeMap;

use super::ConfigError;
use super::document::Document;
use super::log_section::{ActuatorChannels, JointChannels, PositionUnit, TorqueIs, TorqueUnit};
use super::robot_file::{FilterKind, FrictionLawKind, ModelKind, RobotFile};
use crate::log::{list, nearest};
use crate::robot::JointKind;
use crate::robot::cft::COORDINATES;

/// Checks a robot file that was read from `document`.
pub(super) fn check(file: &RobotFile, document: &Document) -> Result<(), ConfigError> {
    robot(file, document)?;
    friction(file, document)?;
    log(file, document)?;
    filter(file, document)?;
    known_names(
        document,
        &["noise", "joint"],
        &file.noise.joint,
        &file.joint_names(),
    )?;
    for (joint, noise) in &file.noise.joint {
        let at = |key| ["noise", "joint", joint.as_str(), key];
        document.not_negative(&at("position_resolution"), noise.position_resolution)?;
        document.not_negative(&at("torque_std"), noise.torque_std)?;
    }
    limits(file, document)?;
    simulator(file, document)
}

fn robot(file: &RobotFile, document: &Document) -> Result<(), ConfigError> {
    let robot = &file.robot;
    let foreign = |key: &str, model: &str| {
        let remedy = format!("delete it, or set `model = \"{model}\"`");
        document.value(&["robot", key], "does not belong to this model", &remedy)
    };
    match robot.model {
        ModelKind::Serial => Err(document.value(
            &["robot", "model"],
            "is \"serial\", which this version does not have yet",
            "use \"cft\" or \"single-joint\"",
        )),
        ModelKind::Cft => {
            if robot.setup.is_none() {
                return Err(
                    document.missing(&["robot", "setup"], "`setup = \"tuedacs\"` or `\"dspace\"`")
                );
            }
            if let Some(count) = robot.parameters
                && count != 12
                && count != 22
            {
                return Err(document.value(
                    &["robot", "parameters"],
                    &format!("is {count}"),
                    "give 12 (the report's structure) or 22 (the full chain)",
                ));
            }
            match (&robot.joint, robot.kind) {
                (Some(_), _) => Err(foreign("joint", "single-joint")),
                (_, Some(_)) => Err(foreign("kind", "single-joint")),
                _ => Ok(()),
            }
        }
        ModelKind::SingleJoint => {
            let Some(joint) = &robot.joint else {
                return Err(document.missing(
                    &["robot", "joint"],
                    "the joint's name, e.g. `joint = \"q1\"`",
                ));
            };
            let plain = |c: char| c.is_alphanumeric() || "_-.".contains(c);
            if joint.is_empty() || joint.len() > 64 || !joint.chars().all(plain) {
                return Err(document.value(
                    &["robot", "joint"],
                    "is no name for a joint",
                    "use letters, digits, `_`, `-` and `.`",
                ));
            }
            if robot.kind.is_none() {
                return Err(document.missing(
                    &["robot", "kind"],
                    "`kind = \"prismatic\"` or `\"revolute\"`",
                ));
            }
            match (robot.setup, robot.parameters) {
                (Some(_), _) => Err(foreign("setup", "cft")),
                (_, Some(_)) => Err(foreign("parameters", "cft")),
                _ => Ok(()),
            }
        }
    }
}

fn friction(file: &RobotFile, document: &Document) -> Result<(), ConfigError> {
    let friction = &file.friction;
    let law = file.friction_law();
    if friction.fitted_with_inertias && law == FrictionLawKind::DoubleTanh {
        return Err(document.value(
            &["friction", "fitted_with_inertias"],
            "is true, but the double-tanh law is not linear in its slopes",
            "set `law = \"viscous-coulomb\"`, or identify friction first with `cft-ident friction`",
        ));
    }
    if friction.offset && !friction.fitted_with_inertias {
        return Err(document.value(
            &["friction", "offset"],
            "is true, but friction is not fitted with the inertias",
            "set `fitted_with_inertias = true` as well",
        ));
    }
    known_names(
        document,
        &["friction", "joint"],
        &friction.joint,
        &file.joint_names(),
    )?;
    for (joint, start) in &friction.joint {
        let at = |key| ["friction", "joint", joint.as_str(), key];
        let keys = [
            ("viscous", start.viscous, true, true),
            ("coulomb", start.coulomb, false, true),
            ("coulomb_1", start.coulomb_1, true, false),
            ("coulomb_2", start.coulomb_2, true, false),
            ("slope_1", start.slope_1, true, false),
            ("slope_2", start.slope_2, true, false),
        ];
        for (key, value, in_double_tanh, in_viscous_coulomb) in keys {
            let Some(value) = value else { continue };
            document.finite(&at(key), &[value])?;
            let belongs = match law {
                FrictionLawKind::DoubleTanh => in_double_tanh,
                FrictionLawKind::ViscousCoulomb => in_viscous_coulomb,
            };
            if !belongs {
                return Err(document.value(
                    &at(key),
                    "does not belong to this friction law",
                    "delete it, or choose the other `law`",
                ));
            }
            if key.starts_with("slope") {
                document.positive(&at(key), value)?;
            }
        }
        if let (Some(first), Some(second)) = (start.slope_1, start.slope_2)
            && first <= second
        {
            return Err(document.value(
                &at("slope_1"),
                "is not above slope_2",
                "exchange the two terms: slope_1 is the steeper one",
            ));
        }
    }
    Ok(())
}

fn log(file: &RobotFile, document: &Document) -> Result<(), ConfigError> {
    let log = &file.log;
    known_names(document, &["log", "joint"], &log.joint, &file.joint_names())?;
    // Which key reads which column: no column may be read twice.
    let mut columns: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    if let Some(time) = &log.time {
        columns.insert(time.as_str(), vec!["log.time".to_owned()]);
    }
    let robot = file.robot();
    for (joint, channels) in &log.joint {
        let index = robot
            .joint_names()
            .iter()
            .position(|name| name == joint)
            .unwrap_or(0);
        joint_channels(
            document,
            joint,
            channels,
            robot.joint_kind(index),
            log.torque_is,
        )?;
        let named = [
            ("position", &channels.position),
            ("velocity", &channels.velocity),
            ("torque", &channels.torque),
        ];
        for (key, column) in named {
            if let Some(column) = column {
                claim(
                    document,
                    &mut columns,
                    column,
                    &["log", "joint", joint, key],
                )?;
            }
        }
    }
    if file.robot.model != ModelKind::Cft
        && let Some(name) = log.actuator.keys().next()
    {
        return Err(document.value(
            &["log", "actuator", name],
            "does not belong to this model",
            "map the channels of this joint in [log.joint]",
        ));
    }
    let coordinates = COORDINATES.map(str::to_owned);
    known_names(document, &["log", "actuator"], &log.actuator, &coordinates)?;
    for (name, channels) in &log.actuator {
        actuator_channels(document, name, channels)?;
        for (key, column) in [("position", &channels.position), ("volts", &channels.volts)] {
            if let Some(column) = column {
                claim(
                    document,
                    &mut columns,
                    column,
                    &["log", "actuator", name, key],
                )?;
            }
        }
    }
    Ok(())
}

/// Refuses a column that is empty or already read as something else.
fn claim<'c>(
    document: &Document,
    columns: &mut BTreeMap<&'c str, Vec<String>>,
    column: &'c str,
    at: &[&str],
) -> Result<(), ConfigError> {
    if column.trim().is_empty() {
        return Err(document.value(at, "is empty", "name a column of the log"));
    }
    let readers = columns.entry(column).or_default();
    if let Some(first) = readers.first() {
        let problem = format!("reads the column that `{first}` reads already");
        return Err(document.value(at, &problem, "give each channel its own column"));
    }
    readers.push(at.join("."));
    Ok(())
}

fn joint_channels(
    document: &Document,
    joint: &str,
    channels: &JointChannels,
    kind: JointKind,
    torque_is: Option<TorqueIs>,
) -> Result<(), ConfigError> {
    let at = |key| ["log", "joint", joint, key];
    let position_fits = match channels.position_unit {
        None => true,
        Some(PositionUnit::Metre | PositionUnit::Millimetre) => kind == JointKind::Prismatic,
        Some(PositionUnit::Radian | PositionUnit::Degree) => kind == JointKind::Revolute,
        Some(PositionUnit::Counts) => false,
    };
    if !position_fits {
        let remedy = match kind {
            JointKind::Prismatic => "a prismatic joint is logged in \"m\" or \"mm\"",
            JointKind::Revolute => "a revolute joint is logged in \"rad\" or \"deg\"",
        };
        return Err(document.value(&at("position_unit"), "does not fit the joint", remedy));
    }
    let scaled = channels.torque_scale.is_some();
    let torque_fits = match channels.torque_unit {
        None | Some(TorqueUnit::Ampere) => true,
        Some(TorqueUnit::Newton) => kind == JointKind::Prismatic || scaled,
        Some(TorqueUnit::NewtonMetre) => kind == JointKind::Revolute || scaled,
        Some(TorqueUnit::Volt) => scaled,
    };
    if !torque_fits {
        return Err(document.value(
            &at("torque_unit"),
            "does not fit the joint",
            "a prismatic joint has N, a revolute one Nm; else give `torque_scale` to get there",
        ));
    }
    sign(document, &at("position_sign"), channels.position_sign)?;
    sign(document, &at("torque_sign"), channels.torque_sign)?;
    scale(document, &at("position_scale"), channels.position_scale)?;
    scale(document, &at("torque_scale"), channels.torque_scale)?;
    document.finite(&at("position_offset"), channels.position_offset.as_slice())?;
    document.finite(&at("torque_offset"), channels.torque_offset.as_slice())?;
    match (torque_is, &channels.torque) {
        (None, Some(_)) => Err(document.missing(
            &["log", "torque_is"],
            "what the torque column is: `torque_is = \"joint\"`, \"motor\", \"current\" or \"commanded\"",
        )),
        (Some(TorqueIs::Motor), _) if !scaled => Err(document.missing(
            &at("torque_scale"),
            "the gear ratio that takes motor torque to the joint (1 where there is no gear)",
        )),
        (Some(TorqueIs::Current), _) if !scaled && channels.torque_unit != Some(TorqueUnit::Ampere) => {
            Err(document.missing(
                &at("torque_scale"),
                "torque constant times gear ratio, or `torque_unit = \"A\"` to have the model in A",
            ))
        }
        _ => Ok(()),
    }
}

fn actuator_channels(
    document: &Document,
    name: &str,
    channels: &ActuatorChannels,
) -> Result<(), ConfigError> {
    let at = |key| ["log", "actuator", name, key];
    let turns = name == COORDINATES[2];
    let fits = match channels.position_unit {
        None | Some(PositionUnit::Counts) => true,
        Some(PositionUnit::Metre | PositionUnit::Millimetre) => !turns,
        Some(PositionUnit::Radian | PositionUnit::Degree) => turns,
    };
    if !fits {
        let remedy = "x_c3 is logged in \"rad\", \"deg\" or \"counts\", the others in \"m\", \"mm\" or \"counts\"";
        return Err(document.value(&at("position_unit"), "does not fit the coordinate", remedy));
    }
    sign(document, &at("position_sign"), channels.position_sign)?;
    sign(document, &at("volts_sign"), channels.volts_sign)?;
    document.finite(&at("home"), channels.home.as_slice())
}

fn filter(file: &RobotFile, document: &Document) -> Result<(), ConfigError> {
    let filter = &file.filter;
    let at = |key| ["filter", key];
    for (key, value) in [
        ("cutoff_hz", filter.cutoff_hz),
        ("position_cutoff_hz", filter.position_cutoff_hz),
        ("ripple_db", filter.ripple_db),
    ] {
        if let Some(value) = value {
            document.positive(&at(key), value)?;
        }
    }
    document.not_negative(&at("trim_s"), filter.trim_s)?;
    document.not_negative(&at("position_trim_s"), filter.position_trim_s)?;
    if let Some(factor) = filter.gap_factor
        && !(factor.is_finite() && factor > 1.0)
    {
        return Err(document.value(
            &at("gap_factor"),
            &format!("is {factor}"),
            "give a number above 1, e.g. 2.5",
        ));
    }
    if filter.decimation == Some(0) {
        return Err(document.value(&at("decimation"), "is 0", "1 keeps every row"));
    }
    for (key, order, lowest) in [
        ("order", filter.order, 1),
        ("position_order", filter.position_order, 0),
    ] {
        if let Some(order) = order
            && !(lowest..=12).contains(&order)
        {
            return Err(document.value(
                &at(key),
                &format!("is {order}"),
                &format!("give an order from {lowest} to 12"),
            ));
        }
    }
    if filter.ripple_db.is_some() && filter.kind != Some(FilterKind::ChebyshevDecimate) {
        return Err(document.value(
            &at("ripple_db"),
            "does not belong to a Butterworth filter",
            "delete it, or set `kind = \"chebyshev-decimate\"`",
        ));
    }
    Ok(())
}

fn limits(file: &RobotFile, document: &Document) -> Result<(), ConfigError> {
    known_names(
        document,
        &["limits"],
        &file.limits,
        &file.coordinate_names(),
    )?;
    for (name, limits) in &file.limits {
        let at = |key| ["limits", name.as_str(), key];
        if let Some([low, high]) = limits.position {
            document.finite(&at("position"), &[low, high])?;
            if low >= high {
                return Err(document.value(
                    &at("position"),
                    "is empty",
                    "write the lower end first",
                ));
            }
        }
        for (key, value) in [
            ("speed", limits.speed),
            ("acceleration", limits.acceleration),
            ("torque", limits.torque),
            ("volts", limits.volts),
        ] {
            if let Some(value) = value {
                document.positive(&at(key), value)?;
            }
        }
    }
    Ok(())
}

fn simulator(file: &RobotFile, document: &Document) -> Result<(), ConfigError> {
    let control = &file.control;
    let joints = file.robot().joints();
    per_joint(document, &["control", "kp"], &control.kp, joints)?;
    per_joint(document, &["control", "kd"], &control.kd, joints)?;
    for (key, value) in [
        ("rate_hz", control.rate_hz),
        ("saturation_v", control.saturation_v),
        ("derivative_filter_hz", control.derivative_filter_hz),
    ] {
        if let Some(value) = value {
            document.positive(&["control", key], value)?;
        }
    }
    let sensors = &file.sensors;
    for (key, value) in [
        ("volt_noise", sensors.volt_noise),
        ("torque_noise_relative", sensors.torque_noise_relative),
        ("jitter", sensors.jitter),
        ("dropouts", sensors.dropouts),
    ] {
        document.not_negative(&["sensors", key], value)?;
    }
    for (key, value) in [("jitter", sensors.jitter), ("dropouts", sensors.dropouts)] {
        if value.is_some_and(|value| value >= 0.5) {
            return Err(document.value(
                &["sensors", key],
                "is a fraction of 0.5 or more",
                "give a fraction below 0.5",
            ));
        }
    }
    per_joint(
        document,
        &["sensors", "torque_noise"],
        &sensors.torque_noise,
        joints,
    )?;
    for &value in &sensors.torque_noise {
        document.not_negative(&["sensors", "torque_noise"], Some(value))?;
    }
    if !sensors.torque_noise.is_empty() && sensors.torque_noise_relative.is_some() {
        return Err(document.value(
            &["sensors", "torque_noise_relative"],
            "says what `torque_noise` says already",
            "keep one of the two",
        ));
    }
    Ok(())
}

/// Refuses a table for a joint or coordinate that the robot does not have.
fn known_names<T>(
    document: &Document,
    table: &[&str],
    entries: &BTreeMap<String, T>,
    known: &[String],
) -> Result<(), ConfigError> {
    let Some(name) = entries.keys().find(|name| !known.contains(name)) else {
        return Ok(());
    };
    let all = || known.iter().map(String::as_str);
    let near = nearest(name, all())
        .map(|near| format!("did you mean `{near}`? "))
        .unwrap_or_default();
    let mut path = table.to_vec();
    path.push(name);
    let remedy = format!("{near}this robot has {}", list(all()));
    Err(document.value(&path, "is nothing that this robot has", &remedy))
}

/// Refuses a list that is neither empty nor one finite number for each joint or coordinate.
fn per_joint(
    document: &Document,
    at: &[&str],
    values: &[f64],
    joints: usize,
) -> Result<(), ConfigError> {
    if !values.is_empty() && values.len() != joints {
        let problem = format!("holds {} numbers", values.len());
        return Err(document.value(
            at,
            &problem,
            &format!("give {joints}, one for each joint or coordinate"),
        ));
    }
    document.finite(at, values)
}

fn sign(document: &Document, at: &[&str], value: Option<f64>) -> Result<(), ConfigError> {
    match value {
        Some(value) if value.abs() != 1.0 => {
            Err(document.value(at, &format!("is {value}"), "give 1 or -1"))
        }
        _ => Ok(()),
    }
}

fn scale(document: &Document, at: &[&str], value: Option<f64>) -> Result<(), ConfigError> {
    match value {
        Some(value) if value == 0.0 || !value.is_finite() => Err(document.value(
            at,
            &format!("is {value}"),
            "give a finite factor other than 0",
        )),
        _ => Ok(()),
    }
}
