//! The only readers of recordings: from a file to blocks of t, q, tau in SI units.
//!
//! A [`LogSpec`] says which part of which file, a [`Layout`] which columns are which channels;
//! a [`Reader`] hands out [`Block`]s of at most [`Block::ROWS`] rows, so that memory does not grow
//! with the log. What comes out is finite, in strictly increasing time, and in SI.

mod block;
mod columns;
mod csv;
mod error;
mod head;
mod layout;
mod names;
mod number;
mod reader;
mod source;
mod spec;

pub use block::Block;
pub use error::LogError;
pub use layout::{Channel, Channels, Conversion, Delimiter, Layout};
pub use names::{escape, escape_whole, nearest};
pub use reader::Reader;
pub use source::{Provenance, sha256};
pub use spec::{LogSpec, Span};

pub(crate) use names::list;
pub(crate) use source::{remedy, shown};
