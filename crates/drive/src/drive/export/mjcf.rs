//! Actuators of MuJoCo: `general` for a torque drive, `dcmotor` for a volts drive.
//!
//! A constant torque goes into the bias of `general` as a torque; as a bias of the position it would be wrong with the
//! next gain. `dcmotor` takes the volts of the controller with its back-EMF: kp' = kt V k kp/R, kd' = kt^2/R + kt V k kd/R.

use cft_ident_core::number::significant;

use super::{ExportGains, ExportedText, electric, numbers, with_inertia};
use crate::drive::drive_file::DriveFile;
use crate::drive::error::DriveError;

/// Version whose words the file uses.
const VERSION: &str = "4.0";

/// A file to be included beside the robot's: joints' numbers as comments, actuators as elements.
pub fn actuators(file: &DriveFile, gains: &ExportGains) -> Result<ExportedText, DriveError> {
    with_inertia(file)?;
    let mut left_out = Vec::new();
    let (mut defaults, mut actuators) = (String::new(), String::new());
    let delay = file.find("command_delay", None);
    let loop_delay = file.find("loop_delay", None);
    let dt = gains.timestep;
    // a delay of n steps needs n + 1 samples, or it is two steps without a word
    let late = match delay.filter(|d| *d > 0.0) {
        Some(delay) => format!(
            " delay=\"{}\" nsample=\"{}\" interp=\"linear\"",
            x(delay),
            (delay / dt).ceil() as usize + 1
        ),
        None => String::new(),
    };
    if let Some(late) = loop_delay {
        left_out.push(format!(
            "loop delay of {} s: an actuator delays its command alone",
            x(late)
        ));
    }
    for joint in &file.drive.joints {
        let of = numbers(file, joint);
        let name = escaped(joint);
        defaults += &format!(
            "    <!-- joint {name}: armature=\"{}\" damping=\"{}\" frictionloss=\"{}\" -->\n",
            x(of.armature),
            x(of.viscous),
            x(of.coulomb)
        );
        let speed = of.speed_limit.map_or(0.0, |v| v);
        match file.drive.supply {
            None => {
                let range = of.torque_limit.map_or(String::new(), |most| {
                    format!(
                        " forcelimited=\"true\" forcerange=\"{} {}\"",
                        x(-most),
                        x(most)
                    )
                });
                // tau = kp (u - (q - b)) - kd v + c
                actuators += &format!(
                    "    <general name=\"{name}\" joint=\"{name}\" gainprm=\"{kp}\" biastype=\"affine\" biasprm=\"{c} {} {}\"{range}{late}/>\n",
                    x(-gains.kp),
                    x(-gains.kd),
                    kp = x(gains.kp),
                    c = x(of.offset + gains.kp * of.bias),
                );
                if of.speed_limit.is_some() {
                    left_out.push(format!("{joint}: speed limit of the set point"));
                }
            }
            Some(supply) => {
                let electric = electric(file, &of, supply)?;
                let per_kp = of.stiffness * gains.kp;
                let kd = of.back_emf + of.stiffness * gains.kd;
                let most = supply * electric.duty_max;
                actuators += &format!(
                    "    <dcmotor name=\"{name}\" joint=\"{name}\" motorconst=\"{}\" resistance=\"{}\" input=\"pos\" controller=\"{} 0 {} {} 0 {}\"{late}/>\n",
                    x(electric.kt),
                    x(electric.resistance),
                    x(per_kp),
                    x(kd),
                    x(speed),
                    x(most),
                );
                if of.offset != 0.0 || of.bias != 0.0 {
                    left_out.push(format!(
                        "{joint}: torque offset and encoder bias, which `dcmotor` has no word for"
                    ));
                }
            }
        }
        if of.load_friction != 0.0 {
            left_out.push(format!(
                "{joint}: dry friction that grows with the load ({})",
                x(of.load_friction)
            ));
        }
        if of.stribeck != 0.0 {
            left_out.push(format!(
                "{joint}: dry friction that is {} N m more near rest",
                x(of.stribeck)
            ));
        }
    }
    let lost: String = left_out
        .iter()
        .map(|line| format!("     NOT in here: {}\n", comment(line)))
        .collect();
    let text = format!(
        "<mujoco>\n\
         <!-- Drives by cft-ident {} for MuJoCo {VERSION}, timestep {} s, kp {}, kd {}.\n\
         Put armature, damping and frictionloss at the joints. The delay line and a set point with a speed limit begin at 0:\n\
         set them to the first command, as by mj_setState of the log's start.\n{lost}-->\n\
         <option timestep=\"{}\" integrator=\"implicitfast\" noslip_iterations=\"10\"/>\n\
         <!-- without noslip iterations dry friction creeps -->\n{defaults}  <actuator>\n{actuators}  </actuator>\n</mujoco>\n",
        env!("CARGO_PKG_VERSION"),
        x(dt),
        x(gains.kp),
        x(gains.kd),
        x(dt),
    );
    Ok(ExportedText { text, left_out })
}

fn x(value: f64) -> String {
    match value {
        0.0 => "0".to_owned(),
        value => significant(value, 9),
    }
}

/// A name as an attribute may hold it.
fn escaped(name: &str) -> String {
    let plain = |c: char| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        '-' => "-".to_owned(),
        c => c.to_string(),
    };
    name.chars().map(plain).collect()
}

/// A text as a comment may hold it.
fn comment(text: &str) -> String {
    text.replace("--", "- -")
}
