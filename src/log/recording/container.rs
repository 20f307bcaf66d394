//! What recordings are made of: files of messages on topics, several of them read as one.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::bag::BagFile;
use super::decode::Schema;
use super::mcap::McapFile;
use crate::log::content::{Content, Kind, Unpacker};
use crate::log::{LogError, source};

/// Files of one recording that are open at a time.
const OPEN: usize = 16;

/// A topic of a file.
#[derive(Debug, Clone)]
pub(crate) struct Topic {
    pub(crate) name: String,
    pub(crate) schema: Arc<Schema>,
}

/// Which topics are read.
#[derive(Debug, Clone, Default)]
pub(crate) struct Wanted {
    /// Their names; empty for all.
    pub(crate) names: Vec<String>,
}

impl Wanted {
    pub(super) fn includes(&self, topic: &str) -> bool {
        self.names.is_empty() || self.names.iter().any(|name| name == topic)
    }
}

/// A message without its bytes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Head {
    /// Index of its topic in the file.
    pub(crate) topic: usize,
    /// When it was recorded [ns].
    pub(crate) log_ns: u64,
    /// When it was published [ns].
    pub(crate) publish_ns: u64,
    /// Which message of the file it is, from 1.
    pub(crate) number: u64,
}

/// Where and why a file ends before its end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Break {
    pub(crate) reason: String,
    /// How much of it was read, as it stands after "breaks off".
    pub(crate) place: String,
}

enum Form {
    Mcap(Box<McapFile>),
    Bag(Box<BagFile>),
}

/// One file of a recording, one message ahead.
struct Part {
    path: PathBuf,
    form: Form,
    head: Option<Head>,
    data: Vec<u8>,
    unpacker: Unpacker,
}

impl Part {
    fn open(path: &Path, wanted: &Wanted) -> Result<Self, LogError> {
        let content = Content::open(path)?;
        let form = match content.kind {
            Kind::Mcap => Form::Mcap(Box::new(McapFile::open(path, content, wanted.clone()))),
            Kind::Sqlite => Form::Bag(Box::new(BagFile::open(path, content, wanted)?)),
            Kind::Text => {
                return Err(LogError::Format {
                    file: source::shown(path),
                    kind: "no MCAP recording and no rosbag2 database",
                    remedy: "read text logs one by one",
                });
            }
        };
        let mut part = Self {
            path: path.to_owned(),
            form,
            head: None,
            data: Vec::new(),
            unpacker: Unpacker::default(),
        };
        part.advance()?;
        Ok(part)
    }

    fn advance(&mut self) -> Result<(), LogError> {
        self.head = match &mut self.form {
            Form::Mcap(file) => file.next(&mut self.data)?,
            Form::Bag(file) => file.next(&mut self.data)?,
        };
        // A recorder of ROS 2 may compress each message by itself.
        let topic = self.head.and_then(|head| self.topics().get(head.topic));
        if topic.is_some_and(|topic| topic.schema.encoding == "cdr") {
            self.unpacker.unpack(&mut self.data);
        }
        Ok(())
    }

    fn topics(&self) -> &[Topic] {
        match &self.form {
            Form::Mcap(file) => file.topics(),
            Form::Bag(file) => file.topics(),
        }
    }

    fn broken(&self) -> Option<&Break> {
        match &self.form {
            Form::Mcap(file) => file.broken(),
            Form::Bag(file) => file.broken(),
        }
    }
}

/// A recording: the messages of its files in the order in which they were recorded.
pub(crate) struct Recording {
    parts: Vec<Part>,
    /// Files that are not open yet, the next one last.
    waiting: Vec<PathBuf>,
    wanted: Wanted,
    /// The part whose message was handed out last.
    current: Option<usize>,
    /// What was said of files that broke off.
    pub(crate) broken: Vec<(PathBuf, Break)>,
    /// Every topic seen so far, wanted or not.
    pub(crate) seen: Vec<Topic>,
}

/// A message of a recording.
pub(crate) struct Message<'r> {
    pub(crate) path: &'r Path,
    pub(crate) topic: &'r Topic,
    pub(crate) head: Head,
    pub(crate) data: &'r [u8],
}

impl Recording {
    /// Opens files as one recording; later ones are opened when earlier ones are read.
    pub(crate) fn open(paths: &[PathBuf], wanted: Wanted) -> Result<Self, LogError> {
        let mut recording = Self {
            parts: Vec::new(),
            waiting: paths.iter().rev().cloned().collect(),
            wanted,
            current: None,
            broken: Vec::new(),
            seen: Vec::new(),
        };
        recording.open_more()?;
        Ok(recording)
    }

    fn open_more(&mut self) -> Result<(), LogError> {
        while self.parts.len() < OPEN {
            let Some(path) = self.waiting.pop() else {
                return Ok(());
            };
            let part = Part::open(&path, &self.wanted)?;
            self.parts.push(part);
            self.retire()?;
        }
        Ok(())
    }

    /// Lets go of files that have no further message.
    fn retire(&mut self) -> Result<(), LogError> {
        for part in &self.parts {
            for topic in part.topics() {
                if !self.seen.iter().any(|known| known.name == topic.name) {
                    self.seen.push(topic.clone());
                }
            }
        }
        let mut index = 0;
        while let Some(part) = self.parts.get(index) {
            if part.head.is_some() {
                index += 1;
                continue;
            }
            let part = self.parts.remove(index);
            if let Some(broken) = part.broken() {
                let broken = broken.clone();
                self.broken.push((part.path, broken));
            }
        }
        Ok(())
    }

    /// The next message; `None` at the end.
    ///
    /// # Errors
    /// A file that cannot be read, or that is damaged.
    pub(crate) fn next(&mut self) -> Result<Option<Message<'_>>, LogError> {
        let current = self.current.take();
        if let Some(part) = current.and_then(|index| self.parts.get_mut(index)) {
            part.advance()?;
            if part.head.is_none() {
                self.retire()?;
                self.open_more()?;
            }
        }
        let heads = self.parts.iter().enumerate();
        let earliest = heads
            .filter_map(|(index, part)| Some((part.head?.log_ns, index)))
            .min();
        let Some((_, index)) = earliest else {
            return Ok(None);
        };
        self.current = Some(index);
        let part = &self.parts[index];
        Ok(part.head.and_then(|head| {
            Some(Message {
                path: &part.path,
                topic: part.topics().get(head.topic)?,
                head,
                data: &part.data,
            })
        }))
    }
}
