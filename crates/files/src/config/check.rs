//! What a robot file may say: everything that no type can rule out.

use super::document::TomlDocument;
use super::robot_file::{FilterKind, ModelKind, RobotFile};
use super::{ConfigError, check_limits, check_log, serial_chain};

/// Checks a robot file that was read from `document`.
pub(super) fn check(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    robot(file, document)?;
    friction(file, document)?;
    check_log::check(file, document)?;
    filter(file, document)?;
    document.known_names(&["noise", "joint"], &file.noise.joint, &file.joint_names())?;
    for (joint, noise) in &file.noise.joint {
        let at = |key| ["noise", "joint", joint.as_str(), key];
        document.not_negative(&at("position_resolution"), noise.position_resolution)?;
        document.not_negative(&at("torque_std"), noise.torque_std)?;
    }
    limits(file, document)?;
    document.known_names(&["drive"], &file.drive, &file.joint_names())?;
    for (joint, drive) in &file.drive {
        let at = |key| ["drive", joint.as_str(), key];
        document.not_negative(&at("backlash_max"), drive.backlash_max)?;
        document.not_negative(&at("presliding_max"), drive.presliding_max)?;
    }
    simulator(file, document)
}

fn robot(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    use ModelKind::{Cft, Serial, SingleJoint};
    let robot = &file.robot;
    let keys = [
        ("gravity", robot.gravity.is_some(), Serial),
        ("drive_inertia", robot.drive_inertia.is_some(), Serial),
        ("urdf", robot.urdf.is_some(), Serial),
        ("tip", robot.tip.is_some(), Serial),
        ("held", !robot.held.is_empty(), Serial),
        (
            "angles_as_written",
            robot.angles_as_written.is_some(),
            Serial,
        ),
        ("coupling", !robot.coupling.is_empty(), Serial),
        ("link", !robot.link.is_empty(), Serial),
        ("frame", !robot.frame.is_empty(), Serial),
        ("setup", robot.setup.is_some(), Cft),
        ("parameters", robot.parameters.is_some(), Cft),
        ("joint", robot.joint.is_some(), SingleJoint),
        ("kind", robot.kind.is_some(), SingleJoint),
    ];
    let foreign = |(_, given, model): &&(&str, bool, ModelKind)| *given && *model != robot.model;
    if let Some((key, _, model)) = keys.iter().find(foreign) {
        let remedy = format!("delete it, or set `model = \"{}\"`", model.name());
        return Err(document.value(&["robot", key], "does not belong to this model", &remedy));
    }
    let missing = |key, remedy| Err(document.missing(&["robot", key], remedy));
    match robot.model {
        Serial => serial_chain::check(robot, document),
        Cft => match (robot.setup, robot.parameters) {
            (None, _) => missing("setup", "`setup = \"tuedacs\"` or `\"dspace\"`"),
            (_, None | Some(12 | 22)) => Ok(()),
            (_, Some(count)) => Err(document.value(
                &["robot", "parameters"],
                &format!("is {count}"),
                "give 12 (the report's structure) or 22 (the full chain)",
            )),
        },
        SingleJoint => {
            let Some(joint) = &robot.joint else {
                return missing("joint", "the joint's name, e.g. `joint = \"q1\"`");
            };
            document.plain_name(&["robot", "joint"], joint)?;
            match robot.kind {
                None => missing("kind", "`kind = \"prismatic\"` or `\"revolute\"`"),
                Some(_) => Ok(()),
            }
        }
    }
}

fn friction(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    let friction = &file.friction;
    let law = file.friction_law();
    if friction.offset && !friction.fitted_with_inertias {
        return Err(document.value(
            &["friction", "offset"],
            "is true, but friction is not fitted with the inertias",
            "set `fitted_with_inertias = true` as well",
        ));
    }
    document.known_names(&["friction", "joint"], &friction.joint, &file.joint_names())?;
    for (joint, start) in &friction.joint {
        let at = |key| ["friction", "joint", joint.as_str(), key];
        let keys = [
            ("viscous", start.viscous),
            ("coulomb", start.coulomb),
            ("coulomb_1", start.coulomb_1),
            ("coulomb_2", start.coulomb_2),
            ("slope_1", start.slope_1),
            ("slope_2", start.slope_2),
        ];
        for (key, value) in keys {
            let Some(value) = value else { continue };
            if !law.names().contains(&key) {
                let problem = "does not belong to this friction law";
                let remedy = "delete it, or choose the other `law`";
                return Err(document.value(&at(key), problem, remedy));
            }
            if key.starts_with("slope") {
                document.positive(&at(key), value)?;
            }
        }
        if let (Some(first), Some(second)) = (start.slope_1, start.slope_2)
            && first <= second
        {
            let remedy = "exchange the two terms: slope_1 is the steeper one";
            return Err(document.value(&at("slope_1"), "is not above slope_2", remedy));
        }
    }
    Ok(())
}

fn filter(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    let filter = &file.filter;
    let at = |key| ["filter", key];
    for (key, value) in [
        ("cutoff_hz", filter.cutoff_hz),
        ("position_cutoff_hz", filter.position_cutoff_hz),
        ("ripple_db", filter.ripple_db),
    ] {
        document.positive(&at(key), value)?;
    }
    document.not_negative(&at("trim_s"), filter.trim_s)?;
    document.not_negative(&at("position_trim_s"), filter.position_trim_s)?;
    let above_1 = |x: f64| x.is_finite() && x > 1.0;
    let remedy = "give a number above 1, e.g. 2.5";
    document.number(&at("gap_factor"), filter.gap_factor, above_1, remedy)?;
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
            let remedy = format!("give an order from {lowest} to 12");
            return Err(document.value(&at(key), &format!("is {order}"), &remedy));
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

fn limits(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    document.known_names(&["limits"], &file.limits.of, &file.coordinate_names())?;
    for (name, limits) in &file.limits.of {
        let at = |key| ["limits", name.as_str(), key];
        if let Some([low, high]) = limits.position
            && low >= high
        {
            return Err(document.value(&at("position"), "is empty", "write the lower end first"));
        }
        for (key, value) in [
            ("speed", limits.speed),
            ("acceleration", limits.acceleration),
            ("torque", limits.torque),
            ("volts", limits.volts),
        ] {
            document.positive(&at(key), value)?;
        }
    }
    check_limits::check(file, document)
}

fn simulator(file: &RobotFile, document: &TomlDocument) -> Result<(), ConfigError> {
    let control = &file.control;
    let joints = file.joint_names().len();
    per_joint(document, &["control", "kp"], &control.kp, joints)?;
    per_joint(document, &["control", "kd"], &control.kd, joints)?;
    for (key, value) in [
        ("rate_hz", control.rate_hz),
        ("saturation_v", control.saturation_v),
        ("derivative_filter_hz", control.derivative_filter_hz),
    ] {
        document.positive(&["control", key], value)?;
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
            let (problem, remedy) = ("is a fraction of 0.5 or more", "give a fraction below 0.5");
            return Err(document.value(&["sensors", key], problem, remedy));
        }
    }
    let at = ["sensors", "temperature"];
    document.known_names(&at, &sensors.temperature, &file.joint_names())?;
    for (joint, course) in &sensors.temperature {
        let at = |key| ["sensors", "temperature", joint.as_str(), key];
        document.positive(&at("time_constant_s"), course.time_constant_s)?;
        document.positive(&at("cycle_s"), course.cycle_s)?;
    }
    let at = ["sensors", "torque_noise"];
    per_joint(document, &at, &sensors.torque_noise, joints)?;
    for &value in &sensors.torque_noise {
        document.not_negative(&at, Some(value))?;
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

/// Refuses a list that is neither empty nor one number for each joint or coordinate.
fn per_joint(
    document: &TomlDocument,
    at: &[&str],
    values: &[f64],
    joints: usize,
) -> Result<(), ConfigError> {
    if !values.is_empty() && values.len() != joints {
        let problem = format!("holds {} numbers", values.len());
        let remedy = format!("give {joints}, one for each joint or coordinate");
        return Err(document.value(at, &problem, &remedy));
    }
    Ok(())
}
