//! What ends a command early, decorated for the terminal: what is wrong, the place in the file, and the ways out.
//!
//! Errors of the crates become a [`CliError`] through `From`, which chooses the exit status.

use std::error::Error;
use std::fmt;
use std::io::{IsTerminal, Write};

use super::exit::Exit;
use super::{colour, window};
use cft_ident_core::explain::{ErrorText, Explain};
use cft_ident_drive::drive::error::DriveError;
use cft_ident_files::config::ConfigError;
use cft_ident_logs::log::{LogError, is_hidden};
use cft_ident_logs::mapping::MappingError;
use cft_ident_logs::output::OutputError;
use cft_ident_plant::simulate::SimulateError;
use cft_ident_report::report::json::JsonError;
use cft_ident_report::report::table::folded;
use cft_ident_stages::identify::{ErrorKind, IdentifyError};

/// An error ready to be shown: `error: ...`, then the places, then `hint: ...`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CliError {
    exit: Exit,
    problem: ErrorText,
}

impl CliError {
    /// Any error by its exit status.
    pub(super) fn new(exit: Exit, problem: impl Into<ErrorText>) -> Self {
        let problem = problem.into();
        Self { exit, problem }
    }

    /// The arguments contradict each other in a way that the parser cannot see (exit 2).
    pub fn usage(problem: impl Into<ErrorText>) -> Self {
        Self::new(Exit::Usage, problem)
    }

    /// A file or value that was given cannot be used (exit 3).
    pub fn input(problem: impl Into<ErrorText>) -> Self {
        Self::new(Exit::BadInput, problem)
    }

    /// A result cannot be written (exit 5).
    pub fn output(problem: impl Into<ErrorText>) -> Self {
        Self::new(Exit::OutputFailed, problem)
    }

    /// The run was asked to stop (exit 130).
    pub fn interrupted() -> Self {
        Self::new(Exit::Interrupted, "interrupted: no half file is left")
    }

    /// Adds a place: `file:line`, or the name of a setting.
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.problem.places.push(place.to_string());
        self
    }

    /// Adds a way out.
    pub fn hint(mut self, hint: impl fmt::Display) -> Self {
        self.problem = self.problem.remedy(hint);
        self
    }

    /// What is wrong, without place and way out.
    pub fn message(&self) -> &str {
        &self.problem.what
    }

    /// The status that this error ends the process with.
    pub fn exit(&self) -> Exit {
        self.exit
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error: {}", indented(&self.problem.what))?;
        for place in &self.problem.places {
            write!(f, "\n  --> {}", indented(place))?;
        }
        for hint in &self.problem.remedies {
            write!(f, "\nhint: {}", indented(hint))?;
        }
        Ok(())
    }
}

impl Error for CliError {}

impl From<LogError> for CliError {
    fn from(error: LogError) -> Self {
        match error {
            LogError::Interrupted => Self::interrupted(),
            error => Self::new(Exit::BadInput, error),
        }
    }
}

impl From<ConfigError> for CliError {
    fn from(error: ConfigError) -> Self {
        Self::new(Exit::BadInput, error)
    }
}

impl From<DriveError> for CliError {
    fn from(error: DriveError) -> Self {
        let exit = match error {
            DriveError::Undetermined { .. } => Exit::Undetermined,
            _ => Exit::BadInput,
        };
        Self::new(exit, error)
    }
}

impl From<MappingError> for CliError {
    fn from(error: MappingError) -> Self {
        match error {
            MappingError::Interrupted => Self::interrupted(),
            error => Self::new(Exit::BadInput, error),
        }
    }
}

impl From<IdentifyError> for CliError {
    fn from(error: IdentifyError) -> Self {
        Self::from(&error)
    }
}

impl From<&IdentifyError> for CliError {
    fn from(error: &IdentifyError) -> Self {
        let exit = match error.kind() {
            ErrorKind::Usage => Exit::Usage,
            ErrorKind::Input => Exit::BadInput,
            ErrorKind::Undetermined => Exit::Undetermined,
            ErrorKind::Interrupted => return Self::interrupted(),
        };
        Self::new(exit, error.explanation())
    }
}

impl From<OutputError> for CliError {
    fn from(error: OutputError) -> Self {
        Self::new(Exit::OutputFailed, error)
    }
}

impl From<SimulateError> for CliError {
    fn from(error: SimulateError) -> Self {
        let exit = match error {
            // These come from --effect and --move alone.
            SimulateError::EffectSyntax { .. }
            | SimulateError::UnknownEffect { .. }
            | SimulateError::UnknownKey { .. }
            | SimulateError::MissingKey { .. }
            | SimulateError::UnknownJoint { .. }
            | SimulateError::EffectPlace { .. }
            | SimulateError::EffectNumber { .. } => Exit::Usage,
            _ => Exit::BadInput,
        };
        Self::new(exit, error)
    }
}

impl From<JsonError> for CliError {
    fn from(error: JsonError) -> Self {
        Self::output(error.to_string())
    }
}

/// A line on standard error, folded for a terminal; a file or a pipe gets one line for each message.
pub(super) fn to_stderr(stderr: &mut dyn Write, text: &str) {
    // A closed standard error is no reason to lose a result.
    let _ = match std::io::stderr().is_terminal() {
        true => {
            let width = window::columns(window::Stream::Error);
            write!(stderr, "{}", colour::message(&folded(text, width)))
        }
        false => writeln!(stderr, "{text}"),
    };
}

/// Later lines are indented, and control characters that a file's text may carry are shown.
pub(super) fn indented(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.trim_end().chars() {
        match c {
            '\n' => shown.push_str("\n  "),
            '\t' => shown.push(' '),
            c if is_hidden(c) => shown.extend(c.escape_default()),
            c => shown.push(c),
        }
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_shows_message_places_and_hints_each_on_a_line_of_its_own() {
        let name = LogError::Empty {
            file: "my; log.csv".to_owned(),
        };
        let room = ConfigError::UnknownKey {
            file: "cft.toml".into(),
            line: 12,
            key: "setpu".into(),
            remedy: "did you mean `setup`?".into(),
        };
        let time = CliError::input("time runs backwards: 0.013 s after 0.014 s");
        for (case, error, expected) in [
            (
                "a semicolon in a name",
                CliError::from(name),
                "error: my; log.csv: is empty\nhint: record again, or check that the recorder closed the file",
            ),
            (
                "message, place and hint",
                time.at("q4.csv:15").hint("sort the log by t"),
                "error: time runs backwards: 0.013 s after 0.014 s\n  --> q4.csv:15\nhint: sort the log by t",
            ),
            (
                "control characters of a file",
                CliError::input("column \"\u{1b}[31mq1\" is unknown\nin the header"),
                "error: column \"\\u{1b}[31mq1\" is unknown\n  in the header",
            ),
            (
                "the remedy of a room",
                CliError::from(room),
                "error: cft.toml:12: unknown key `setpu`\nhint: did you mean `setup`?",
            ),
        ] {
            assert_eq!(error.to_string(), expected, "{case}");
            assert_eq!(error.exit(), Exit::BadInput, "{case}");
        }
    }
}
