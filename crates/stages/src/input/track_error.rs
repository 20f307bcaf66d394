//! Why logs cannot be followed over time, and the way out.

use cft_ident_core::explain::Explain;

/// Why logs cannot be followed. Texts read `what is wrong; what to do`.
#[derive(Debug, Clone, PartialEq, Eq, Explain, thiserror::Error)]
pub enum TrackError {
    #[explain(
        "{robot}: the clocks of {first} and {second} overlap, and a file of several reduced logs has no other order",
        "give a file for each log, in order of time"
    )]
    NoOrder {
        robot: String,
        first: String,
        second: String,
    },
    #[explain(
        "{robot}: {first} and {second} hold the same rows, under two names perhaps",
        "give each log once, and spans of one that do not meet"
    )]
    Twice {
        robot: String,
        first: String,
        second: String,
    },
    #[explain(
        "{robot}: {source_name} {difference}",
        "keep the files of each robot in a folder of its own, and reduce them alike"
    )]
    Other {
        robot: String,
        source_name: String,
        difference: String,
    },
    #[explain("no reduced log and no model is given")]
    Empty,
}
