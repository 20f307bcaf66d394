//! The model file of drives: TOML that a person reads and an export starts from.

use cft_ident_logs::log::Provenance;
use serde::{Deserialize, Serialize};

use super::error::DriveError;
use super::outcome::{DeclaredDrive, DriveParameter, DriveResult, DriveStep, GivenParameter};

/// What stands in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveFile {
    pub drive: DeclaredDrive,
    pub parameter: Vec<DriveParameter>,
    /// Single numbers with what they hold with.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub given: Vec<GivenParameter>,
    /// Effects that stand in the model.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effect: Vec<DriveStep>,
    pub provenance: DriveProvenance,
}

/// Where the numbers are from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DriveProvenance {
    pub version: String,
    pub inputs: Vec<Provenance>,
}

impl DriveFile {
    /// Whether a text is that of drives: a robot file has a table for each of its drives.
    pub fn is_one(text: &str) -> bool {
        text.lines().any(|line| line.trim() == "[drive]")
            && !text
                .lines()
                .any(|line| line.trim_start().starts_with("[robot"))
    }

    /// Of a result.
    pub fn new(drives: &DriveResult, version: &str, inputs: &[Provenance]) -> Self {
        let written = drives.steps.iter().filter(|step| step.written);
        DriveFile {
            drive: drives.drive.clone(),
            parameter: drives.parameters.clone(),
            given: drives.given.clone(),
            effect: written.cloned().collect(),
            provenance: DriveProvenance {
                version: version.to_owned(),
                inputs: inputs.to_vec(),
            },
        }
    }

    /// As text.
    pub fn to_toml(&self) -> Result<String, DriveError> {
        let text = toml::to_string(self).map_err(|e| DriveError::Request {
            what: format!("the drives cannot be written as TOML: {e}"),
            remedy: "leave the joint out whose numbers are none".to_owned(),
        })?;
        Ok(format!(
            "# Drives identified from commanded and measured positions. SI units and radians.\n{text}"
        ))
    }

    /// From text.
    pub fn parse(name: &str, text: &str) -> Result<Self, DriveError> {
        toml::from_str(text).map_err(|e| DriveError::File {
            file: name.to_owned(),
            what: format!("is no model file of drives: {}", e.message()),
            remedy: "give the file that `cft-ident drive -o` wrote".to_owned(),
        })
    }

    /// A number of a joint, or of the machine.
    pub fn find(&self, name: &str, joint: Option<&str>) -> Option<f64> {
        let mut all = self.parameter.iter();
        let found = all.find(|p| p.name == name && p.joint.as_deref() == joint)?;
        Some(found.value)
    }
}
