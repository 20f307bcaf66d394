//! Configuration files as a command reads them: parsed, and known again by their checksum.

use std::path::Path;

use super::error::CliError;
use super::exit::Exit;
use super::{Context, file_name};
use cft_ident_drive::drive::drive_file::DriveFile;
use cft_ident_files::config::candidates::{self, CandidateSection};
use cft_ident_files::config::{self, ConfigError, ModelFile, RobotFile, Trajectory, WantedFile};
use cft_ident_logs::log::{Provenance, escape};
use cft_ident_stages::identify::{GivenModel, IdentifyError, refined_or_friction};
use cft_ident_tool::tool::ToolFile;

/// A configuration file that was read.
#[derive(Debug, Clone)]
pub struct ReadFile<T> {
    /// The file as the user named it, for messages.
    pub name: String,
    pub value: T,
    /// Its entry among the inputs of the result.
    pub provenance: Provenance,
}

fn read<T>(
    path: &Path,
    wanted: WantedFile,
    parse: impl Fn(&str, &str) -> Result<T, ConfigError>,
) -> Result<ReadFile<T>, CliError> {
    let name = escape(&path.to_string_lossy());
    let text = config::text_of_kind(path, wanted)?;
    Ok(ReadFile {
        value: parse(&name, &text)?,
        provenance: Provenance::of_text(&file_name(path), &text),
        name,
    })
}

/// A robot file, or one that comes with the tool.
pub fn robot(path: &Path) -> Result<ReadFile<RobotFile>, CliError> {
    read(path, WantedFile::Robot, |name, text| {
        RobotFile::parse_in(name, text, path.parent())
    })
}

/// A model file; what is reported of it becomes a warning of the command.
pub fn model(path: &Path, context: &Context) -> Result<ReadFile<GivenModel>, CliError> {
    let other = config::text_of_kind(path, WantedFile::Own)?;
    if let Some(error) = file_of_other(&escape(&path.to_string_lossy()), &other) {
        return Err(error);
    }
    let model = read(path, WantedFile::Own, |name, text| {
        let file = ModelFile::parse_in(name, text, path.parent())?;
        // the name for messages may be cut
        Ok(GivenModel {
            file_name: file_name(path),
            ..GivenModel::new(name, file)
        })
    })?;
    let notes = model.value.file.robot.notes.0.iter();
    notes.for_each(|shown| context.warn(shown));
    Ok(model)
}

/// What a model file is not: one of `drive` or `tool`, which other options take.
fn file_of_other(name: &str, text: &str) -> Option<CliError> {
    let (command, taken) = match text {
        text if ToolFile::is_one(text) => ("tool", "`export -m TOOL.toml --controller ur`, or --c"),
        text if DriveFile::is_one(text) => (
            "drive",
            "`export -m DRIVE.toml --mjcf-actuators`, --bam or --isaaclab",
        ),
        _ => return None,
    };
    let what = format!("{name}: is a file of `cft-ident {command}`, and no model of a robot");
    Some(CliError::input(what).hint(format!("it is taken by {taken}")))
}

/// Writes a model file, which is read back first: what the next command would refuse is not written.
pub(super) fn write_model(
    path: &Path,
    model: &ModelFile,
    context: &Context,
) -> Result<(), CliError> {
    let text = model.to_toml()?;
    let name = escape(&path.to_string_lossy());
    let again = ModelFile::parse_in(&name, &text, path.parent());
    let wrong: Option<IdentifyError> = match again {
        Ok(file) => refined_or_friction(&file, &name).err(),
        Err(error) => Some(error.into()),
    };
    match wrong {
        None => context.write_text(path, &text),
        Some(error) => {
            let what =
                format!("the model that came out cannot be used, and is not written: {error}");
            Err(CliError::new(Exit::Undetermined, what)
                .hint("log a motion that determines what is wrong with it"))
        }
    }
}

/// The text of a model file as it stands.
pub(crate) fn text(path: &Path) -> Result<String, CliError> {
    Ok(config::text_of_kind(path, WantedFile::Own)?)
}

/// A model file of the robot given.
pub(crate) fn model_of(
    path: &Path,
    robot: &RobotFile,
    context: &Context,
) -> Result<ReadFile<GivenModel>, CliError> {
    let model = model(path, context)?;
    model.value.file.belongs_to(&model.name, robot)?;
    Ok(model)
}

/// The model with the friction that a fit of the inertias takes as known; refused where the robot needs one.
pub(super) fn friction(
    command: &str,
    path: Option<&Path>,
    robot: &RobotFile,
    context: &Context,
) -> Result<Option<ReadFile<GivenModel>>, CliError> {
    if path.is_none() && robot.needs_friction_first() {
        let what = format!("{command} needs the friction of every joint");
        return Err(CliError::usage(what)
            .hint("identify it first with `cft-ident friction`, and give its model with -m")
            .hint("or set `fitted_with_inertias = true` in [friction] of the robot file"));
    }
    let given = path
        .map(|path| model_of(path, robot, context))
        .transpose()?;
    let without = |given: &ReadFile<GivenModel>| {
        let (name, file) = (given.name.as_str(), &given.value.file);
        let mut joints = robot.joint_names().into_iter();
        joints.find(|joint| file.double_tanh(name, joint).is_err())
    };
    let fitted = given.as_ref().filter(|_| !robot.needs_friction_first());
    if let Some((given, joint)) = fitted.and_then(|given| Some((given, without(given)?))) {
        let what = format!(
            "{}: holds no friction of {} as `friction` writes it",
            given.name,
            escape(&joint)
        );
        return Err(CliError::usage(what)
            .hint("leave -m out: the robot file has friction fitted together with the inertias"));
    }
    Ok(given)
}

/// A file of effects of the user's own.
pub fn candidates(path: &Path) -> Result<ReadFile<Vec<CandidateSection>>, CliError> {
    read(path, WantedFile::Own, candidates::parse)
}

/// A trajectory file, or one that comes with the tool.
pub fn trajectory(path: &Path) -> Result<ReadFile<Trajectory>, CliError> {
    read(path, WantedFile::Trajectory, Trajectory::parse)
}
