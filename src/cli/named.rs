//! What the files of `identify` are: a robot and its logs in any order, a campaign, an example that comes with the tool.

use std::path::{Path, PathBuf};

use clap::ValueEnum;

use super::example::{self, ExampleMachine};
use super::{CliError, Context};
use cft_ident_files::config::{CampaignFile, RobotFile};
use cft_ident_logs::log::{DOCUMENT, LogError, LogSection, LogSpec, RawReader, begins_with};

/// What `identify` works on.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum IdentifyTarget {
    /// Nothing was named: the built-in campaign.
    BuiltIn,
    Campaign(PathBuf),
    Robot(PathBuf, Vec<LogSpec>),
}

/// The files by what they are; `urdf` and `log` are those that were named as such.
pub(super) fn named(
    files: &[LogSpec],
    (urdf, log): (Option<&Path>, &[LogSpec]),
    context: &Context,
) -> Result<IdentifyTarget, CliError> {
    if let ([only], None, []) = (files, urdf, log)
        && let Some(found) = of_example(&only.path, context)?
    {
        return Ok(found);
    }
    let (robots, mut logs): (Vec<LogSpec>, Vec<LogSpec>) =
        files.iter().cloned().partition(|file| is_robot(&file.path));
    logs.extend(log.iter().cloned());
    let mut robots: Vec<PathBuf> = robots.into_iter().map(|file| file.path).collect();
    robots.extend(urdf.map(Path::to_path_buf));
    match (robots.as_slice(), logs.as_slice()) {
        ([], []) => Ok(IdentifyTarget::BuiltIn),
        ([], [first, ..]) => {
            let name = first.name();
            is_a_log(first)?;
            if begins_with(&first.path, DOCUMENT) {
                let problem = format!("{name}: is a JSON document of this program, not a log");
                return Err(CliError::usage(problem).hint("give the log that it is of"));
            }
            Err(CliError::usage(format!("{name}: a log without a robot"))
                .hint(format!(
                    "name its URDF: cft-ident identify ROBOT.urdf {name}"
                ))
                .hint(format!(
                    "without a URDF, make a robot file first: cft-ident new NAME --log {name}"
                )))
        }
        ([robot], []) if is_toml(robot) => Ok(IdentifyTarget::Campaign(robot.clone())),
        ([robot], []) => Err(without_log(robot)),
        ([robot], logs) => Ok(IdentifyTarget::Robot(robot.clone(), logs.to_vec())),
        ([first, second, ..], _) => Err(CliError::usage(format!(
            "two robots: {} and {}",
            first.display(),
            second.display()
        ))
        .hint("name one robot (URDF or robot file) and its logs")),
    }
}

/// Refuses what no robot file makes a log of: no file, a folder without a recording, a picture.
fn is_a_log(file: &LogSpec) -> Result<(), CliError> {
    match RawReader::open_plain(file, &LogSection::default()) {
        Err(
            error @ (LogError::Read { .. }
            | LogError::Format { .. }
            | LogError::Folder { .. }
            | LogError::Empty { .. }),
        ) => Err(error.into()),
        _ => Ok(()),
    }
}

fn without_log(robot: &Path) -> CliError {
    let robot = robot.display();
    CliError::input(format!("{robot}: a robot without a log")).hint(format!(
        "name its logs, too: cft-ident identify {robot} LOG.."
    ))
}

/// The campaign of a file; a robot file is none.
pub(super) fn campaign(file: &Path) -> Result<CampaignFile, CliError> {
    CampaignFile::load(file).map_err(|error| match RobotFile::load(file) {
        Ok(_) => without_log(file),
        Err(_) => error.into(),
    })
}

fn is_toml(file: &Path) -> bool {
    file.extension().is_some_and(|end| end == "toml")
}

/// Whether a file is the description of a robot and no file of this tool.
pub(super) fn is_urdf(file: &Path) -> bool {
    let ends = ["urdf", "xml", "xacro"];
    let end = file.extension().unwrap_or_default();
    ends.iter().any(|known| end.eq_ignore_ascii_case(known))
}

fn is_robot(file: &Path) -> bool {
    is_toml(file) || is_urdf(file)
}

/// The files of an example whose name was given where no file has it.
fn of_example(name: &Path, context: &Context) -> Result<Option<IdentifyTarget>, CliError> {
    let word = name.to_str().unwrap_or_default();
    let machine = ExampleMachine::from_str(word, false).ok();
    let Some(machine) = machine.filter(|_| !name.exists() || name.join("README.txt").exists())
    else {
        return Ok(None);
    };
    if !machine.is_robot() {
        let problem =
            format!("the example {word} holds no robot with torques, which `identify` asks for");
        return Err(CliError::usage(problem).hint(format!(
            "`cft-ident example {word}` writes it, and says what to do with it"
        )));
    }
    let folder = PathBuf::from(word);
    example::write(machine.machine(), &folder, context)?;
    // they are read at once
    context.files.commit()?;
    Ok(Some(match machine.robot_and_log() {
        Some([robot, log]) => {
            IdentifyTarget::Robot(folder.join(robot), vec![LogSpec::whole(folder.join(log))])
        }
        None => IdentifyTarget::Campaign(folder.join("campaign.toml")),
    }))
}
