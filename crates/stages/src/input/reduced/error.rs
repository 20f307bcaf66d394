//! What can be wrong with reduced logs, and the way out.

use cft_ident_core::explain::Explain;
use thiserror::Error;

/// Why reduced logs cannot be used. Texts read `what is wrong; what to do`.
#[derive(Debug, Clone, PartialEq, Eq, Explain, Error)]
pub enum ReducedError {
    #[explain("{file}: is no file of reduced logs", "`cft-ident reduce` writes one")]
    NotReduced { file: String },
    #[explain(
        "{file}: has format {found} of reduced logs, and this version reads {known}",
        "reduce the logs again with this version"
    )]
    Format {
        file: String,
        found: u32,
        known: u32,
    },
    #[explain(
        "{file}: is cut off: {found} of {wanted} bytes are there",
        "copy it again, or reduce the log again"
    )]
    CutOff {
        file: String,
        found: u64,
        wanted: u64,
    },
    #[explain(
        "{file}: is damaged: its checksum is not that of what it holds",
        "copy it again, or reduce the log again"
    )]
    Damaged { file: String },
    #[explain("{file}: {problem}", "reduce the log again with this version")]
    Content { file: String, problem: String },
    /// Made with another robot, setting, version or friction.
    #[explain(
        "the reduced log {log} {difference}",
        "reduce it again with the robot file, the friction model and the version of this fit"
    )]
    Other { log: String, difference: String },
    #[explain(
        "the reduced log {first} is given twice (also as {second}): its rows would count twice",
        "give each log once"
    )]
    Twice { first: String, second: String },
    #[explain("no reduced log is given")]
    Empty,
    #[explain("the reduced log {log} does not hold {what}", remedy)]
    NeedsLog {
        log: String,
        what: String,
        remedy: &'static str,
    },
}
