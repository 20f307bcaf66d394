//! A model file that takes its links and their inertials from a URDF beside it.

use crate::config::ConfigError;
use crate::config::document::TomlDocument;
use crate::config::model_file::Parameter;
use crate::config::robot_file::RobotFile;
use cft_ident_core::robot::standard::STANDARD;

/// Name of the parameter that gives a joint's drive inertia in such a file.
pub const DRIVE_INERTIA: &str = "drive_inertia";

/// Puts base parameters by the URDF's inertials in the place of the drive inertias, where the file does not give them.
pub(in crate::config) fn base_parameters(
    robot: &RobotFile,
    parameters: &mut Vec<Parameter>,
    document: &TomlDocument,
) -> Result<(), ConfigError> {
    let described = robot.robot();
    let mut standard = vec![0.0; described.standard_parameters()];
    for (i, link) in robot.robot.link.iter().enumerate() {
        if let Some(given) = &link.inertial {
            let values = given.body().standard();
            standard[i * STANDARD..(i + 1) * STANDARD].copy_from_slice(&values);
        }
    }
    let drives = robot.robot.link.len() * STANDARD;
    for (index, parameter) in parameters.iter().enumerate() {
        if parameter.name != DRIVE_INERTIA {
            continue;
        }
        let joint = parameter.joint.as_deref().unwrap_or_default();
        let mut names = described.joint_names().iter();
        let place = names.position(|name| name == joint);
        match place.and_then(|j| standard.get_mut(drives + j)) {
            Some(value) => *value = parameter.value,
            None => {
                return Err(document.value(
                    &["parameter", &index.to_string(), "joint"],
                    "is no joint of this robot with a drive inertia",
                    &format!("this robot has {}", described.joint_names().join(", ")),
                ));
            }
        }
    }
    parameters.retain(|p| p.name != DRIVE_INERTIA);
    let base = described.base_of(&standard);
    for (info, value) in described.parameters().iter().zip(base) {
        if parameters
            .iter()
            .any(|p| p.joint.is_none() && p.name == info.name)
        {
            continue;
        }
        parameters.push(Parameter {
            name: info.name.to_string(),
            theta: None,
            joint: None,
            value,
            consistent: None,
            std: None,
            unit: info.unit.to_string(),
            meaning: info.meaning.to_string(),
            verdict: None,
        });
    }
    Ok(())
}
