//! What an export wrote, as its document has it.

use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use crate::cli::file_name;
use cft_ident_export::export::left_out::LeftOut;

/// A model that was written for other programs.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Exported")]
pub struct ExportedModel {
    pub joints: Vec<String>,
    pub files: Vec<WrittenFile>,
    /// Effects that the files do not hold.
    pub left_out: Vec<String>,
    /// What the files of simulators cannot say, file by file.
    pub beyond: Vec<FormatOmission>,
    /// Lines for a controller; null where none were asked for.
    pub lines: Option<Vec<String>>,
}

/// What a format cannot say.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Beyond")]
pub struct FormatOmission {
    /// The file.
    pub file: String,
    /// What it is.
    pub what: String,
    /// Joint where it is largest; null where no log determines.
    pub joint: Option<String>,
    /// Its rms over that of the joint's torque along the logs, in percent; null where no log determines.
    pub percent_of_torque: Option<f64>,
}

impl FormatOmission {
    pub(super) fn of(path: &Path, part: LeftOut) -> Self {
        FormatOmission {
            file: file_name(path),
            what: part.what,
            joint: part.joint,
            percent_of_torque: part.percent_of_torque,
        }
    }
}

/// A file that was written.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Written")]
pub struct WrittenFile {
    /// Its name.
    pub file: String,
    /// What it is.
    pub what: String,
}
