//! What keeps a log from being described.

use cft_ident_core::explain::Explain;
use thiserror::Error;

use crate::log::LogError;

/// Why a log says too little to be described.
#[derive(Debug, Explain, Error)]
pub enum MappingError {
    /// A log that cannot be read.
    #[explain(_0.explanation())]
    Log(#[from] LogError),
    /// No column is a time.
    #[explain(
        "{log}: no column is a time: {columns}",
        "give the rate at which it was recorded: `cft-ident new NAME --log LOG --rate HZ` writes a robot file with it, which other commands take with -r",
        "or add a column of times"
    )]
    NoTime {
        /// Name of the log.
        log: String,
        columns: String,
    },
    /// Several machines in one recording.
    #[explain(
        "{log}: holds several machines: {topics}",
        "name the topic of the one that was measured: --topic NAME"
    )]
    Topics {
        /// Name of the log.
        log: String,
        /// Their topics, those that are likeliest first.
        topics: String,
    },
    /// The user stopped it.
    #[explain("interrupted")]
    Interrupted,
}
