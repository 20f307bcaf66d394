//! Reading of configuration files; those that come with the tool are found anywhere.

use std::path::Path;

use super::campaign::Campaign;
use super::document::Document;
use super::model_file::ModelFile;
use super::robot_file::RobotFile;
use super::trajectory::Trajectory;
use super::{ConfigError, check, urdf};
use crate::log::{did_you_mean, list, remedy, shown};

/// The files that come with the tool, by the path under which they are asked for.
pub const EMBEDDED: [(&str, &str); 13] = [
    ("configs/cft.toml", include_str!("../../configs/cft.toml")),
    (
        "configs/cft-validation.toml",
        include_str!("../../configs/cft-validation.toml"),
    ),
    (
        "configs/cft-excitation.toml",
        include_str!("../../configs/cft-excitation.toml"),
    ),
    (
        "configs/cft-dspace.toml",
        include_str!("../../configs/cft-dspace.toml"),
    ),
    ("configs/emps.toml", include_str!("../../configs/emps.toml")),
    (
        "configs/emps-symmetric.toml",
        include_str!("../../configs/emps-symmetric.toml"),
    ),
    ("configs/bldc.toml", include_str!("../../configs/bldc.toml")),
    (
        "configs/panda.toml",
        include_str!("../../configs/panda.toml"),
    ),
    ("configs/tx40.toml", include_str!("../../configs/tx40.toml")),
    ("configs/ur10.toml", include_str!("../../configs/ur10.toml")),
    (
        "configs/kr300.toml",
        include_str!("../../configs/kr300.toml"),
    ),
    (
        "configs/pendulum.toml",
        include_str!("../../configs/pendulum.toml"),
    ),
    (
        "configs/table3.toml",
        include_str!("../../configs/table3.toml"),
    ),
];

/// Text of a file that comes with the tool.
pub fn embedded(path: &Path) -> Option<&'static str> {
    let path = path.strip_prefix(".").unwrap_or(path);
    let found = EMBEDDED.iter().find(|(name, _)| Path::new(name) == path);
    found.map(|(_, text)| *text)
}

/// Text of a configuration file: the one on the disk, else the one that comes with the tool.
///
/// # Errors
/// [`ConfigError::Read`] where there is neither.
pub fn text(path: &Path) -> Result<String, ConfigError> {
    let error = match std::fs::read_to_string(path) {
        Ok(text) => return Ok(text),
        Err(error) => error,
    };
    if error.kind() == std::io::ErrorKind::NotFound {
        if let Some(text) = embedded(path) {
            return Ok(text.to_owned());
        }
        let known = list(EMBEDDED.iter().map(|(name, _)| *name));
        return Err(ConfigError::Read {
            file: shown(path),
            remedy: format!(
                "{}; {}these come with the tool: {known}",
                remedy(&error),
                did_you_mean(&shown(path), &known),
            ),
            source: error,
        });
    }
    Err(ConfigError::Read {
        file: shown(path),
        remedy: remedy(&error).to_owned(),
        source: error,
    })
}

impl RobotFile {
    /// Reads and checks a robot file from TOML text; `file` names it in errors. A text alone
    /// cannot name a URDF, which would stand beside it.
    pub fn parse(file: &str, text: &str) -> Result<Self, ConfigError> {
        Self::parse_in(file, text, None)
    }

    /// The same for the text of a file in `folder`, from where the URDF is read that it names: the
    /// robot file then holds its links and limits.
    pub fn parse_in(file: &str, text: &str, folder: Option<&Path>) -> Result<Self, ConfigError> {
        let document = Document::new(file, text);
        let mut robot: Self = document.read()?;
        urdf::resolve(&mut robot, &document, folder)?;
        check::check(&robot, &document)?;
        Ok(robot)
    }

    /// Reads and checks a robot file, or one that comes with the tool.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::parse_in(&shown(path), &text(path)?, path.parent())
    }
}

impl ModelFile {
    /// Reads and checks a model file.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::parse_in(&shown(path), &text(path)?, path.parent())
    }
}

impl Trajectory {
    /// Reads and checks a trajectory file, or one that comes with the tool.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::parse(&shown(path), &text(path)?)
    }
}

impl Campaign {
    /// Reads and checks a campaign file.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::parse(&shown(path), &text(path)?)
    }
}
