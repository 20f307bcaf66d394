//! What an export reads beside the model, and what it does not write over.

use std::path::Path;

use crate::cli::files::ReadFile;
use crate::cli::{CliError, file_name};
use cft_ident_export::export;
use cft_ident_files::config::{self, RobotFile};
use cft_ident_logs::log::{Provenance, escape};

/// A URDF that stands for the robot, and the robot that it is read as.
pub(super) fn source(path: &Path) -> Result<ReadFile<(String, RobotFile)>, CliError> {
    let shown = escape(&path.to_string_lossy());
    let (file, text) = (file_name(path), config::text(path)?);
    let section = toml::Value::from(file.as_str());
    let robot = format!("[robot]\nmodel = \"serial\"\nurdf = {section}\n");
    let robot = RobotFile::parse_in(&shown, &robot, path.parent())?;
    Ok(ReadFile {
        provenance: Provenance::of_text(&file, &text),
        value: (text, robot),
        name: shown,
    })
}

/// Refuses a file beside a URDF that no export has written: a robot file of the same stem, say.
pub(super) fn not_of_others(urdf: &Path, side: &Path) -> Result<(), CliError> {
    let other = std::fs::read(side).is_ok_and(|bytes| {
        let text = String::from_utf8_lossy(&bytes);
        !text
            .lines()
            .any(|line| line.starts_with(export::urdf::SIDE))
    });
    if !other {
        return Ok(());
    }
    let [urdf, side] = [urdf, side].map(|path| path.display());
    let text =
        format!("{side} is there already, and it is no file that belongs to an exported URDF");
    Err(CliError::output(text).hint(format!(
        "the export writes it beside {urdf}: give the URDF another name, or move {side}"
    )))
}
