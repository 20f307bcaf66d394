//! Files of messages, several of them read as one recording, its messages in the order of their times.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};

use super::format::format_of;
use super::message::{MessageFile, MessageHead, RecordingBreak, Topic};
use crate::log::content::{FileContent, MessageUnpacker};
use crate::log::{LogError, escape, list, source};

/// Files of one recording that are open at a time.
const OPEN: usize = 16;
/// Messages of one file that are held back until none of an earlier time can come, and their bytes: some chunks.
const MAX_HELD_MESSAGES: usize = 4096;
const HELD_BYTES: usize = 4 << 20;

struct OpenFile {
    path: PathBuf,
    file: Box<dyn MessageFile>,
    /// Messages that were read ahead, in the order of their times, then of their places in the file.
    held: VecDeque<(MessageHead, Vec<u8>)>,
    held_bytes: usize,
    /// Memory that is used again.
    spare: Vec<Vec<u8>>,
    ended: bool,
    /// What ended it, reported once the messages before it are handed out.
    failed: Option<LogError>,
    head: Option<MessageHead>,
    data: Vec<u8>,
    unpacker: MessageUnpacker,
}

impl OpenFile {
    /// Opens a file; `None` for one of no bytes, which a recorder that lost its power leaves behind.
    fn open(path: &Path, wanted: &[String]) -> Result<Option<Self>, LogError> {
        let content = FileContent::open(path)?;
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
            unpacker: MessageUnpacker::default(),
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
                    let not_later = |(held, _): &(MessageHead, _)| held.log_ns <= head.log_ns;
                    let at = match self.held.back().is_none_or(not_later) {
                        true => self.held.len(),
                        false => self.held.partition_point(not_later),
                    };
                    self.held.insert(at, (head, data));
                }
            }
        }
        self.head = None;
        let Some((head, data)) = self.held.pop_front() else {
            return self.failed.take().map_or(Ok(()), Err);
        };
        self.held_bytes -= data.len();
        self.head = Some(head);
        self.spare.push(std::mem::replace(&mut self.data, data));
        // A recorder of ROS 2 may compress each message by itself.
        let topic = self.file.topics().get(head.topic);
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
    wanted: Vec<String>,
    /// The part whose message was handed out last.
    current: Option<usize>,
    /// What was said of files that broke off.
    pub(super) broken: Vec<(PathBuf, RecordingBreak)>,
    /// Every topic seen so far, wanted or not.
    pub(super) seen: Vec<Topic>,
    /// Parts that the recording is said to have and that are not there.
    missing: Vec<String>,
}

pub(super) struct Message<'r> {
    pub(super) path: &'r Path,
    pub(super) topic: &'r Topic,
    pub(super) head: MessageHead,
    pub(super) data: &'r [u8],
}

impl MessageFiles {
    /// Opens files as one recording; later ones are opened when earlier ones are read.
    pub(super) fn open(paths: &[PathBuf], wanted: Vec<String>) -> Result<Self, LogError> {
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
                    let nothing = RecordingBreak {
                        reason: "it is empty: the recorder ended before it wrote anything"
                            .to_owned(),
                        place: "at its first byte".to_owned(),
                    };
                    self.broken.push((path, nothing));
                }
            }
            self.retire();
        }
        Ok(())
    }

    /// Lets go of files that have no further message.
    fn retire(&mut self) {
        for part in &self.parts {
            for topic in part.file.topics() {
                if !self.seen.iter().any(|known| known.name == topic.name) {
                    self.seen.push(topic.clone());
                }
            }
        }
        for part in self.parts.extract_if(.., |part| part.head.is_none()) {
            let broken = part.file.broken().cloned();
            self.broken.extend(broken.map(|broken| (part.path, broken)));
        }
    }

    pub(super) fn next(&mut self) -> Result<Option<Message<'_>>, LogError> {
        let current = self.current.take();
        if let Some(part) = current.and_then(|index| self.parts.get_mut(index)) {
            part.advance()?;
            if part.head.is_none() {
                self.retire();
                self.open_more()?;
            }
        }
        let heads = self.parts.iter().enumerate();
        let heads = heads.filter_map(|(index, part)| Some((index, part, part.head?)));
        let earliest = heads.min_by_key(|(_, _, head)| head.log_ns);
        self.current = earliest.map(|(index, ..)| index);
        Ok(earliest.and_then(|(_, part, head)| {
            Some(Message {
                path: &part.path,
                topic: part.file.topics().get(head.topic)?,
                head,
                data: &part.data,
            })
        }))
    }

    /// Where files break off, `of` saying how much is used of them, and parts that are not there.
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
                match self.missing.len() {
                    1 => "it",
                    _ => "them",
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
        let mut names = listed.iter().map(|one| Path::new(one).file_name());
        names.any(|one| one == Some(name.as_ref()))
    });
    let gone = |one: &&str| {
        let plain = one.trim_end_matches(".zstd").trim_end_matches(".zst");
        let names = [(*one).to_owned(), plain.to_owned(), format!("{one}.zstd")];
        let mut names = names.iter().filter_map(|name| Path::new(name).file_name());
        !names.any(|name| folder.join(name).exists())
    };
    let gone = listed.iter().filter(|one| own && gone(one));
    gone.map(|one| (*one).to_owned()).collect()
}
