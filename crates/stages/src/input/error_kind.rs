//! What errors of stages are about, whichever they are.

/// What an error is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// FilterSettings that contradict each other or the robot.
    Usage,
    /// A log, robot or model that cannot be used.
    Input,
    /// The data determine nothing that was asked.
    Undetermined,
    /// The stage was asked to stop.
    Interrupted,
}
