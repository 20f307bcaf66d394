//! The formats of recordings. A new one is a file of its own and its lines here: its module, and its
//! place in the list.

mod bag;
mod mcap;
mod record;
mod ros1;

use std::path::Path;

use super::message::MessageFile;
use crate::log::LogError;
use crate::log::content::FileContent;

/// Opens a recording of a format for the messages of some topics.
type FormatOpener = fn(&Path, FileContent, &[String]) -> Result<Box<dyn MessageFile>, LogError>;

pub(in crate::log) struct Format {
    magic: &'static [u8],
    /// End of a file's name, compression aside.
    pub(in crate::log) ending: &'static str,
    pub(super) open: FormatOpener,
}

pub(in crate::log) const FORMATS: [Format; 3] = [
    Format {
        magic: b"\x89MCAP",
        ending: ".mcap",
        open: mcap::open,
    },
    Format {
        magic: b"SQLite format 3\0",
        ending: ".db3",
        open: bag::open,
    },
    Format {
        magic: ros1::MAGIC,
        ending: ".bag",
        open: ros1::open,
    },
];

/// The format of a file by its first bytes; `None` for a text log.
pub(in crate::log) fn format_of(head: &[u8]) -> Option<&'static Format> {
    FORMATS.iter().find(|format| head.starts_with(format.magic))
}
