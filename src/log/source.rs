//! Which log was read: its name, the part of it, and its checksum.

use serde::{Deserialize, Serialize};

/// One input of a result: enough to know the data again, and nothing of the machine it was read on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// File name without folders.
    pub name: String,
    /// The part that was used, as written after `@`; absent (null in JSON) for the whole log.
    #[serde(default)]
    pub span: Option<String>,
    /// SHA-256 of the whole file, hexadecimal.
    pub sha256: String,
    /// Rows used; 0 for a file that is no log.
    #[serde(default)]
    pub samples: u64,
    /// Time from the first to the last row used [s].
    #[serde(default)]
    pub duration_s: f64,
}
