//! What can be wrong with a log, and the way out.

use thiserror::Error;

/// An error in a log or in the way it was asked for.
#[derive(Debug, Error)]
pub enum LogError {
    /// A span that makes no sense.
    #[error(
        "`{spec}`: the span after @ cannot be used: {reason}; write FILE@0..70% or FILE@15.2..23s"
    )]
    Span {
        /// What was asked for.
        spec: String,
        /// Why not.
        reason: &'static str,
    },
}
