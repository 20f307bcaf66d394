//! Reading of configuration files; those that come with the tool are found anywhere.

use std::path::Path;

use super::campaign::CampaignFile;
use super::document::TomlDocument;
use super::model_file::ModelFile;
use super::robot_file::RobotFile;
use super::text_file::text_of;
use super::trajectory::Trajectory;
use super::{ConfigError, check, serial_chain, urdf};
use cft_ident_logs::log::{did_you_mean, list, named_beside_of, remedy, shown};

/// Paths and texts of files in `configs/`.
macro_rules! configs {
    [$($name:literal),* $(,)?] => {
        [$((
            concat!("configs/", $name),
            include_str!(concat!("../../../../configs/", $name)),
        )),*]
    };
}

/// The files that come with the tool, by the path under which they are asked for.
pub const EMBEDDED: [(&str, &str); 13] = configs![
    "cft.toml",
    "cft-validation.toml",
    "cft-excitation.toml",
    "cft-dspace.toml",
    "emps.toml",
    "emps-symmetric.toml",
    "bldc.toml",
    "panda.toml",
    "tx40.toml",
    "ur10.toml",
    "kr300.toml",
    "pendulum.toml",
    "table3.toml",
];

/// Text of a file that comes with the tool.
pub fn embedded(path: &Path) -> Option<&'static str> {
    let path = path.strip_prefix(".").unwrap_or(path);
    let found = EMBEDDED.iter().find(|(name, _)| Path::new(name) == path);
    found.map(|(_, text)| *text)
}

/// What a file is to be, which decides what is suggested where it is not there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WantedFile {
    Robot,
    Trajectory,
    /// A file of the user's: a model, a campaign, a document.
    Own,
    /// Any of them.
    Any,
}

impl WantedFile {
    /// Whether a file of the user's may be one: a robot file is no model, and neither is a trajectory.
    fn may_be(self, path: &Path) -> bool {
        let Ok(text) = text_of(path) else {
            return false;
        };
        match self {
            WantedFile::Robot | WantedFile::Trajectory => {
                self.is(&text) && !text.contains("[contents]")
            }
            WantedFile::Own | WantedFile::Any => true,
        }
    }

    /// Whether a file that comes with the tool is one.
    fn is(self, text: &str) -> bool {
        match self {
            WantedFile::Robot => text.contains("[robot]"),
            WantedFile::Trajectory => text.contains("kind = ") && !text.contains("[robot]"),
            WantedFile::Own => false,
            WantedFile::Any => true,
        }
    }
}

/// Text of a configuration file: the one on the disk, else the one that comes with the tool.
///
/// # Errors
/// [`ConfigError::Read`] where there is neither.
pub fn text(path: &Path) -> Result<String, ConfigError> {
    text_of_kind(path, WantedFile::Any)
}

/// Text of a file of one kind, likewise.
///
/// # Errors
/// [`ConfigError::Read`] where there is neither.
pub fn text_of_kind(path: &Path, wanted: WantedFile) -> Result<String, ConfigError> {
    let error = match text_of(path) {
        Ok(text) => return Ok(text),
        Err(error) => error,
    };
    if error.kind() == std::io::ErrorKind::NotFound {
        if let Some(text) = embedded(path) {
            return Ok(text.to_owned());
        }
        let known = EMBEDDED.iter().filter(|(_, text)| wanted.is(text));
        let known = list(known.map(|(name, _)| *name));
        let mut said = remedy(&error).to_owned();
        said += &named_beside_of(path, &["toml"], &|beside| wanted.may_be(beside));
        if !known.is_empty() {
            let near = did_you_mean(&shown(path), &known);
            said += &format!("\n{near}these come with the tool: {known}");
        }
        return Err(ConfigError::Read {
            file: shown(path),
            remedy: said,
            source: error,
        });
    }
    if let Some(kind) = other_kind(path, "") {
        return Err(kind);
    }
    Err(ConfigError::Read {
        file: shown(path),
        remedy: match error.kind() {
            std::io::ErrorKind::InvalidData => "name a text file of below 16 MB".to_owned(),
            _ => remedy(&error).to_owned(),
        },
        source: error,
    })
}

/// What a file is that is no TOML text: a URDF, or a log.
pub(super) fn other_kind(path: &Path, text: &str) -> Option<ConfigError> {
    let file = shown(path);
    let ends = path
        .extension()
        .map(|end| end.to_string_lossy().to_lowercase());
    let ends = ends.as_deref().unwrap_or_default();
    let (found, remedy) = match text.trim_start_matches('\u{feff}').trim_start() {
        text if text.starts_with('<') && (text.contains("<robot") || ends == "urdf") => (
            "a URDF",
            format!("make a robot file of it: cft-ident new NAME --urdf {file} --log LOG"),
        ),
        text if text.starts_with('<') => (
            "an XML file",
            "give a robot file\n`cft-ident new` writes one".to_owned(),
        ),
        _ if ["csv", "mcap", "db3", "zst", "gz", "bag"].contains(&ends) => (
            "a log",
            format!("make a robot file for it: cft-ident new NAME --log {file}"),
        ),
        _ => return None,
    };
    Some(ConfigError::Kind {
        file,
        found,
        wanted: "a robot or model file",
        remedy,
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
        if let Some(kind) = other_kind(Path::new(file), text) {
            return Err(kind);
        }
        let document = TomlDocument::new(file, text);
        let mut robot: Self = document.read()?;
        let taken = serial_chain::take_as_meant(&mut robot.robot, &document, file);
        robot.notes.0.extend(taken);
        urdf::resolve(&mut robot, &document, folder)?;
        check::check(&robot, &document)?;
        robot.settle_motors();
        Ok(robot)
    }

    /// Reads and checks a robot file, or one that comes with the tool.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let text = text_of_kind(path, WantedFile::Robot)?;
        Self::parse_in(&shown(path), &text, path.parent())
    }
}

impl ModelFile {
    /// Reads and checks a model file.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let text = text_of_kind(path, WantedFile::Own)?;
        Self::parse_in(&shown(path), &text, path.parent())
    }
}

impl Trajectory {
    /// Reads and checks a trajectory file, or one that comes with the tool.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::parse(&shown(path), &text_of_kind(path, WantedFile::Trajectory)?)
    }
}

impl CampaignFile {
    /// Reads and checks a campaign file.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        Self::parse(&shown(path), &text_of_kind(path, WantedFile::Own)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_there_is_answered_with_files_of_its_kind() {
        let said = |wanted| {
            text_of_kind(Path::new("none.toml"), wanted)
                .unwrap_err()
                .to_string()
        };
        let robot = said(WantedFile::Robot);
        assert!(robot.contains("configs/ur10.toml"), "{robot}");
        assert!(!robot.contains("configs/cft-excitation.toml"), "{robot}");
        let motion = said(WantedFile::Trajectory);
        assert!(motion.contains("configs/cft-excitation.toml"), "{motion}");
        assert!(!motion.contains("configs/ur10.toml"), "{motion}");
        assert!(!said(WantedFile::Own).contains("come with the tool"));

        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("arm_model.toml", "[contents]\n[robot]\n");
        write("arm_robot.toml", "[robot]\n");
        let missing = folder.path().join("arm_mobel.toml");
        let said = text_of_kind(&missing, WantedFile::Robot).unwrap_err();
        let said = said.to_string();
        assert!(
            said.contains("arm_robot.toml") && !said.contains("arm_model.toml"),
            "{said}"
        );
    }
}
