//! The exit status of a run: the one place where it becomes a number.

/// How a run ended, as scripts see it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exit {
    /// The result is written; weak parameters or a partial log are warnings in it.
    Success = 0,
    /// The result is written, and a limit that the user set is missed.
    LimitMissed = 1,
    /// The command line cannot be understood.
    Usage = 2,
    /// An input cannot be used.
    BadInput = 3,
    /// The data determine nothing that was asked; nothing is written.
    Undetermined = 4,
    /// An output cannot be written.
    OutputFailed = 5,
    /// Ctrl-C or a request to terminate came before the end; nothing half-done is left. The shell's own 128 + SIGINT.
    Interrupted = 130,
}

impl Exit {
    /// The number that the shell sees.
    pub fn code(self) -> u8 {
        self as u8
    }
}
