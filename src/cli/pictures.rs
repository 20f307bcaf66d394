//! What the page of a command needs besides its result: the logs in memory, and what is wrong with them.

use super::{CliError, Context, Exit, inspect};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_files::config::ModelFile;
use cft_ident_logs::log::LogSpec;
use cft_ident_report::report::sections::quality::InspectedLog;
use cft_ident_stages::identify::{self, IdentifyError, InMemory, LogData, RobotSetup};
use cft_ident_stages::replay::{LogReplay, ReplayedLogs};

/// Reads logs whole for the pictures of a report; none where they are too long for that.
pub(super) fn in_memory(
    setup: &RobotSetup,
    logs: &[LogData],
    context: &Context,
) -> Result<Option<InMemory>, CliError> {
    match identify::read_whole(setup, logs, &context.control) {
        Ok(in_memory) => Ok(Some(in_memory)),
        Err(IdentifyError::TooManySamples { .. }) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// These logs with the processing of their robot file.
pub(super) fn replay<'a>(
    setup: &'a RobotSetup,
    in_memory: Option<&'a InMemory>,
    names: &[String],
) -> Result<Option<LogReplay<'a>>, CliError> {
    let new = |in_memory| LogReplay::new(setup, in_memory, names.iter().cloned());
    in_memory.map(new).transpose().map_err(CliError::input)
}

/// A model and its file replayed along these logs, of which some were `used` for the model.
pub(super) fn replayed(
    setup: &RobotSetup,
    in_memory: Option<&InMemory>,
    names: &[String],
    (file, model): (&ModelFile, &AugmentedModel),
    used: &[bool],
) -> Result<Option<ReplayedLogs>, CliError> {
    let replay = replay(setup, in_memory, names)?;
    let replayed = replay.map(|replay| ReplayedLogs::new(&replay, file, model, used));
    replayed.transpose().map_err(CliError::input)
}

/// What is wrong with logs, by the robot file.
pub(super) fn inspected<'a>(
    logs: impl IntoIterator<Item = &'a LogSpec>,
    setup: &RobotSetup,
    context: &Context,
) -> Result<Vec<InspectedLog>, CliError> {
    let inspected = |spec: &LogSpec| {
        let found = match inspect::findings(spec, setup, context) {
            Err(error) if error.exit() == Exit::Interrupted => return Err(error),
            found => found.map_err(|error| error.message().to_owned()),
        };
        let name = spec.name();
        Ok(InspectedLog { name, found })
    };
    logs.into_iter().map(inspected).collect()
}
