//! Actuators of Isaac Lab, as a Python file with one configuration per joint.

use super::{ExportGains, ExportedText, electric, numbers, with_inertia};
use crate::drive::drive_file::DriveFile;
use crate::drive::error::DriveError;

/// A module with `ACTUATORS`, by joint.
pub fn actuators(file: &DriveFile, gains: &ExportGains) -> Result<ExportedText, DriveError> {
    with_inertia(file)?;
    let mut left_out = Vec::new();
    let delay = file.find("command_delay", None).filter(|d| *d > 0.0);
    if let Some(late) = file.find("loop_delay", None) {
        left_out.push(format!(
            "loop delay of {late:.4} s: DelayedPDActuatorCfg delays the command"
        ));
    }
    let mut entries = String::new();
    let (mut imports, steps) = (
        vec!["ImplicitActuatorCfg"],
        delay.map(|d| (d / gains.timestep).round()),
    );
    for joint in &file.drive.joints {
        let of = numbers(file, joint);
        let (kp, kd) = match file.drive.supply {
            None => (gains.kp, gains.kd),
            Some(_) => (
                of.stiffness * gains.kp,
                of.back_emf + of.stiffness * gains.kd,
            ),
        };
        let mut numbers = vec![
            format!("joint_names_expr=[{joint:?}]"),
            format!("stiffness={kp:.9}"),
            format!("damping={kd:.9}"),
            format!("armature={:.9}", of.armature),
            format!("friction={:.9}", of.coulomb),
            format!("viscous_friction={:.9}", of.viscous),
        ];
        let class = match (steps, of.torque_limit, file.drive.supply) {
            (Some(steps), ..) => {
                numbers.push(format!("min_delay={steps}, max_delay={steps}"));
                "DelayedPDActuatorCfg"
            }
            (None, Some(most), Some(supply)) => {
                let electric = electric(file, &of, supply)?;
                let free = supply * electric.duty_max / electric.kt;
                numbers.push(format!("saturation_effort={most:.9}"));
                numbers.push(format!("velocity_limit={free:.9}"));
                "DCMotorCfg"
            }
            _ => "ImplicitActuatorCfg",
        };
        if !imports.contains(&class) {
            imports.push(class);
        }
        if let Some(most) = of.torque_limit {
            numbers.push(format!("effort_limit={most:.9}"));
        }
        entries += &format!(
            "    {joint:?}: {class}(\n        {},\n    ),\n",
            numbers.join(",\n        ")
        );
        for (there, what) in [
            (of.speed_limit.is_some(), "speed limit of the set point"),
            (
                of.load_friction != 0.0,
                "dry friction that grows with the load",
            ),
            (of.stribeck != 0.0, "dry friction that is more near rest"),
            (of.offset != 0.0, "torque offset"),
            (of.bias != 0.0, "encoder bias"),
        ] {
            if there {
                left_out.push(format!("{joint}: {what}"));
            }
        }
    }
    let lost: String = left_out
        .iter()
        .map(|line| format!("# NOT in here: {line}\n"))
        .collect();
    let text = format!(
        "# Drives by cft-ident {}, for Isaac Lab, physics step {} s, kp {}, kd {}.\n# Written after its documentation, not run.\n{lost}\
         from isaaclab.actuators import {}\n\nACTUATORS = {{\n{entries}}}\n",
        env!("CARGO_PKG_VERSION"),
        gains.timestep,
        gains.kp,
        gains.kd,
        imports.join(", "),
    );
    Ok(ExportedText { text, left_out })
}
