//! What recordings are made of: messages on topics, and what they are written in.

use std::collections::BTreeSet;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use super::value::Value;
use crate::log::{LogError, escape, source};

#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct Schema {
    /// Type, e.g. `sensor_msgs/msg/JointState`.
    pub(super) name: String,
    /// Language of the definition: `ros2msg`, `protobuf`, `jsonschema`, ...
    pub(super) language: String,
    pub(super) text: Vec<u8>,
    /// Encoding of the messages: `cdr`, `json`, `protobuf`, ...
    pub(super) encoding: String,
}

#[derive(Debug, Clone)]
pub(super) struct Topic {
    pub(super) name: String,
    pub(super) schema: Arc<Schema>,
}

/// Whether a topic is among those that are read; none are named where all are.
pub(super) fn is_wanted(topic: &str, names: &[String]) -> bool {
    names.is_empty() || names.iter().any(|name| name == topic)
}

#[derive(Debug, Clone, Copy)]
pub(super) struct MessageHead {
    /// Index of its topic in the file.
    pub(super) topic: usize,
    /// Channel of the file that it is on: one of each publisher, where the recorder keeps them apart.
    pub(super) channel: u16,
    pub(super) log_ns: u64,
    pub(super) publish_ns: u64,
    /// Which message of the file it is, from 1.
    pub(super) number: u64,
}

/// Where a recording breaks off, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct RecordingBreak {
    pub(super) reason: String,
    /// How much of it was read, as it stands after "breaks off".
    pub(super) place: String,
}

/// A file of messages, read from front to back: what each format does.
pub(super) trait MessageFile: Send {
    /// The topics declared so far.
    fn topics(&self) -> &[Topic];

    /// The next message of a wanted topic, its bytes in `data`; `None` at the end.
    fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<MessageHead>, LogError>;

    fn broken(&self) -> Option<&RecordingBreak>;
}

/// Reads the fields that it was made for out of the messages of one topic: what each encoding does.
pub(super) trait MessageReader: Send {
    fn read(&mut self, data: &[u8], out: &mut [Value]) -> Result<(), String>;

    /// Names that the message which was read last lists: those of its joints, or of its fields.
    fn names(&self, data: &[u8]) -> Vec<String>;

    /// Which names the message that was read last lists, and in which order, as a number.
    fn order(&self) -> u64 {
        0
    }

    /// An array of the message that was read last whose elements cannot be given to the names beside it.
    fn uneven(&self) -> Option<UnevenArray> {
        None
    }

    /// Every number that a message holds, with the path that leads to it.
    fn leaves(&self, data: &[u8]) -> Vec<FieldLeaf>;
}

/// An array that does not fit its list of names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct UnevenArray {
    pub(super) array: String,
    pub(super) numbers: usize,
    pub(super) names: usize,
}

impl fmt::Display for UnevenArray {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            array,
            numbers,
            names,
        } = self;
        write!(
            f,
            "`{}` holds {numbers} numbers for {names} names, so that none can be given to a joint",
            escape(array)
        )
    }
}

/// A number of a message by its path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct FieldLeaf {
    pub(super) path: String,
    /// The same with the names that lists of the message give to elements.
    pub(super) label: String,
}

/// Numbers of one message that are listed at most.
pub(super) const MOST_LEAVES: usize = 512;

/// Whether names can stand for the elements of an array beside them: one each, and no two alike.
pub(super) fn name_elements(names: &[String], elements: usize) -> bool {
    let apart = names.iter().collect::<BTreeSet<_>>().len() == names.len();
    !names.is_empty() && names.len() == elements && apart
}

/// The error of a recording whose messages cannot be used.
pub(super) fn refused(
    paths: &[PathBuf],
    problem: impl Into<String>,
    remedy: impl Into<String>,
) -> LogError {
    LogError::Topic {
        file: source::shown_all(paths),
        problem: problem.into(),
        remedy: remedy.into(),
    }
}

/// A reader of some fields, or why messages of their schema cannot be read, for the user.
pub(super) type OpenedReader = Result<Box<dyn MessageReader>, String>;
