//! A table of a log, its columns as they stand.

use cft_ident_logs::log::list;

/// A table as it was read.
#[derive(Debug, Clone, Default)]
pub(super) struct WrenchTable {
    /// The file, and of a recording the topic, for messages.
    pub file: String,
    pub names: Vec<String>,
    pub columns: Vec<Vec<f64>>,
    /// Times of the rows \[s\], where there is a clock.
    pub t: Option<Vec<f64>>,
    /// The instant from which they are counted \[s\].
    pub origin_s: f64,
}

impl WrenchTable {
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }

    /// The names of its columns, for a message.
    pub fn named(&self) -> String {
        list(self.names.iter().map(String::as_str))
    }
}
