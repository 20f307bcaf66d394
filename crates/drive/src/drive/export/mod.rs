//! Drives for simulators: each file says what it cannot say.

pub mod bam;
pub mod isaaclab;
pub mod mjcf;

use super::drive_file::DriveFile;
use super::error::DriveError;

/// The gains that a file of a simulator holds, where it needs one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportGains {
    pub kp: f64,
    pub kd: f64,
    /// Step of the simulator [s].
    pub timestep: f64,
}

/// A text, and what of the model it does not hold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExportedText {
    pub text: String,
    pub left_out: Vec<String>,
}

/// Numbers of one joint as exports need them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JointNumbers {
    pub armature: f64,
    pub viscous: f64,
    pub coulomb: f64,
    pub load_friction: f64,
    pub stribeck: f64,
    pub offset: f64,
    pub bias: f64,
    pub stiffness: f64,
    /// D while the drive is on, less the viscous friction.
    pub back_emf: f64,
    pub torque_limit: Option<f64>,
    pub speed_limit: Option<f64>,
}

/// Numbers of a joint of a file.
fn numbers(file: &DriveFile, joint: &str) -> JointNumbers {
    let find = |name: &str| file.find(name, Some(joint));
    let get = |name: &str| find(name).unwrap_or(0.0);
    JointNumbers {
        armature: get("armature"),
        viscous: get("viscous"),
        coulomb: get("coulomb"),
        load_friction: get("load_friction"),
        stribeck: get("stribeck"),
        offset: get("torque_offset"),
        bias: get("encoder_bias"),
        stiffness: get("stiffness"),
        back_emf: find("back_emf").unwrap_or_else(|| get("damping")),
        torque_limit: find("torque_limit"),
        speed_limit: find("speed_limit"),
    }
}

/// kt, R and the duty per radian and unit of kp; where nothing declares them, those of a largest duty of 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElectricNumbers {
    pub kt: f64,
    pub resistance: f64,
    pub firmware_gain: f64,
    pub duty_max: f64,
    /// Whether a declared number stands behind them; else only their products do.
    pub declared: bool,
}

/// The electric numbers of a joint at a supply.
fn electric(
    file: &DriveFile,
    of: &JointNumbers,
    supply: f64,
) -> Result<ElectricNumbers, DriveError> {
    let drive = &file.drive;
    let missing = || {
        DriveError::Request {
        what: "kt and R do not follow from these logs: no torque limit was reached, and no firmware gain is declared".to_owned(),
        remedy: "give --firmware-gain or --duty-max to `cft-ident drive`, or log steps that saturate the drive".to_owned(),
    }
    };
    // kt/R
    let (slope, duty_max, declared) = match (drive.firmware_gain, of.torque_limit) {
        (Some(k), _) => (
            of.stiffness / (k * supply),
            drive.duty_max.unwrap_or(1.0),
            true,
        ),
        (None, Some(most)) => {
            let duty = drive.duty_max.unwrap_or(1.0);
            (most / (duty * supply), duty, drive.duty_max.is_some())
        }
        (None, None) => return Err(missing()),
    };
    let kt = of.back_emf / slope;
    if !(slope > 0.0 && kt > 0.0) {
        return Err(missing());
    }
    Ok(ElectricNumbers {
        kt,
        resistance: kt / slope,
        firmware_gain: of.stiffness / (slope * supply),
        duty_max,
        declared,
    })
}

/// Refuses drives whose torques are ratios to an inertia that nobody knows.
fn with_inertia(file: &DriveFile) -> Result<(), DriveError> {
    match file.drive.ratios {
        false => Ok(()),
        true => Err(DriveError::Request {
            what: "these torques are ratios to the inertia, and a simulator needs N m".to_owned(),
            remedy: "identify with the links: -r ROBOT.urdf, or with mass and length of a rig"
                .to_owned(),
        }),
    }
}
