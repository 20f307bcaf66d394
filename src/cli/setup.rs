//! The check of the set-up before a fit, and what becomes of it: a refusal, a new robot file, or a word.

use std::path::{Path, PathBuf};

use super::{CliError, Context, Outcome, files, written};
use cft_ident_files::config::correction::{KeyEdit, edited};
use cft_ident_files::config::{self, ModelFile, RobotFile};
use cft_ident_report::report::Report;
use cft_ident_report::report::json::JsonDocument;
use cft_ident_stages::identify::{
    AcceptedSetup, ContradictedSetup, Dataset, SetupRefusal, accepted_setup,
    check_setup_where_possible,
};
use cft_ident_stages::setup::{Finding, FindingSeverity, SetupReport};

/// What to do with a set-up that the torques contradict.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct SetupArgs {
    /// Where the torques contradict the set-up, write a robot file that is right by them and go on with it
    #[arg(long, value_name = "NEW-ROBOT.toml")]
    pub fix_setup: Option<PathBuf>,
    /// Go on with the set-up as it is declared, whatever the torques say
    #[arg(hide_short_help = true, long, conflicts_with = "fix_setup")]
    pub as_declared: bool,
}

/// A set-up that was checked, and the robot file that comes of it.
pub struct CheckedDataset {
    pub setup: AcceptedSetup,
    /// The new robot file, where one is to be written.
    pub new_file: Option<(PathBuf, String)>,
}

impl CheckedDataset {
    /// Writes the model that a command made of the logs, and the new robot file, and hands over its result.
    pub fn finish(
        &self,
        mut report: Report,
        document: JsonDocument,
        (path, model): (&Path, &ModelFile),
        context: &Context,
    ) -> Result<Outcome, CliError> {
        context.check()?;
        self.write(context)?;
        files::write_model(path, model, context)?;
        written(&mut report, path);
        Ok(Outcome::new(report.text_for(context.screen), document))
    }

    /// Writes the new robot file, where there is one, and says so.
    pub fn write(&self, context: &Context) -> Result<(), CliError> {
        if let Some((path, text)) = &self.new_file {
            context.write_text(path, text)?;
            context.note(&format!("written: {}", path.display()));
        }
        Ok(())
    }
}

/// Checks the set-up by the logs; `before` is what the machine has that its file `robot` lacks.
pub fn checked(
    data: Dataset,
    (robot, before): (&Path, &[KeyEdit]),
    args: &SetupArgs,
    context: &Context,
) -> Result<CheckedDataset, CliError> {
    let data = match args.as_declared {
        true => Dataset {
            setup: data.setup.as_declared(),
            ..data
        },
        false => data,
    };
    data.setup.check_gains()?;
    let setup = match accepted_setup(data, &context.control) {
        Ok(setup) => setup,
        Err(SetupRefusal::Interrupted) => return Err(CliError::interrupted()),
        Err(SetupRefusal::Contradicted(found)) => {
            return put_right(*found, (robot, before), args, context);
        }
    };
    tell_hints(&setup.report, context);
    let path = args.fix_setup.as_ref().filter(|_| !before.is_empty());
    let new_file = path.map(|path| {
        let text = new_text(robot, before, &setup.data.setup.file, path)?;
        Ok::<_, CliError>((path.clone(), text))
    });
    let new_file = new_file.transpose()?;
    Ok(CheckedDataset { setup, new_file })
}

/// A set-up that the torques contradict, put right where that is asked for.
fn put_right(
    found: ContradictedSetup,
    (robot, before): (&Path, &[KeyEdit]),
    args: &SetupArgs,
    context: &Context,
) -> Result<CheckedDataset, CliError> {
    tell_hints(&found.report, context);
    let (Some(path), Some(corrected)) = (&args.fix_setup, &found.corrected) else {
        let refusals: Vec<&Finding> = found.report.refusals().collect();
        return Err(refused(robot, &refusals));
    };
    let edits = [before, &found.edits].concat();
    let text = new_text(robot, &edits, corrected, path)?;
    let corrected = corrected.clone();
    Ok(CheckedDataset {
        setup: found.put_right(&path.to_string_lossy(), corrected, &context.control)?,
        new_file: Some((path.clone(), text)),
    })
}

/// Tells what is no fault.
fn tell_hints(report: &SetupReport, context: &Context) {
    let hint = |f: &&Finding| f.severity == FindingSeverity::Hint;
    for hint in report.findings.iter().filter(hint) {
        context.note(&format!("hint: {}", hint.in_words()));
    }
}

/// What the check says of these logs, for a command that only reports it.
pub fn report(data: &Dataset, context: &Context) -> Result<SetupReport, CliError> {
    Ok(check_setup_where_possible(data, &context.control)?.report)
}

/// Text of the new robot file: the user's with the lines that differ, else the whole anew.
fn new_text(
    robot: &Path,
    edits: &[KeyEdit],
    corrected: &RobotFile,
    path: &Path,
) -> Result<String, CliError> {
    // one that was drafted is no file yet
    let text = config::text_of_kind(robot, config::WantedFile::Robot);
    let name = path.to_string_lossy();
    // a URDF is named beside the file
    let folder = path.parent();
    if let Ok(text) = text
        && let Some(text) = edited(&text, edits)
        && let Ok(read) = RobotFile::parse_in(&name, &text, folder)
        && read == *corrected
    {
        return Ok(text);
    }
    toml::to_string(corrected)
        .map_err(|error| CliError::output(format!("{}: {error}", path.display())))
}

/// The error with which a fit refuses the logs.
fn refused(robot: &Path, refusals: &[&Finding]) -> CliError {
    let first = refusals.first().map_or("", |f| &f.meaning);
    let text = format!("the torques contradict the robot file: {first}");
    let mut error = CliError::input(text).at(robot.display());
    for finding in refusals {
        error = error.hint(format!("write {}", finding.remedy));
    }
    if let Some(decided) = refusals.first().and_then(|finding| finding.decided()) {
        error = error.hint(format!("decided by: {decided}"));
    }
    for tie in refusals.iter().flat_map(|f| &f.tied_with).take(2) {
        if !tie.remedy.is_empty() {
            error = error.hint(format!("these data say as well: write {}", tie.remedy));
        }
    }
    error
        .hint("--fix-setup NEW-ROBOT.toml writes that for you and goes on")
        .hint("--as-declared goes on with the set-up as it is")
}
