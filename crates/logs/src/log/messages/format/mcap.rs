//! Messages of one MCAP file, in the order in which they lie there: the only door to the mcap crate.
//!
//! Records are read one after the other and the index is not used, so that a file without one, or
//! one that breaks off, is read as far as it goes. Memory holds one record and is never taken on
//! the word of a length: bytes are asked for in small pieces.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::record::{CUT, ChannelRecord, MessageRecord, SchemaRecord};
use crate::log::content::{CompressionFormat, ContentBytes, FileContent};
use crate::log::messages::message::{
    MessageFile, MessageHead, RecordingBreak, Schema, Topic, is_wanted,
};
use crate::log::{LogError, source};

/// Bytes that are asked of the disk at once.
const PIECE: usize = 1 << 16;
/// The largest record that is read [bytes].
const LARGEST_RECORD: u64 = 256 << 20;
/// Errors of a decoder whose input is cut off or damaged.
const CUT_OFF: [io::ErrorKind; 4] = [
    io::ErrorKind::UnexpectedEof,
    io::ErrorKind::InvalidData,
    io::ErrorKind::InvalidInput,
    io::ErrorKind::Other,
];
/// Bytes of definitions that are kept.
const LARGEST_SCHEMAS: usize = 64 << 20;

const UNCLOSED: &str = "the recorder did not close it, or the copy was cut off";

struct McapFile {
    path: PathBuf,
    input: ContentBytes,
    reader: LinearReader,
    contents: McapContents,
    bytes: u64,
    /// Length of the file, where it is not compressed as a whole [bytes].
    size: Option<u64>,
    ended: bool,
    broken: Option<RecordingBreak>,
}

struct McapContents {
    wanted: Vec<String>,
    topics: Vec<Topic>,
    /// Channel by its number in the file: index of the topic, and whether it is wanted.
    channels: BTreeMap<u16, (usize, bool)>,
    /// Definition by its number in the file, its encoding not known yet.
    schemas: BTreeMap<u16, Schema>,
    bytes: usize,
    messages: u64,
}

pub(super) fn open(
    path: &Path,
    content: FileContent,
    wanted: &[String],
) -> Result<Box<dyn MessageFile>, LogError> {
    // No record can hold much more than the whole file does, however well it is compressed.
    let largest = (content.size.saturating_mul(1024) + (1 << 20)).min(LARGEST_RECORD);
    let options = LinearReaderOptions::default()
        .with_skip_end_magic(true)
        .with_validate_chunk_crcs(true)
        .with_record_length_limit(largest as usize);
    let size = (content.compression == CompressionFormat::None).then_some(content.size);
    Ok(Box::new(McapFile {
        path: path.to_owned(),
        input: content.into_bytes(),
        reader: LinearReader::new_with_options(options),
        contents: McapContents {
            wanted: wanted.to_vec(),
            topics: Vec::new(),
            channels: BTreeMap::new(),
            schemas: BTreeMap::new(),
            bytes: 0,
            messages: 0,
        },
        bytes: 0,
        size,
        ended: false,
        broken: None,
    }))
}

impl MessageFile for McapFile {
    fn topics(&self) -> &[Topic] {
        &self.contents.topics
    }

    fn broken(&self) -> Option<&RecordingBreak> {
        self.broken.as_ref()
    }

    fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<MessageHead>, LogError> {
        while !self.ended {
            let reason = match self.reader.next_event() {
                // No record says that the data end here.
                None | Some(Err(McapError::UnexpectedEof)) => UNCLOSED.to_owned(),
                Some(Ok(LinearReadEvent::ReadRequest(_))) => match self.fill()? {
                    None => continue,
                    Some(reason) => reason,
                },
                Some(Ok(LinearReadEvent::Record { data: body, opcode })) => {
                    match self.contents.take(opcode, body, data) {
                        Ok(None) if opcode == op::DATA_END => {
                            self.ended = true;
                            return Ok(None);
                        }
                        Ok(None) => continue,
                        Ok(head) => return Ok(head),
                        Err(reason) => reason,
                    }
                }
                Some(Err(McapError::BadChunkCrc { saved, calculated })) => {
                    return Err(LogError::Damaged {
                        file: source::shown(&self.path),
                        part: format!("the chunk that ends near byte {}", self.bytes),
                        saved,
                        calculated,
                    });
                }
                Some(Err(error)) => error.to_string(),
            };
            self.ended = true;
            self.broken = Some(RecordingBreak {
                reason,
                place: match self.size {
                    Some(size) => format!("at byte {} of {size}", self.bytes),
                    None => format!("after {} decompressed bytes", self.bytes),
                },
            });
        }
        Ok(None)
    }
}

impl McapFile {
    /// Hands the next bytes of the file to the reader; else why there are none.
    fn fill(&mut self) -> Result<Option<String>, LogError> {
        let buffer = self.reader.insert(PIECE);
        match self.input.read(buffer) {
            Ok(count) => {
                self.reader.notify_read(count);
                self.bytes += count as u64;
                Ok(None)
            }
            // A compressed file that is cut off, or damaged.
            Err(error) if CUT_OFF.contains(&error.kind()) => {
                Ok(Some(format!("its compression ends there: {error}")))
            }
            Err(error) => Err(source::failed(&self.path, error)),
        }
    }
}

impl McapContents {
    /// Takes a record; a message of a wanted topic is handed out, its bytes in `data`.
    #[inline]
    fn take(
        &mut self,
        opcode: u8,
        body: &[u8],
        data: &mut Vec<u8>,
    ) -> Result<Option<MessageHead>, String> {
        match opcode {
            op::MESSAGE => {
                let message = MessageRecord::parse(body).ok_or(CUT)?;
                self.messages += 1;
                let Some((topic, wanted)) = self.channels.get(&message.channel) else {
                    let number = self.messages;
                    return Err(format!(
                        "message {number} is of a channel that was not declared"
                    ));
                };
                if *wanted {
                    data.clear();
                    data.extend_from_slice(message.data);
                    return Ok(Some(MessageHead {
                        topic: *topic,
                        channel: message.channel,
                        log_ns: message.log_ns,
                        publish_ns: message.publish_ns,
                        number: self.messages,
                    }));
                }
            }
            op::SCHEMA => self.add_schema(&SchemaRecord::parse(body).ok_or(CUT)?)?,
            op::CHANNEL => self.add_channel(&ChannelRecord::parse(body).ok_or(CUT)?)?,
            _ => {}
        }
        Ok(None)
    }

    fn add_schema(&mut self, schema: &SchemaRecord<'_>) -> Result<(), String> {
        // A file may repeat its definitions in every chunk.
        if self.schemas.contains_key(&schema.id) {
            return Ok(());
        }
        self.make_room(schema.text.len() + schema.name.len() + schema.language.len())?;
        let definition = Schema {
            name: schema.name.to_owned(),
            language: schema.language.to_owned(),
            text: schema.text.to_owned(),
            encoding: String::new(),
        };
        self.schemas.insert(schema.id, definition);
        Ok(())
    }

    fn add_channel(&mut self, channel: &ChannelRecord<'_>) -> Result<(), String> {
        if self.channels.contains_key(&channel.id) {
            return Ok(());
        }
        let known = self.schemas.get(&channel.schema).cloned();
        let schema = Schema {
            encoding: channel.encoding.to_owned(),
            ..known.unwrap_or_default()
        };
        self.make_room(schema.text.len() + channel.topic.len())?;
        let same = |topic: &Topic| topic.name == channel.topic && *topic.schema == schema;
        let known = self.topics.iter().position(same);
        let topic = known.unwrap_or(self.topics.len());
        if known.is_none() {
            self.topics.push(Topic {
                name: channel.topic.to_owned(),
                schema: Arc::new(schema),
            });
        }
        let wanted = is_wanted(channel.topic, &self.wanted);
        self.channels.insert(channel.id, (topic, wanted));
        Ok(())
    }

    /// Counts the bytes of a definition, of which a file may have only so many.
    fn make_room(&mut self, bytes: usize) -> Result<(), String> {
        self.bytes += bytes;
        match self.bytes > LARGEST_SCHEMAS {
            true => Err(format!(
                "its definitions take more than {LARGEST_SCHEMAS} bytes"
            )),
            false => Ok(()),
        }
    }
}
