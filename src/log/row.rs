//! Rows of a log one by one, whatever the format of its file.

use std::path::PathBuf;

use super::content::{Content, Kind};
use super::layout::Layout;
use super::recording::MessageRows;
use super::text::TextRows;
use super::time::Instant;
use super::{Block, LogError};

/// Time of a row, before it is counted from anywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Stamped {
    /// Seconds as the log counts them.
    Seconds(f64),
    /// An exact instant, counted from the first one where it is far from zero.
    Exact(Instant),
}

/// The rows of a log.
#[derive(Debug)]
pub(super) enum LogRows {
    Text(Box<TextRows>),
    Messages(Box<MessageRows>),
}

impl LogRows {
    /// Opens the files of one log; the layout that it turns out to have.
    pub(super) fn open(paths: &[PathBuf], layout: &Layout) -> Result<(Self, Layout), LogError> {
        if let [path] = paths {
            let content = Content::open(path)?;
            if content.kind == Kind::Text {
                let (rows, layout) = TextRows::open(path, content, layout)?;
                return Ok((Self::Text(Box::new(rows)), layout));
            }
        }
        let (rows, layout) = MessageRows::open(paths, layout)?;
        Ok((Self::Messages(Box::new(rows)), layout))
    }

    /// Goes on to the next row; its time, or `None` at the end.
    #[inline]
    pub(super) fn next(&mut self) -> Result<Option<Stamped>, LogError> {
        match self {
            Self::Text(rows) => rows.next(),
            Self::Messages(rows) => rows.next(),
        }
    }

    /// Appends positions, torques and velocities of the current row to the block.
    #[inline]
    pub(super) fn append(&self, block: &mut Block) -> Result<(), LogError> {
        match self {
            Self::Text(rows) => rows.append(block),
            Self::Messages(rows) => rows.append(block),
        }
    }

    pub(super) fn has_velocities(&self) -> bool {
        match self {
            Self::Text(rows) => rows.has_velocities(),
            Self::Messages(rows) => rows.has_velocities(),
        }
    }

    /// Whether the current row equals the one before it in all that the log holds of it.
    pub(super) fn repeats(&self) -> bool {
        match self {
            Self::Text(rows) => rows.repeats(),
            Self::Messages(rows) => rows.repeats(),
        }
    }

    /// Where the current row stands, for a message.
    #[cold]
    pub(super) fn place(&self) -> String {
        match self {
            Self::Text(rows) => rows.place(),
            Self::Messages(rows) => rows.place(),
        }
    }

    /// Line or message number of the current row, from 1.
    #[inline]
    pub(super) fn number(&self) -> u64 {
        match self {
            Self::Text(rows) => rows.number(),
            Self::Messages(rows) => rows.number(),
        }
    }

    /// What was left out or chosen on the way, once the last row is read.
    pub(super) fn warnings(&self) -> Vec<String> {
        match self {
            Self::Text(_) => Vec::new(),
            Self::Messages(rows) => rows.warnings(),
        }
    }
}
