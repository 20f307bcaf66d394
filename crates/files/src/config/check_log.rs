//! What the `[log]` section may say.

use std::collections::BTreeMap;

use super::ConfigError;
use super::channels::gear_matrix;
use super::document::TomlDocument;
use super::robot_file::{ModelKind, RobotFile};
use cft_ident_core::number::is_usable;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::cft::COORDINATES;
use cft_ident_logs::log::{
    ActuatorChannels, ColumnName, FurtherCommand, JointChannels, LogSection, PositionUnit,
    TorqueIs, TorqueUnit,
};

/// Checks the `[log]` section of a robot file.
pub(super) fn check(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    let log = &file.log;
    document.known_names(&["log", "joint"], &log.joint, &file.joint_names())?;
    document.positive(&["log", "rate_hz"], log.rate_hz)?;
    if log.rate_hz.is_some() && (log.time.is_some() || log.time_unit.is_some()) {
        return Err(document.value(
            &["log", "rate_hz"],
            "stands beside a column of times",
            "keep one of the two: `rate_hz` is for logs that have no times",
        ));
    }
    gears(file, document)?;
    controller(file, document)?;
    foreign_effort(file, document)?;
    // Which key reads which column: no column may be read twice.
    let mut columns: BTreeMap<&str, String> = BTreeMap::new();
    if let Some(time) = &log.time {
        columns.insert(&time.0, "log.time".to_owned());
    }
    let robot = file.robot();
    for (joint, channels) in &log.joint {
        let names = robot.joint_names();
        let index = names.iter().position(|name| name == joint).unwrap_or(0);
        let kind = robot.joint_kind(index);
        joint_channels(document, joint, channels, kind, log)?;
        let named = [
            ("position", &channels.position),
            ("velocity", &channels.velocity),
            ("reference", &channels.reference),
            ("torque", &channels.torque),
            ("temperature", &channels.temperature),
        ];
        for (key, column) in named {
            let at = ["log", "joint", joint, key];
            claim(document, &mut columns, column, &at)?;
        }
    }
    if file.robot.model != ModelKind::Cft
        && let Some(name) = log.actuator.keys().next()
    {
        let remedy = "map the channels of this joint in [log.joint]";
        let at = ["log", "actuator", name];
        return Err(document.value(&at, "does not belong to this model", remedy));
    }
    let coordinates = COORDINATES.map(str::to_owned);
    document.known_names(&["log", "actuator"], &log.actuator, &coordinates)?;
    for (name, channels) in &log.actuator {
        actuator_channels(document, name, channels)?;
        for (key, column) in [("position", &channels.position), ("volts", &channels.volts)] {
            let at = ["log", "actuator", name, key];
            claim(document, &mut columns, column, &at)?;
        }
    }
    Ok(())
}

/// Refuses to take the effort of a foreign recording for a joint torque: many drivers publish motor currents there.
fn foreign_effort(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    let log = &file.log;
    let mapped = log.joint.values().any(|channels| channels.name.is_some());
    let foreign = log.torque.is_none() && (mapped || log.torque_topic.is_some());
    if log.torque_is.is_none() && foreign {
        return Err(document.missing(
            &["log", "torque_is"],
            "what the messages hold as torque or effort: `torque_is = \"joint\"`, \"motor\", \"current\" or \"commanded\"",
        ));
    }
    Ok(())
}

/// `[log] torque`: gains of every joint, a column of each command, and no other torque beside.
fn controller(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    let Some(asked) = &file.log.torque else {
        return Ok(());
    };
    let joints = file.joint_names();
    let usable = |[kp, kd]: &[f64; 2]| is_usable(*kp) && *kp > 0.0 && is_usable(*kd) && *kd >= 0.0;
    let gains = asked.pd.of(joints.len());
    if !gains.is_some_and(|gains| gains.iter().all(usable)) {
        let remedy = format!(
            "give [kp, kd] for all joints or a list of {} such pairs, kp above 0 and kd not below 0",
            joints.len()
        );
        return Err(document.value(&["log", "torque"], "has gains that cannot be used", &remedy));
    }
    if !file.log.gears.is_empty() || file.robot.model == ModelKind::Cft {
        return Err(document.value(
            &["log", "torque"],
            "is of a controller of joints, and this log is of motors or actuators",
            "log positions and commands of the joints",
        ));
    }
    if file
        .log
        .torque_is
        .is_some_and(|is| is != TorqueIs::Commanded)
    {
        return Err(document.value(
            &["log", "torque_is"],
            "is another than that of [log] torque",
            "set `torque_is = \"commanded\"`, or delete it",
        ));
    }
    for joint in &joints {
        let own = file.log.joint.get(joint);
        let named = own.is_some_and(|own| own.reference.is_some());
        if asked.command.is_none() && !named {
            let remedy = "name the column of the command: `command = \"q_des_{joint}\"`";
            return Err(document.value(&["log", "torque"], "names no command", remedy));
        }
        let column = own.and_then(|own| {
            let keys = [
                ("torque", own.torque.is_some()),
                ("torque_unit", own.torque_unit.is_some()),
                ("torque_scale", own.torque_scale.is_some()),
                ("torque_sign", own.torque_sign.is_some()),
                ("torque_offset", own.torque_offset.is_some()),
            ];
            keys.into_iter().find(|(_, given)| *given)
        });
        if let Some((key, _)) = column {
            return Err(document.value(
                &["log", "joint", joint, key],
                "stands beside [log] torque, by which torques are those of the controller",
                "keep one of the two",
            ));
        }
    }
    let command = asked.command.iter().map(|column| ("command", column));
    let further = FurtherCommand::ALL.into_iter();
    let further = further.filter_map(|kind| Some((kind.key(), asked.columns_of(kind)?)));
    for (key, column) in command.chain(further) {
        if !column.fits(joints.len()) {
            return Err(document.value(
                &["log", "torque", key],
                "is not a column for each joint",
                "write {joint} where the name of the joint stands, or a list of the columns of all joints",
            ));
        }
    }
    Ok(())
}

/// Refuses gears that cannot be turned back, or that would be applied to what is no motor's.
fn gears(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    let log = &file.log;
    if log.gears.is_empty() {
        return Ok(());
    }
    let at = ["log", "gears"];
    let joints = file.robot().joints();
    let matrix = gear_matrix(&log.gears).filter(|matrix| matrix.nrows() == joints);
    let Some(matrix) = matrix else {
        let problem = format!("is no matrix of {joints} rows and columns");
        let remedy = "give one row for each motor: its turns per unit of each joint";
        return Err(document.value(&at, &problem, remedy));
    };
    if matrix.try_inverse().is_none() {
        let problem = "cannot be inverted: some motion of the joints moves no motor";
        return Err(document.value(&at, problem, "correct the ratios"));
    }
    match log.torque_is {
        Some(TorqueIs::Motor | TorqueIs::Current) => Ok(()),
        _ => Err(document.value(
            &at,
            "takes motor torques to the joints, but the torques are not said to be of the motors",
            "set `torque_is = \"motor\"` or \"current\", or delete it",
        )),
    }
}

/// Refuses a column that is empty or already read as something else.
fn claim<'c>(
    document: &TomlDocument,
    columns: &mut BTreeMap<&'c str, String>,
    column: &'c Option<ColumnName>,
    at: &[&str],
) -> Result<(), ConfigError> {
    let Some(ColumnName(column)) = column else {
        return Ok(());
    };
    if column.trim().is_empty() {
        return Err(document.value(at, "is empty", "name a column of the log"));
    }
    if let Some(first) = columns.get(column.as_str()) {
        let problem = format!("reads the column that `{first}` reads already");
        return Err(document.value(at, &problem, "give each channel its own column"));
    }
    columns.insert(column, at.join("."));
    Ok(())
}

fn joint_channels(
    document: &TomlDocument,
    joint: &str,
    channels: &JointChannels,
    kind: JointKind,
    log: &LogSection,
) -> Result<(), ConfigError> {
    let at = |key| ["log", "joint", joint, key];
    let position_fits = match channels.position_unit {
        // what reads positions in counts asks for their scale
        None | Some(PositionUnit::COUNTS) => true,
        Some(unit) => match kind {
            JointKind::Prismatic => unit.is_length(),
            JointKind::Revolute => unit.is_angle(),
        },
    };
    if !position_fits {
        let remedy = match kind {
            JointKind::Prismatic => {
                "a prismatic joint is logged in \"m\", \"cm\" or \"mm\", or another length"
            }
            JointKind::Revolute => {
                "a revolute joint is logged in \"rad\", \"deg\" or \"turns\", or another angle"
            }
        };
        return Err(document.value(&at("position_unit"), "does not fit the joint", remedy));
    }
    let scaled = channels.torque_scale.is_some();
    let torque_fits = match channels.torque_unit {
        Some(unit) if unit.is_force() => kind == JointKind::Prismatic || scaled,
        Some(unit) if unit.is_moment() => kind == JointKind::Revolute || scaled,
        _ => true,
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
    range(document, &at("wrap"), channels.wrap)?;
    range(document, &at("torque_wrap"), channels.torque_wrap)?;
    let remedy = "give the largest torque that the drive delivers, above 0";
    let positive = |x: f64| x > 0.0 && x.is_finite();
    document.number(&at("torque_limit"), channels.torque_limit, positive, remedy)?;
    match (log.torque_is, &channels.torque) {
        (None, Some(_)) => Err(document.missing(
            &["log", "torque_is"],
            "what the torque column is: `torque_is = \"joint\"`, \"motor\", \"current\" or \"commanded\"",
        )),
        (Some(TorqueIs::Motor), _) if !scaled && log.gears.is_empty() => Err(document.missing(
            &at("torque_scale"),
            "the gear ratio that takes motor torque to the joint (1 where there is no gear)",
        )),
        (Some(TorqueIs::Current), _)
            if !scaled && channels.torque_unit.is_none_or(TorqueUnit::is_torque) =>
        {
            Err(document.missing(
                &at("torque_scale"),
                "torque constant times gear ratio, or `torque_unit = \"A\"` to have the model in A",
            ))
        }
        _ => Ok(()),
    }
}

fn actuator_channels(
    document: &TomlDocument,
    name: &str,
    channels: &ActuatorChannels,
) -> Result<(), ConfigError> {
    let at = |key| ["log", "actuator", name, key];
    let turns = name == COORDINATES[2];
    let fits = match channels.position_unit {
        None | Some(PositionUnit::COUNTS) => true,
        Some(unit) if unit.is_length() => !turns,
        Some(_) => turns,
    };
    if !fits {
        let remedy = "x_c3 is logged in \"rad\", \"deg\" or \"counts\", the others in \"m\", \"mm\" or \"counts\"";
        return Err(document.value(&at("position_unit"), "does not fit the coordinate", remedy));
    }
    sign(document, &at("position_sign"), channels.position_sign)?;
    sign(document, &at("volts_sign"), channels.volts_sign)?;
    scale(document, &at("position_scale"), channels.position_scale)?;
    scale(document, &at("volts_scale"), channels.volts_scale)?;
    range(document, &at("wrap"), channels.wrap)?;
    Ok(())
}

fn range(document: &TomlDocument, at: &[&str], value: Option<f64>) -> Result<(), ConfigError> {
    let remedy = "give the range after which the numbers of the column begin anew, in their unit: 360, 6.283185307179586, 4096, 65536";
    document.number(at, value, |x| x > 0.0 && x.is_finite(), remedy)
}

fn sign(document: &TomlDocument, at: &[&str], value: Option<f64>) -> Result<(), ConfigError> {
    document.number(at, value, |x| x.abs() == 1.0, "give 1 or -1")
}

fn scale(document: &TomlDocument, at: &[&str], value: Option<f64>) -> Result<(), ConfigError> {
    let remedy = "give a finite factor other than 0";
    document.number(at, value, |x| x != 0.0 && x.is_finite(), remedy)
}
