//! What ends a command early, decorated for the terminal: the message of a room, the place in the
//! file, and the way out.
//!
//! Rooms have an error enum each; here they become a [`CliError`] through `From`, which chooses the
//! exit status and moves place and remedy to lines of their own.

use std::error::Error;
use std::fmt;
use std::io::{IsTerminal, Write};

use super::exit::Exit;
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
    message: String,
    places: Vec<String>,
    hints: Vec<String>,
}

impl CliError {
    /// Texts read `what is wrong; what to do; what else helps`: all but the first part become hints.
    fn new(exit: Exit, text: impl fmt::Display) -> Self {
        let mut parts = parts(&text.to_string()).into_iter();
        CliError {
            exit,
            message: parts.next().unwrap_or_default(),
            places: Vec::new(),
            hints: parts.collect(),
        }
    }

    /// The arguments contradict each other in a way that the parser cannot see (exit 2).
    pub fn usage(message: impl fmt::Display) -> Self {
        Self::new(Exit::Usage, message)
    }

    /// A file or value that was given cannot be used (exit 3).
    pub fn input(message: impl fmt::Display) -> Self {
        Self::new(Exit::BadInput, message)
    }

    /// The data determine nothing that was asked (exit 4).
    pub fn undetermined(message: impl fmt::Display) -> Self {
        Self::new(Exit::Undetermined, message)
    }

    /// A result cannot be written (exit 5).
    pub fn output(message: impl fmt::Display) -> Self {
        Self::new(Exit::OutputFailed, message)
    }

    /// The run was asked to stop (exit 130).
    pub fn interrupted() -> Self {
        Self::new(Exit::Interrupted, "interrupted: no half file is left")
    }

    /// The error of a room, with those that it stems from.
    pub(crate) fn from_room(exit: Exit, error: &(dyn Error + 'static)) -> Self {
        Self::new(exit, with_sources(error))
    }

    /// Adds a place: `file:line`, or the name of a setting.
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.places.push(place.to_string());
        self
    }

    /// Adds a way out.
    pub fn hint(mut self, hint: impl fmt::Display) -> Self {
        self.hints.push(hint.to_string());
        self
    }

    /// What is wrong, without place and way out.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// The status that this error ends the process with.
    pub fn exit(&self) -> Exit {
        self.exit
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error: {}", indented(&self.message))?;
        for place in &self.places {
            write!(f, "\n  --> {}", indented(place))?;
        }
        for hint in &self.hints {
            write!(f, "\nhint: {}", indented(hint))?;
        }
        Ok(())
    }
}

impl Error for CliError {}

impl From<LogError> for CliError {
    fn from(error: LogError) -> Self {
        Self::from_room(Exit::BadInput, &error)
    }
}

impl From<ConfigError> for CliError {
    fn from(error: ConfigError) -> Self {
        Self::from_room(Exit::BadInput, &error)
    }
}

impl From<MappingError> for CliError {
    fn from(error: MappingError) -> Self {
        match error {
            MappingError::Interrupted => Self::interrupted(),
            error => Self::from_room(Exit::BadInput, &error),
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
        let told = Self::from_room(exit, error);
        match error.remedy() {
            Some(remedy) => told.hint(remedy),
            None => told,
        }
    }
}

impl From<OutputError> for CliError {
    fn from(error: OutputError) -> Self {
        Self::from_room(Exit::OutputFailed, &error)
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
        Self::from_room(exit, &error)
    }
}

impl From<JsonError> for CliError {
    fn from(error: JsonError) -> Self {
        Self::from_room(Exit::OutputFailed, &error)
    }
}

/// The message of an error with those of its sources, `outer: inner`, each once.
pub fn with_sources(error: &(dyn Error + 'static)) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(inner) = source {
        let message = inner.to_string();
        if !text.contains(&message) {
            text.push_str(": ");
            text.push_str(&message);
        }
        source = inner.source();
    }
    text
}

/// Says something on standard error. A terminal gets lines that fit it; a file or a pipe gets one
/// line for each message, as a script looks for it.
pub(super) fn tell(stderr: &mut dyn Write, text: &str) {
    // A closed standard error is no reason to lose a result.
    let _ = match std::io::stderr().is_terminal() {
        true => write!(stderr, "{}", folded(text)),
        false => writeln!(stderr, "{text}"),
    };
}

/// The parts of a message between `; `, but for those inside of quotes: names and lines of files stand there.
fn parts(text: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        // a quote that nothing closes is a sign like others
        let closed = matches!(c, '"' | '`').then(|| rest[1..].find(c)).flatten();
        let length = match closed {
            Some(at) => at + 2,
            None if rest.starts_with("; ") => {
                parts.push(String::new());
                rest = &rest[2..];
                continue;
            }
            None => c.len_utf8(),
        };
        if let Some(part) = parts.last_mut() {
            part.push_str(&rest[..length]);
        }
        rest = &rest[length..];
    }
    parts
}

/// Later lines of a message are indented, and control characters that a file's text may carry into
/// it (escape sequences, say) are shown instead of being sent to the terminal.
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
    fn a_name_that_holds_a_semicolon_stays_whole() {
        let error = CliError::input("\"my; log.csv\": cannot be read; check the path");
        assert_eq!(
            error.to_string(),
            "error: \"my; log.csv\": cannot be read\nhint: check the path"
        );
    }

    #[test]
    fn an_error_shows_message_place_and_hint_in_that_order() {
        let error = CliError::input("time runs backwards: 0.013 s after 0.014 s")
            .at("q4.csv:15")
            .hint("sort the log by t");
        assert_eq!(
            error.to_string(),
            "error: time runs backwards: 0.013 s after 0.014 s\n  --> q4.csv:15\nhint: sort the log by t"
        );
        assert_eq!(error.exit(), Exit::BadInput);
    }

    #[test]
    fn control_characters_from_a_file_do_not_reach_the_terminal() {
        let error = CliError::input("column \"\u{1b}[31mq1\" is unknown\nin the header");
        assert_eq!(
            error.to_string(),
            "error: column \"\\u{1b}[31mq1\" is unknown\n  in the header"
        );
    }

    #[test]
    fn the_remedy_of_a_room_stands_on_a_line_of_its_own() {
        let error = ConfigError::UnknownKey {
            file: "cft.toml".into(),
            line: 12,
            key: "setpu".into(),
            remedy: "did you mean `setup`?".into(),
        };
        let error = CliError::from(error);
        assert_eq!(error.exit(), Exit::BadInput);
        assert_eq!(
            error.to_string(),
            "error: cft.toml:12: unknown key `setpu`\nhint: did you mean `setup`?"
        );
    }

    #[test]
    fn sources_are_told_once() {
        #[derive(Debug, thiserror::Error)]
        #[error("cannot read a.csv")]
        struct Outer(#[source] std::fmt::Error);
        let text = with_sources(&Outer(std::fmt::Error));
        assert_eq!(text, format!("cannot read a.csv: {}", std::fmt::Error));
    }
}
