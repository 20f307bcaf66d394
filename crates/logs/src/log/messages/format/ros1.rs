//! Messages of one bag of ROS 1 (format 2.0), in the order in which they lie there.
//!
//! Records are read one after the other and the index is not used, so that a bag without one, `.bag.active`, is read as
//! far as it goes. The format is that of wiki.ros.org/Bags/Format/2.0.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::log::content::{ContentBytes, FileContent, unpacked_chunk};
use crate::log::messages::message::{
    MessageFile, MessageHead, RecordingBreak, Schema, Topic, is_wanted,
};
use crate::log::{LogError, source};

pub(super) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// The largest header and the largest record that are read [bytes].
const LARGEST_HEADER: u32 = 1 << 20;
const LARGEST_RECORD: u32 = 1 << 30;

const MESSAGE: u8 = 2;
const CHUNK: u8 = 5;
const CONNECTION: u8 = 7;

struct BagFile {
    path: PathBuf,
    input: ContentBytes,
    topics: Vec<Topic>,
    /// Topic by the number of its connection, and whether it is wanted.
    connections: BTreeMap<u32, (usize, bool)>,
    wanted: Vec<String>,
    /// What is left of the chunk that is being read, and where.
    chunk: Vec<u8>,
    at: usize,
    messages: u64,
    ended: bool,
    broken: Option<RecordingBreak>,
}

/// Why a record cannot be read.
enum RecordProblem {
    /// The file ends within it.
    Cut,
    Damaged(String),
    Disk(io::Error),
}

pub(super) fn open(
    path: &Path,
    content: FileContent,
    wanted: &[String],
) -> Result<Box<dyn MessageFile>, LogError> {
    let mut input = content.into_bytes();
    let mut magic = [0; MAGIC.len()];
    let read = input.read_exact(&mut magic);
    read.map_err(|error| source::failed(path, error))?;
    Ok(Box::new(BagFile {
        path: path.to_owned(),
        input,
        topics: Vec::new(),
        connections: BTreeMap::new(),
        wanted: wanted.to_vec(),
        chunk: Vec::new(),
        at: 0,
        messages: 0,
        ended: false,
        broken: None,
    }))
}

fn word(bytes: &[u8]) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(..4)?.try_into().ok()?))
}

/// A length and what is so long, and what follows it.
fn part(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let length = word(bytes)? as usize;
    bytes.get(4..)?.split_at_checked(length)
}

/// The value of a field of a header.
fn field<'h>(mut header: &'h [u8], name: &[u8]) -> Option<&'h [u8]> {
    while let Some((own, rest)) = part(header) {
        let equals = own.iter().position(|byte| *byte == b'=')?;
        if &own[..equals] == name {
            return own.get(equals + 1..);
        }
        header = rest;
    }
    None
}

fn text(bytes: Option<&[u8]>) -> String {
    String::from_utf8_lossy(bytes.unwrap_or_default()).into_owned()
}

impl BagFile {
    /// Reads so many bytes of the file; asked for in pieces, so that nothing is taken on the word of a length.
    fn bytes(&mut self, count: u32, out: &mut Vec<u8>) -> Result<(), RecordProblem> {
        out.clear();
        let read = Read::by_ref(&mut self.input)
            .take(count.into())
            .read_to_end(out);
        match read {
            Ok(read) if read == count as usize => Ok(()),
            Ok(_) => Err(RecordProblem::Cut),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Err(RecordProblem::Cut),
            Err(error) => Err(RecordProblem::Disk(error)),
        }
    }

    fn length(&mut self, most: u32) -> Result<Option<u32>, RecordProblem> {
        let mut four = Vec::new();
        match self.bytes(4, &mut four) {
            Err(RecordProblem::Cut) if four.is_empty() => return Ok(None),
            other => other?,
        }
        match word(&four) {
            Some(length) if length <= most => Ok(Some(length)),
            _ => Err(RecordProblem::Damaged(format!(
                "a record is longer than {most} bytes"
            ))),
        }
    }

    /// Reads the next record of the file: a chunk is unpacked, of others the connections are kept.
    fn record(&mut self, data: &mut Vec<u8>) -> Result<Option<MessageHead>, RecordProblem> {
        let Some(length) = self.length(LARGEST_HEADER)? else {
            self.ended = true;
            return Ok(None);
        };
        let mut header = Vec::new();
        self.bytes(length, &mut header)?;
        let length = self.length(LARGEST_RECORD)?.ok_or(RecordProblem::Cut)?;
        let mut body = Vec::new();
        let read = self.bytes(length, &mut body);
        let plain = field(&header, b"compression") == Some(b"none");
        // of a chunk that was being written all whole records are used
        if !(plain && matches!(read, Err(RecordProblem::Cut)) && !body.is_empty()) {
            read?;
        }
        match field(&header, b"op") {
            Some([CHUNK]) => {
                let packed = text(field(&header, b"compression"));
                let size = field(&header, b"size").and_then(word).unwrap_or(0);
                let size = size.min(LARGEST_RECORD);
                self.chunk = unpacked_chunk(&packed, body, size.into())
                    .map_err(|error| RecordProblem::Damaged(error.to_string()))?;
                self.at = 0;
                Ok(None)
            }
            Some([CONNECTION]) => {
                self.connect(&header, &body);
                Ok(None)
            }
            Some([MESSAGE]) => Ok(self.message(&header, &body, data)),
            _ => Ok(None),
        }
    }

    fn connect(&mut self, header: &[u8], body: &[u8]) {
        let Some(number) = field(header, b"conn").and_then(word) else {
            return;
        };
        if self.connections.contains_key(&number) {
            return;
        }
        let name = text(field(header, b"topic"));
        let schema = Schema {
            name: text(field(body, b"type")),
            language: "ros1msg".to_owned(),
            text: field(body, b"message_definition")
                .unwrap_or_default()
                .to_vec(),
            encoding: "ros1".to_owned(),
        };
        let same = |topic: &Topic| topic.name == name && *topic.schema == schema;
        let known = self.topics.iter().position(same);
        let at = known.unwrap_or(self.topics.len());
        let wanted = is_wanted(&name, &self.wanted);
        if known.is_none() {
            self.topics.push(Topic {
                name,
                schema: Arc::new(schema),
            });
        }
        self.connections.insert(number, (at, wanted));
    }

    /// The message of a record, where its topic is wanted.
    fn message(&mut self, header: &[u8], body: &[u8], data: &mut Vec<u8>) -> Option<MessageHead> {
        let number = field(header, b"conn").and_then(word)?;
        let (topic, wanted) = *self.connections.get(&number)?;
        self.messages += 1;
        let time = field(header, b"time")?;
        let (seconds, nanoseconds) = (word(time)?, word(time.get(4..)?)?);
        let log_ns = u64::from(seconds) * 1_000_000_000 + u64::from(nanoseconds);
        if !wanted {
            return None;
        }
        data.clear();
        data.extend_from_slice(body);
        Some(MessageHead {
            topic,
            channel: number as u16,
            log_ns,
            publish_ns: log_ns,
            number: self.messages,
        })
    }

    /// The next record of the chunk that was unpacked last.
    fn of_chunk(&mut self, data: &mut Vec<u8>) -> Result<Option<MessageHead>, RecordProblem> {
        let chunk = std::mem::take(&mut self.chunk);
        let rest = chunk.get(self.at..).unwrap_or_default();
        let parts = part(rest).and_then(|(header, after)| Some((header, part(after)?.0)));
        let Some((header, body)) = parts else {
            self.at = 0;
            return Err(RecordProblem::Damaged(
                "a chunk ends within a record".to_owned(),
            ));
        };
        self.at += 8 + header.len() + body.len();
        let found = match field(header, b"op") {
            Some([CONNECTION]) => {
                self.connect(header, body);
                None
            }
            Some([MESSAGE]) => self.message(header, body, data),
            _ => None,
        };
        if self.at < chunk.len() {
            self.chunk = chunk;
        }
        Ok(found)
    }
}

impl MessageFile for BagFile {
    fn topics(&self) -> &[Topic] {
        &self.topics
    }

    fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<MessageHead>, LogError> {
        while !self.ended {
            let found = match self.chunk.is_empty() {
                true => self.record(data),
                false => self.of_chunk(data),
            };
            let reason = match found {
                Ok(Some(head)) => return Ok(Some(head)),
                Ok(None) => continue,
                Err(RecordProblem::Disk(error)) => return Err(source::failed(&self.path, error)),
                Err(RecordProblem::Cut) => {
                    "the recorder did not close it, or the copy was cut off".to_owned()
                }
                Err(RecordProblem::Damaged(reason)) => reason,
            };
            self.ended = true;
            self.broken = Some(RecordingBreak {
                reason,
                place: format!("after {} of its messages", self.messages),
            });
        }
        Ok(None)
    }

    fn broken(&self) -> Option<&RecordingBreak> {
        self.broken.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_of_a_header_are_found_and_a_cut_one_has_none() {
        let mut header = Vec::new();
        for own in [&b"op=\x07"[..], b"topic=/a=b"] {
            header.extend((own.len() as u32).to_le_bytes());
            header.extend(own);
        }
        assert_eq!(field(&header, b"topic"), Some(&b"/a=b"[..]));
        assert_eq!(field(&header, b"conn"), None);
        assert_eq!(field(&header[..header.len() - 1], b"topic"), None);
    }
}
