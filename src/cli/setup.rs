//! The check of the set-up before a fit, and what becomes of it: a refusal, a new robot file, or a word.

use std::path::{Path, PathBuf};

use super::{CliError, Context};
use cft_ident_files::config::correction::{Edit, edited};
use cft_ident_files::config::{self, RobotFile};
use cft_ident_stages::identify::{CheckedSetup, Dataset, IdentifyError, LoggedRobot, check_setup};
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

/// A set-up that was checked.
pub struct Checked {
    /// The robot to go on with, and the logs.
    pub data: Dataset,
    /// What was found, for the document.
    pub report: SetupReport,
    pub warnings: Vec<String>,
    /// The new robot file, where one is to be written.
    pub new_file: Option<(PathBuf, String)>,
}

impl Checked {
    /// Writes the new robot file, where there is one, and says so.
    pub fn write(&self, context: &Context) -> Result<(), CliError> {
        if let Some((path, text)) = &self.new_file {
            context.write_text(path, text)?;
            context.note(&format!("written: {}", path.display()));
        }
        Ok(())
    }
}

/// Checks the set-up by the logs. `robot` is the path of the robot file, in which `before` is what the
/// machine has that the file lacks.
pub fn checked(
    data: Dataset,
    (robot, before): (&Path, &[Edit]),
    args: &SetupArgs,
    context: &Context,
) -> Result<Checked, CliError> {
    let data = match args.as_declared {
        true => Dataset::new(&data.machine.as_declared(), &data.logs),
        false => data,
    };
    let machine = &data.machine;
    machine.check_gains()?;
    let CheckedSetup {
        report,
        corrected,
        edits,
    } = check(&data, context)?;
    let mut warnings: Vec<String> = report
        .findings
        .iter()
        .filter(|f| f.severity == FindingSeverity::Warning)
        .map(likely)
        .collect();
    let hints = (report.findings.iter()).filter(|f| f.severity == FindingSeverity::Hint);
    hints.for_each(|hint| context.note(&format!("hint: {}", hint.in_words())));
    for power in &report.friction_power {
        warnings.push(power.sentence());
    }
    let refusals: Vec<&Finding> = report.refusals().collect();
    if refusals.is_empty() {
        let new_file = match args.fix_setup.as_ref().filter(|_| !before.is_empty()) {
            Some(path) => {
                let text = new_text(robot, before, &machine.file, path)?;
                Some((path.clone(), text))
            }
            None => None,
        };
        return Ok(Checked {
            data,
            report,
            warnings,
            new_file,
        });
    }
    let (Some(path), Some(corrected)) = (&args.fix_setup, corrected) else {
        return Err(refused(robot, &refusals));
    };
    let edits = [before, &edits].concat();
    let text = new_text(robot, &edits, &corrected, path)?;
    warnings.extend(
        refusals
            .iter()
            .map(|f| format!("put right in {}: {}", path.display(), f.in_words())),
    );
    Ok(Checked {
        data: Dataset::new(
            &LoggedRobot::new(&path.to_string_lossy(), corrected),
            &data.logs,
        ),
        report,
        warnings,
        new_file: Some((path.clone(), text)),
    })
}

/// The check; logs that cannot be checked are reported by the fit itself.
fn check(data: &Dataset, context: &Context) -> Result<CheckedSetup, CliError> {
    match check_setup(data, context.control()) {
        Err(IdentifyError::Interrupted) => Err(CliError::interrupted()),
        found => Ok(found.unwrap_or_default()),
    }
}

/// What the check says of these logs, for a command that only reports it.
pub fn report(data: &Dataset, context: &Context) -> Result<SetupReport, CliError> {
    Ok(check(data, context)?.report)
}

/// Text of the new robot file: the user's with the lines that differ, else the whole anew.
fn new_text(
    robot: &Path,
    edits: &[Edit],
    corrected: &RobotFile,
    path: &Path,
) -> Result<String, CliError> {
    // one that was drafted is no file yet
    let text = config::text_of_kind(robot, config::Wanted::Robot);
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

fn likely(finding: &Finding) -> String {
    format!(
        "the set-up may be wrong: {}; the set-up as declared is possible too, and the fit goes on with it",
        finding.in_words()
    )
}

/// The error with which a fit refuses the logs.
fn refused(robot: &Path, refusals: &[&Finding]) -> CliError {
    let first = refusals
        .first()
        .map(|f| f.meaning.as_str())
        .unwrap_or_default();
    let mut error = CliError::input(format!(
        "the torques contradict the robot file: {}",
        first.replace("; ", ", ")
    ))
    .at(robot.display());
    for finding in refusals {
        error = error.hint(format!("write {}", finding.remedy));
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
