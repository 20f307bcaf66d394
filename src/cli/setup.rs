//! The check of the set-up before a fit, and what becomes of it: a refusal, a new robot file, or a word.

use std::path::{Path, PathBuf};

use super::{CliError, Context};
use cft_ident_files::config::correction::{KeyEdit, edited};
use cft_ident_files::config::{self, RobotFile};
use cft_ident_stages::identify::{CheckedSetup, Dataset, IdentifyError, LoggedRobot, check_setup};
use cft_ident_stages::setup::{
    Finding, FindingSeverity, FoundTorqueLimit, FrictionPower, SetupReport,
};

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

/// Logs whose set-up was checked, with what was found.
pub struct CheckedDataset {
    /// The robot to go on with, and the logs.
    pub data: Dataset,
    pub report: SetupReport,
    pub warnings: Vec<String>,
    /// The new robot file, where one is to be written.
    pub new_file: Option<(PathBuf, String)>,
}

impl CheckedDataset {
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
            machine: data.machine.as_declared(),
            ..data
        },
        false => data,
    };
    let machine = &data.machine;
    machine.check_gains()?;
    let CheckedSetup {
        report,
        corrected,
        edits,
        limited,
    } = check(&data, context)?;
    let of = |severity| (report.findings.iter()).filter(move |f| f.severity == severity);
    let likely = |f: &Finding| {
        format!(
            "the set-up may be wrong: {}; the set-up as declared is possible too, and the fit goes on with it",
            f.in_words()
        )
    };
    let mut warnings: Vec<String> = of(FindingSeverity::Warning).map(likely).collect();
    of(FindingSeverity::Hint).for_each(|f| context.note(&format!("hint: {}", f.in_words())));
    warnings.extend(report.friction_power.iter().map(FrictionPower::sentence));
    warnings.extend(report.torque_limits.iter().map(FoundTorqueLimit::sentence));
    let refusals: Vec<&Finding> = report.refusals().collect();
    if refusals.is_empty() {
        let path = args.fix_setup.as_ref().filter(|_| !before.is_empty());
        let new_file = path.map(|path| {
            let text = new_text(robot, before, &machine.file, path)?;
            Ok::<_, CliError>((path.clone(), text))
        });
        let new_file = new_file.transpose()?;
        let data = match limited {
            Some(machine) => Dataset { machine, ..data },
            None => data,
        };
        return Ok(CheckedDataset {
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
    let right = |f: &&Finding| format!("put right in {}: {}", path.display(), f.in_words());
    warnings.extend(refusals.iter().map(right));
    let machine = LoggedRobot::new(&path.to_string_lossy(), corrected);
    Ok(CheckedDataset {
        data: Dataset { machine, ..data },
        report,
        warnings,
        new_file: Some((path.clone(), text)),
    })
}

/// The check; logs that cannot be checked are reported by the fit itself.
fn check(data: &Dataset, context: &Context) -> Result<CheckedSetup, CliError> {
    match check_setup(data, &context.control) {
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
