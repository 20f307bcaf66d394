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

use super::container::{Break, Head, Topic, Wanted};
use super::decode::Schema;
use super::record::{CUT, ChannelRecord, MessageRecord, SchemaRecord};
use crate::log::content::{Bytes, Compression, Content};
use crate::log::{LogError, source};

/// Bytes that are asked of the disk at once.
const PIECE: usize = 1 << 16;
/// The largest record that is read [bytes].
const LARGEST_RECORD: u64 = 256 << 20;
/// Bytes of definitions that are kept.
const LARGEST_SCHEMAS: usize = 64 << 20;

/// Why a file ends before its end.
const UNCLOSED: &str = "the recorder did not close it, or the copy was cut off";

/// An MCAP file that is being read.
pub(super) struct McapFile {
    path: PathBuf,
    input: Bytes,
    reader: LinearReader,
    wanted: Wanted,
    topics: Vec<Topic>,
    /// Channel by its number in the file: index of the topic, and whether it is wanted.
    channels: BTreeMap<u16, (usize, bool)>,
    schemas: BTreeMap<u16, Arc<SchemaText>>,
    schema_bytes: usize,
    bytes: u64,
    /// Length of the file, where it is not compressed as a whole [bytes].
    size: Option<u64>,
    messages: u64,
    ended: bool,
    broken: Option<Break>,
}

/// A definition as the file holds it.
struct SchemaText {
    name: String,
    language: String,
    text: Vec<u8>,
}

/// A topic as the file declares it.
struct Channel {
    id: u16,
    schema: u16,
    topic: String,
    encoding: String,
}

impl McapFile {
    pub(super) fn open(path: &Path, content: Content, wanted: Wanted) -> Self {
        // No record can hold much more than the whole file does, however well it is compressed.
        let largest = (content.size.saturating_mul(1024) + (1 << 20)).min(LARGEST_RECORD);
        let options = LinearReaderOptions::default()
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_record_length_limit(largest as usize);
        let size = (content.compression == Compression::None).then_some(content.size);
        Self {
            path: path.to_owned(),
            input: content.into_bytes(),
            reader: LinearReader::new_with_options(options),
            wanted,
            topics: Vec::new(),
            channels: BTreeMap::new(),
            schemas: BTreeMap::new(),
            schema_bytes: 0,
            bytes: 0,
            size,
            messages: 0,
            ended: false,
            broken: None,
        }
    }

    pub(super) fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Where and why the file breaks off, once it has.
    pub(super) fn broken(&self) -> Option<&Break> {
        self.broken.as_ref()
    }

    /// The next message of a wanted topic, its bytes in `data`; `None` at the end.
    ///
    /// # Errors
    /// A disk that cannot be read; a chunk whose checksum is wrong.
    pub(super) fn next(&mut self, data: &mut Vec<u8>) -> Result<Option<Head>, LogError> {
        while !self.ended {
            let step = match self.reader.next_event() {
                // No record says that the data end here.
                None => Step::Break(UNCLOSED.to_owned()),
                Some(Ok(LinearReadEvent::ReadRequest(_))) => Step::Read,
                Some(Ok(LinearReadEvent::Record { data: body, opcode })) => match opcode {
                    op::DATA_END => Step::End,
                    op::MESSAGE => match MessageRecord::parse(body) {
                        Some(message) => {
                            self.messages += 1;
                            match self.channels.get(&message.channel) {
                                Some((_, false)) => continue,
                                Some((topic, true)) => {
                                    data.clear();
                                    data.extend_from_slice(message.data);
                                    return Ok(Some(Head {
                                        topic: *topic,
                                        log_ns: message.log_ns,
                                        publish_ns: message.publish_ns,
                                        number: self.messages,
                                    }));
                                }
                                None => Step::Break(format!(
                                    "message {} is of a channel that was not declared",
                                    self.messages
                                )),
                            }
                        }
                        None => Step::Break(CUT.to_owned()),
                    },
                    op::SCHEMA => match SchemaRecord::parse(body) {
                        Some(schema) if self.schemas.contains_key(&schema.id) => continue,
                        Some(schema) => Step::Schema(
                            schema.id,
                            SchemaText {
                                name: schema.name.to_owned(),
                                language: schema.language.to_owned(),
                                text: schema.text.to_owned(),
                            },
                        ),
                        None => Step::Break(CUT.to_owned()),
                    },
                    op::CHANNEL => match ChannelRecord::parse(body) {
                        // A file may repeat its definitions in every chunk.
                        Some(channel) if self.channels.contains_key(&channel.id) => continue,
                        Some(channel) => Step::Channel(Channel {
                            id: channel.id,
                            schema: channel.schema,
                            topic: channel.topic.to_owned(),
                            encoding: channel.encoding.to_owned(),
                        }),
                        None => Step::Break(CUT.to_owned()),
                    },
                    _ => continue,
                },
                Some(Err(McapError::BadChunkCrc { saved, calculated })) => {
                    return Err(LogError::Damaged {
                        file: source::shown(&self.path),
                        part: format!("the chunk that ends near byte {}", self.bytes),
                        saved,
                        calculated,
                    });
                }
                Some(Err(McapError::UnexpectedEof)) => Step::Break(UNCLOSED.to_owned()),
                Some(Err(error)) => Step::Break(error.to_string()),
            };
            match step {
                Step::End => self.ended = true,
                Step::Read => self.fill()?,
                Step::Schema(id, schema) => self.add_schema(id, schema),
                Step::Channel(channel) => self.add_channel(channel),
                Step::Break(reason) => self.break_off(reason),
            }
        }
        Ok(None)
    }

    /// Hands the next bytes of the file to the reader.
    fn fill(&mut self) -> Result<(), LogError> {
        let buffer = self.reader.insert(PIECE);
        let count = loop {
            match self.input.read(buffer) {
                Ok(count) => break count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                // A compressed file that is cut off, or damaged.
                Err(error)
                    if matches!(
                        error.kind(),
                        io::ErrorKind::UnexpectedEof
                            | io::ErrorKind::InvalidData
                            | io::ErrorKind::InvalidInput
                            | io::ErrorKind::Other
                    ) =>
                {
                    self.break_off(format!("its compression ends there: {error}"));
                    return Ok(());
                }
                Err(error) => return Err(source::failed(&self.path, error)),
            }
        };
        self.reader.notify_read(count);
        self.bytes += count as u64;
        Ok(())
    }

    fn break_off(&mut self, reason: String) {
        self.ended = true;
        self.broken = Some(Break {
            reason,
            place: match self.size {
                Some(size) => format!("at byte {} of {size}", self.bytes),
                None => format!("after {} decompressed bytes", self.bytes),
            },
        });
    }

    fn add_schema(&mut self, id: u16, schema: SchemaText) {
        self.schema_bytes += schema.text.len() + schema.name.len() + schema.language.len();
        if self.schema_bytes > LARGEST_SCHEMAS {
            let limit = LARGEST_SCHEMAS;
            return self.break_off(format!("its definitions take more than {limit} bytes"));
        }
        self.schemas.insert(id, Arc::new(schema));
    }

    fn add_channel(&mut self, channel: Channel) {
        let schema = self.schemas.get(&channel.schema);
        let schema = Schema {
            name: schema.map_or_else(String::new, |s| s.name.clone()),
            language: schema.map_or_else(String::new, |s| s.language.clone()),
            text: schema.map_or_else(Vec::new, |s| s.text.clone()),
            encoding: channel.encoding,
        };
        self.schema_bytes += schema.text.len() + channel.topic.len();
        if self.schema_bytes > LARGEST_SCHEMAS {
            let limit = LARGEST_SCHEMAS;
            return self.break_off(format!("its definitions take more than {limit} bytes"));
        }
        let wanted = self.wanted.includes(&channel.topic);
        let known = self
            .topics
            .iter()
            .position(|t| t.name == channel.topic && *t.schema == schema);
        let topic = known.unwrap_or(self.topics.len());
        if known.is_none() {
            self.topics.push(Topic {
                name: channel.topic,
                schema: Arc::new(schema),
            });
        }
        self.channels.insert(channel.id, (topic, wanted));
    }
}

/// What follows from one event of the reader, once it no longer borrows it.
enum Step {
    Read,
    End,
    Break(String),
    Schema(u16, SchemaText),
    Channel(Channel),
}
