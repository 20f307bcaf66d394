//! Recordings written message by message, so that tests choose what is in them.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use mcap::{Channel, Message, Schema, WriteOptions, Writer};

/// A recording that is being written.
pub struct Recording {
    writer: Writer<File>,
    channels: BTreeMap<String, Arc<Channel<'static>>>,
}

impl Recording {
    pub fn create(path: &Path, options: WriteOptions) -> Self {
        Self {
            writer: options.create(File::create(path).unwrap()).unwrap(),
            channels: BTreeMap::new(),
        }
    }

    fn channel(
        &mut self,
        topic: &str,
        encoding: &str,
        schema: &str,
        language: &str,
    ) -> Arc<Channel<'static>> {
        let next = self.channels.len() as u16 + 1;
        let made = self.channels.entry(topic.to_owned()).or_insert_with(|| {
            Arc::new(Channel {
                id: next,
                topic: topic.to_owned(),
                schema: Some(Arc::new(Schema {
                    id: next,
                    name: schema.to_owned(),
                    encoding: language.to_owned(),
                    data: Cow::Borrowed(b""),
                })),
                message_encoding: encoding.to_owned(),
                metadata: BTreeMap::new(),
            })
        });
        made.clone()
    }

    fn write(&mut self, channel: Arc<Channel<'static>>, log_ns: u64, data: Vec<u8>) {
        let message = Message {
            channel,
            sequence: 0,
            log_time: log_ns,
            publish_time: log_ns,
            data: Cow::Owned(data),
        };
        self.writer.write(&message).unwrap();
    }

    pub fn json(&mut self, topic: &str, log_ns: u64, text: &str) {
        let channel = self.channel(topic, "json", "any", "jsonschema");
        self.write(channel, log_ns, text.as_bytes().to_vec());
    }

    pub fn joint_state(&mut self, topic: &str, log_ns: u64, state: &JointState) {
        let channel = self.channel(topic, "cdr", "sensor_msgs/msg/JointState", "ros2msg");
        self.write(channel, log_ns, state.cdr());
    }

    pub fn finish(mut self) {
        self.writer.finish().unwrap();
    }
}

/// A joint state; arrays may be empty.
#[derive(Debug, Clone, Default)]
pub struct JointState {
    pub stamp_ns: u64,
    pub frame: String,
    pub names: Vec<String>,
    pub q: Vec<f64>,
    pub dq: Vec<f64>,
    pub tau: Vec<f64>,
    pub big_endian: bool,
}

impl JointState {
    /// As CDR of the first version: padded to the size of each number, counted from after the
    /// four bytes that tell the byte order.
    pub fn cdr(&self) -> Vec<u8> {
        let mut out = Cdr {
            bytes: vec![0, u8::from(!self.big_endian), 0, 0],
            big_endian: self.big_endian,
        };
        out.whole((self.stamp_ns / 1_000_000_000) as usize);
        out.whole((self.stamp_ns % 1_000_000_000) as usize);
        out.text(&self.frame);
        out.whole(self.names.len());
        for name in &self.names {
            out.text(name);
        }
        for numbers in [&self.q, &self.dq, &self.tau] {
            out.whole(numbers.len());
            for number in numbers {
                out.put(number.to_le_bytes());
            }
        }
        out.bytes
    }
}

struct Cdr {
    bytes: Vec<u8>,
    big_endian: bool,
}

impl Cdr {
    fn put<const N: usize>(&mut self, mut little: [u8; N]) {
        if self.big_endian {
            little.reverse();
        }
        let padded = (self.bytes.len() - 4).next_multiple_of(N) + 4;
        self.bytes.resize(padded, 0);
        self.bytes.extend(little);
    }

    fn whole(&mut self, number: usize) {
        self.put((number as u32).to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.whole(text.len() + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }
}
