//! Parameters as BAM (Rhoban, better actuator models) reads them: flat JSON with `model` and `actuator`.
//!
//! m1: dry and viscous friction; m4 with load and Stribeck. Firmware gain, largest duty and delays are no keys of the file.

use serde_json::json;

use super::{ExportedText, electric, numbers, with_inertia};
use crate::drive::drive_file::DriveFile;
use crate::drive::error::DriveError;

/// The file of a drive of one joint; `actuator` is the name of BAM's class.
pub fn parameters(file: &DriveFile, actuator: &str) -> Result<ExportedText, DriveError> {
    with_inertia(file)?;
    let refused = |what: &str, remedy: &str| DriveError::Request {
        what: what.to_owned(),
        remedy: remedy.to_owned(),
    };
    let [joint] = file.drive.joints.as_slice() else {
        return Err(refused(
            "BAM's file is that of one servo",
            "identify the servo on a rig by itself",
        ));
    };
    let Some(supply) = file.drive.supply else {
        return Err(refused(
            "BAM's file is that of a volts drive",
            "use --mjcf-actuators or --isaaclab for a torque drive",
        ));
    };
    let of = numbers(file, joint);
    let electric = electric(file, &of, supply)?;
    let load = of.load_friction != 0.0;
    let stribeck = of.stribeck != 0.0;
    let model = match (load, stribeck) {
        (false, false) => "m1",
        (true, false) => "m3",
        (false, true) => "m2",
        (true, true) => "m4",
    };
    let mut value = json!({
        "model": model,
        "actuator": actuator,
        "kt": electric.kt,
        "R": electric.resistance,
        "armature": of.armature,
        "q_offset": 0.0,
        "friction_base": of.coulomb,
        "friction_viscous": of.viscous,
    });
    if load {
        value["load_friction_base"] = of.load_friction.into();
        value["load_friction_motor"] = of.load_friction.into();
        value["load_friction_external"] = 0.0.into();
    }
    if stribeck {
        value["friction_stribeck"] = of.stribeck.into();
        value["dtheta_stribeck"] = file.drive.stribeck_speed.first().copied().into();
        value["alpha"] = 2.0.into();
        value["load_friction_stribeck"] = 0.0.into();
    }
    let mut left_out = vec![format!(
        "the class {actuator} must have error_gain {:.4} and max_pwm {:.4}: they are no keys of the file",
        electric.firmware_gain, electric.duty_max
    )];
    if !electric.declared {
        left_out.push("kt and R hold with a largest duty of 1, which nothing declares".to_owned());
    }
    for (name, what) in [
        ("command_delay", "the delay of the command"),
        ("loop_delay", "the delay of the loop"),
    ] {
        if let Some(value) = file.find(name, None) {
            left_out.push(format!(
                "{what}, {:.1} ms: there is no key for it",
                1e3 * value
            ));
        }
    }
    if let Some(limit) = of.speed_limit {
        left_out.push(format!(
            "the speed limit of the set point, {limit:.2} rad/s: BAM's class holds it"
        ));
    }
    if of.offset != 0.0 || of.bias != 0.0 {
        left_out.push("torque offset and encoder bias".to_owned());
    }
    Ok(ExportedText {
        text: format!("{value:#}\n"),
        left_out,
    })
}
