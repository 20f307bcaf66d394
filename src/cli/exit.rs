//! The exit status of a run: the one place where it becomes a number.

use std::process::ExitCode;

/// How a run ended, as scripts see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// The result is written; weak parameters or a partial log are warnings in it.
    Success,
    /// The result is written, and a limit that the user set is missed.
    LimitMissed,
    /// The command line cannot be understood.
    Usage,
    /// An input cannot be used.
    BadInput,
    /// The data determine nothing that was asked; nothing is written.
    Undetermined,
    /// An output cannot be written.
    OutputFailed,
    /// Ctrl-C or a request to terminate came before the end; nothing half-done is left.
    Interrupted,
}

impl Exit {
    /// The number that the shell sees (130 is the shell's own 128 + SIGINT).
    pub fn code(self) -> u8 {
        match self {
            Exit::Success => 0,
            Exit::LimitMissed => 1,
            Exit::Usage => 2,
            Exit::BadInput => 3,
            Exit::Undetermined => 4,
            Exit::OutputFailed => 5,
            Exit::Interrupted => 130,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        ExitCode::from(exit.code())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_contract() {
        let ends = [
            Exit::Success,
            Exit::LimitMissed,
            Exit::Usage,
            Exit::BadInput,
            Exit::Undetermined,
            Exit::OutputFailed,
            Exit::Interrupted,
        ];
        assert_eq!(ends.map(Exit::code), [0, 1, 2, 3, 4, 5, 130]);
    }
}
