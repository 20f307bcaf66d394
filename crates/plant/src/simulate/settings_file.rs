//! Controller and settings of an experiment, as the robot file has them.

use super::SimulateError;
use super::controller::ControllerSettings;
use super::experiment::SECONDS;
use super::mechanism::Mechanism;
use super::plant::Plant;
use super::sensors::{Noise, PlantSensors};
use super::settings::Settings;
use cft_ident_files::config::robot_file::{self, RobotFile};

/// Gains of `[control]` over the usual ones.
pub(super) fn control<const J: usize>(
    file: &RobotFile,
    plant: &Plant<J>,
) -> Result<ControllerSettings<J>, SimulateError> {
    let (section, usual) = (&file.control, plant.control());
    let gains = |name: &'static str, given: &[f64], usual: [f64; J]| match given {
        [] => Ok(usual),
        given => {
            let gains = plant.mechanism.widened(given, 1.0);
            gains.ok_or(SimulateError::Parameter {
                name,
                value: given.len() as f64,
                rule: "must be one gain per motor",
            })
        }
    };
    // Gains without a derivative part are the report's P controller.
    let derivative = match section.kp.is_empty() {
        true => usual.derivative,
        false => [0.0; J],
    };
    Ok(ControllerSettings {
        proportional: gains("number of gains kp", &section.kp, usual.proportional)?,
        derivative: gains("number of gains kd", &section.kd, derivative)?,
        filter_hz: section.derivative_filter_hz.unwrap_or(usual.filter_hz),
    })
}

/// Rate, saturation and sensors of `[control]`, `[limits]` and `[sensors]`.
pub(super) fn settings<const J: usize>(
    file: &RobotFile,
    mechanism: &Mechanism<J>,
) -> Result<Settings<J>, SimulateError> {
    let mut settings = Settings::new(SECONDS);
    settings.rate_hz = file.control.rate_hz.unwrap_or(settings.rate_hz);
    settings.saturation = saturation(file, mechanism);
    let robot_file::SensorsSection {
        quantisation,
        volt_noise,
        ref torque_noise,
        torque_noise_relative,
        jitter,
        dropouts,
        ..
    } = file.sensors;
    let torque_noise = match (torque_noise.as_slice(), torque_noise_relative) {
        ([], None) => Noise::None,
        ([], Some(share)) => Noise::Relative(share),
        ([one], None) => Noise::Absolute([*one; J]),
        (levels, None) => {
            let each = mechanism.widened(levels, 0.0);
            Noise::Absolute(each.ok_or(SimulateError::Parameter {
                name: "number of levels torque_noise",
                value: levels.len() as f64,
                rule: "must be one per joint",
            })?)
        }
        (_, Some(share)) => {
            return Err(SimulateError::Parameter {
                name: "torque_noise_relative",
                value: share,
                rule: "torque_noise is given too; keep one of them",
            });
        }
    };
    settings.sensors = PlantSensors {
        quantisation: quantisation.unwrap_or(true),
        jitter: jitter.unwrap_or(0.0),
        dropouts: dropouts.unwrap_or(0.0),
        volt_noise: volt_noise.map_or(Noise::None, |std| Noise::Absolute([std; J])),
        torque_noise,
    };
    Ok(settings)
}

/// Largest drive of the motors \[V\]: `[control] saturation_v`, that of known amplifiers, or the torque of one joint alone.
fn saturation<const J: usize>(file: &RobotFile, mechanism: &Mechanism<J>) -> f64 {
    let amplifiers = mechanism.practice.as_ref().map(|practice| practice.volts);
    let own = || match mechanism.robot.joint_names() {
        [only] => file.limits.get(only).and_then(|l| l.torque.or(l.volts)),
        _ => None,
    };
    let known = file.control.saturation_v.or(amplifiers).or_else(own);
    known.unwrap_or(f64::INFINITY)
}
