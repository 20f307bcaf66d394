//! Files of messages, several of them read as one recording, its messages in the order of their times.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use super::format::format_of;
use super::message::{Break, MessageFile, MessageHead, Topic, Wanted};
use crate::log::content::{Content, Unpacker};
use crate::log::{LogError, escape, list, source};

/// Files of one recording that are open at a time.
const OPEN: usize = 16;
/// Messages of one file that are held back until none of an earlier time can come, and their bytes: some
/// chunks of the usual size, whose messages may lie there in any order.
const MAX_HELD_MESSAGES: usize = 4096;
const HELD_BYTES: usize = 4 << 20;

/// A message that was read ahead.
struct Held {
    head: MessageHead,
    data: Vec<u8>,
}

/// One file of a recording, some messages ahead.
struct OpenFile {
    path: PathBuf,
    file: Box<dyn MessageFile>,
    /// In the order of their times, then of their places in the file.
    held: VecDeque<Held>,
    held_bytes: usize,
    /// Memory that is used again.
    spare: Vec<Vec<u8>>,
    ended: bool,
    /// What ended it, reported once the messages before it are handed out.
    failed: Option<LogError>,
    head: Option<MessageHead>,
    data: Vec<u8>,
    unpacker: Unpacker,
}

impl OpenFile {
    /// Opens a file; `None` for one of no bytes, which a recorder that lost its power leaves behind.
    fn open(path: &Path, wanted: &Wanted) -> Result<Option<Self>, LogError> {
        let content = Content::open(path)?;
        if content.head().is_empty() {
            return Ok(None);
        }
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
            held: VecDeque::new(),
            held_bytes: 0,
            spare: Vec::new(),
            ended: false,
            failed: None,
            head: None,
            data: Vec::new(),
            unpacker: Unpacker::default(),
        };
        part.advance()?;
        Ok(Some(part))
    }

    /// Goes on to the message of the earliest time among those that are held.
    fn advance(&mut self) -> Result<(), LogError> {
        while !self.ended && self.held.len() < MAX_HELD_MESSAGES && self.held_bytes < HELD_BYTES {
            let mut data = self.spare.pop().unwrap_or_default();
            match self.file.next(&mut data) {
                Err(error) => (self.failed, self.ended) = (Some(error), true),
                Ok(None) => self.ended = true,
                Ok(Some(head)) => {
                    self.held_bytes += data.len();
                    // mostly the last one: messages lie nearly in the order of their times
                    let not_later = |held: &Held| held.head.log_ns <= head.log_ns;
                    let at = match self.held.back().is_none_or(not_later) {
                        true => self.held.len(),
                        false => self.held.partition_point(not_later),
                    };
                    self.held.insert(at, Held { head, data });
                }
            }
        }
        self.head = None;
        let Some(next) = self.held.pop_front() else {
            return self.failed.take().map_or(Ok(()), Err);
        };
        self.held_bytes -= next.data.len();
        self.head = Some(next.head);
        self.spare
            .push(std::mem::replace(&mut self.data, next.data));
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
    /// Parts that the recording is said to have and that are not there.
    missing: Vec<String>,
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
            missing: missing_parts(paths),
        };
        recording.open_more()?;
        Ok(recording)
    }

    fn open_more(&mut self) -> Result<(), LogError> {
        while self.parts.len() < OPEN {
            let Some(path) = self.waiting.pop() else {
                return Ok(());
            };
            match OpenFile::open(&path, &self.wanted)? {
                Some(part) => self.parts.push(part),
                None => {
                    let nothing = Break {
                        reason: "it is empty: the recorder ended before it wrote anything"
                            .to_owned(),
                        place: "at its first byte".to_owned(),
                    };
                    self.broken.push((path, nothing));
                }
            }
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

    /// Where files break off, and parts that are not there, once the last message is read; `of` says how much
    /// is used of what breaks off.
    pub(super) fn breaks(&self, of: &str) -> Vec<String> {
        let broken = self.broken.iter().map(|(path, broken)| {
            format!(
                "{} breaks off {} ({}): everything before is used{of}",
                escape(&source::file_name(path)),
                broken.place,
                escape(&broken.reason)
            )
        });
        let missing = self.missing.first().map(|_| {
            format!(
                "metadata.yaml lists {} and the folder lacks {}: what was in it is lost",
                list(self.missing.iter().map(String::as_str)),
                if self.missing.len() == 1 {
                    "it"
                } else {
                    "them"
                },
            )
        });
        broken.chain(missing).collect()
    }
}

/// Largest description of a recording that is looked at [bytes].
const LARGEST_METADATA: u64 = 1 << 20;

/// Files that the description beside a rosbag2 recording lists and its folder lacks.
fn missing_parts(paths: &[PathBuf]) -> Vec<String> {
    let folder = paths.first().and_then(|path| path.parent());
    let Some(folder) = folder else {
        return Vec::new();
    };
    let place = folder.join("metadata.yaml");
    let small = std::fs::metadata(&place).is_ok_and(|m| m.len() <= LARGEST_METADATA);
    let text = match small {
        true => std::fs::read_to_string(&place).unwrap_or_default(),
        false => String::new(),
    };
    let lines = text.lines().map(str::trim);
    let listed = lines.skip_while(|line| *line != "relative_file_paths:");
    let listed = listed
        .skip(1)
        .map_while(|line| Some(line.strip_prefix("- ")?.trim().trim_matches(['"', '\''])));
    let listed: Vec<&str> = listed.collect();
    // a description of another recording says nothing of these files
    let own = paths.iter().any(|path| {
        let name = source::file_name(path);
        listed
            .iter()
            .any(|one| Path::new(one).file_name() == Some(name.as_ref()))
    });
    let gone = |one: &&str| {
        let plain = one.trim_end_matches(".zstd").trim_end_matches(".zst");
        let names = [(*one).to_owned(), plain.to_owned(), format!("{one}.zstd")];
        !names
            .iter()
            .filter_map(|name| Path::new(name).file_name())
            .any(|name| folder.join(name).exists())
    };
    let gone = listed.iter().filter(|one| own && gone(one));
    gone.map(|one| (*one).to_owned()).collect()
}
