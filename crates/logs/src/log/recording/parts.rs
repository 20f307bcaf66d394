//! Files of messages, several of them read as one recording.

use std::path::{Path, PathBuf};

use super::format::format_of;
use super::message::{Break, MessageFile, MessageHead, Topic, Wanted};
use crate::log::content::{Content, Unpacker};
use crate::log::{LogError, source};

/// Files of one recording that are open at a time.
const OPEN: usize = 16;

/// One file of a recording, one message ahead.
struct OpenFile {
    path: PathBuf,
    file: Box<dyn MessageFile>,
    head: Option<MessageHead>,
    data: Vec<u8>,
    unpacker: Unpacker,
}

impl OpenFile {
    fn open(path: &Path, wanted: &Wanted) -> Result<Self, LogError> {
        let content = Content::open(path)?;
        let Some(format) = format_of(content.head()) else {
            return Err(LogError::Format {
                file: source::shown(path),
                kind: "no MCAP recording and no rosbag2 database",
                remedy: "read text logs one by one",
            });
        };
        let mut part = Self {
            path: path.to_owned(),
            file: (format.open)(path, content, wanted)?,
            head: None,
            data: Vec::new(),
            unpacker: Unpacker::default(),
        };
        part.advance()?;
        Ok(part)
    }

    fn advance(&mut self) -> Result<(), LogError> {
        self.head = self.file.next(&mut self.data)?;
        // A recorder of ROS 2 may compress each message by itself.
        let topic = self
            .head
            .and_then(|head| self.file.topics().get(head.topic));
        if topic.is_some_and(|topic| topic.schema.encoding == "cdr") {
            self.unpacker.unpack(&mut self.data);
        }
        Ok(())
    }
}

/// A recording: the messages of its files in the order in which they were recorded.
pub(super) struct MessageFiles {
    parts: Vec<OpenFile>,
    /// Files that are not open yet, the next one last.
    waiting: Vec<PathBuf>,
    wanted: Wanted,
    /// The part whose message was handed out last.
    current: Option<usize>,
    /// What was said of files that broke off.
    pub(super) broken: Vec<(PathBuf, Break)>,
    /// Every topic seen so far, wanted or not.
    pub(super) seen: Vec<Topic>,
}

/// A message of a recording.
pub(super) struct Message<'r> {
    pub(super) path: &'r Path,
    pub(super) topic: &'r Topic,
    pub(super) head: MessageHead,
    pub(super) data: &'r [u8],
}

impl MessageFiles {
    /// Opens files as one recording; later ones are opened when earlier ones are read.
    pub(super) fn open(paths: &[PathBuf], wanted: Wanted) -> Result<Self, LogError> {
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
            let part = OpenFile::open(&path, &self.wanted)?;
            self.parts.push(part);
            self.retire()?;
        }
        Ok(())
    }

    /// Lets go of files that have no further message.
    fn retire(&mut self) -> Result<(), LogError> {
        for part in &self.parts {
            for topic in part.file.topics() {
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
            if let Some(broken) = part.file.broken() {
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
    pub(super) fn next(&mut self) -> Result<Option<Message<'_>>, LogError> {
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
                topic: part.file.topics().get(head.topic)?,
                head,
                data: &part.data,
            })
        }))
    }
}
