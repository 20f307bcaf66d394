//! A log as an MCAP recording of `sensor_msgs/msg/JointState`, as ROS 2, Foxglove and PlotJuggler
//! open it: one message a row and topic (see [`super::columns`]), its time in the header's stamp.
//!
//! Stamps have nanoseconds. A row whose time is no whole number of them has a message more, on `/t`,
//! with the time as it is, so that no digit is lost.

use std::collections::BTreeMap;
use std::io::{self, Write};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Compression, McapError, McapResult, WriteOptions, Writer};

use super::columns::{self, StateArray, TopicColumns};
use crate::log::Instant;

/// Topic of the times that are no whole nanoseconds.
const TIMES: &str = "/t";

/// `sensor_msgs/msg/JointState` with what it is made of, as ROS 2 defines them, and the units that its comments give.
const JOINT_STATE: &str = "\
std_msgs/Header header
string[] name
float64[] position  # rad or m
float64[] velocity  # rad/s or m/s
float64[] effort    # Nm or N
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";
/// `std_msgs/msg/Float64`.
const FLOAT: &str = "float64 data\n";

pub(super) struct McapLog<W: Write> {
    writer: Writer<NoSeek<W>>,
    topics: Vec<(u16, TopicColumns, Vec<u8>)>,
    /// Channel of the times, once one is needed.
    times: Option<u16>,
    sequence: u32,
    body: Vec<u8>,
}

impl<W: Write> McapLog<W> {
    /// Begins a recording of these columns, of which the first is the time.
    pub(super) fn new(out: W, columns: &[String], notes: &[String]) -> McapResult<Self> {
        let mut writer = options().create(NoSeek::new(out))?;
        let kind = "sensor_msgs/msg/JointState";
        let schema = writer.add_schema(kind, "ros2msg", JOINT_STATE.as_bytes())?;
        let mut topics = Vec::new();
        for topic in columns::topics(columns) {
            let channel = writer.add_channel(schema, &topic.name, "cdr", &quality())?;
            let names = cdr_names(&topic.names);
            topics.push((channel, topic, names));
        }
        if !notes.is_empty() {
            writer.write_metadata(&metadata(notes))?;
        }
        Ok(Self {
            writer,
            topics,
            times: None,
            sequence: 0,
            body: Vec::new(),
        })
    }

    pub(super) fn row(&mut self, origin: Instant, row: &[f64]) -> McapResult<()> {
        let t = row.first().copied().unwrap_or(f64::NAN);
        let (stamp, exact) = stamp(origin, t)?;
        self.sequence = self.sequence.wrapping_add(1);
        let header = |channel_id| header(channel_id, self.sequence, stamp);
        if !exact {
            let channel = match self.times {
                Some(channel) => channel,
                None => {
                    let channel = channel(&mut self.writer, TIMES, "std_msgs/msg/Float64", FLOAT)?;
                    *self.times.insert(channel)
                }
            };
            self.body.clear();
            self.body.extend([0, 1, 0, 0]);
            self.body.extend(t.to_le_bytes());
            let header = header(channel);
            self.writer.write_to_known_channel(&header, &self.body)?;
        }
        for (channel, topic, names) in &self.topics {
            message(&mut self.body, stamp, topic, names, row);
            let header = header(*channel);
            self.writer.write_to_known_channel(&header, &self.body)?;
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> McapResult<W> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner())
    }
}

fn channel<W: Write>(
    writer: &mut Writer<NoSeek<W>>,
    topic: &str,
    kind: &str,
    definition: &str,
) -> McapResult<u16> {
    let schema = writer.add_schema(kind, "ros2msg", definition.as_bytes())?;
    writer.add_channel(schema, topic, "cdr", &quality())
}

/// The header of a message at a time [ns].
fn header(channel_id: u16, sequence: u32, stamp: i128) -> MessageHeader {
    let log_time = u64::try_from(stamp).unwrap_or(0);
    MessageHeader {
        channel_id,
        sequence,
        log_time,
        publish_time: log_time,
    }
}

fn metadata(notes: &[String]) -> Metadata {
    let numbered = notes.iter().enumerate();
    Metadata {
        name: "notes".to_owned(),
        metadata: numbered
            .map(|(i, note)| (format!("{:02}", i + 1), note.clone()))
            .collect(),
    }
}

/// How recordings are written. One thread compresses: the number of threads shows in the bytes.
fn options() -> WriteOptions {
    WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_threads(0)
        .profile("ros2")
        .library(concat!("cft-ident ", env!("CARGO_PKG_VERSION")))
        .disable_seeking(true)
}

/// What a recorder of ROS 2 notes of each topic.
fn quality() -> BTreeMap<String, String> {
    BTreeMap::from([("offered_qos_profiles".to_owned(), String::new())])
}

/// Whole nanoseconds of a time, and whether they give it back bit for bit.
fn stamp(origin: Instant, t: f64) -> io::Result<(i128, bool)> {
    if !t.is_finite() {
        let problem = "a row without a time cannot become a message";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, problem));
    }
    let ns = origin.later(t).nanoseconds();
    let exact = Instant::from_ns(ns).since(origin) == t;
    Ok((ns, exact))
}

/// A list of names as CDR, without alignment before it.
fn cdr_names(names: &[String]) -> Vec<u8> {
    let mut out = Vec::new();
    out.extend((names.len() as u32).to_le_bytes());
    for name in names {
        text(&mut out, name);
    }
    out
}

/// Appends a text, aligned to four bytes before and after it.
fn text(out: &mut Vec<u8>, text: &str) {
    out.extend((text.len() as u32 + 1).to_le_bytes());
    out.extend(text.as_bytes());
    out.push(0);
    while !out.len().is_multiple_of(4) {
        out.push(0);
    }
}

/// A `JointState` as little-endian CDR.
fn message(out: &mut Vec<u8>, stamp_ns: i128, topic: &TopicColumns, names: &[u8], row: &[f64]) {
    out.clear();
    out.extend([0, 1, 0, 0]);
    let second = 1_000_000_000;
    let (sec, nanosec) = (stamp_ns.div_euclid(second), stamp_ns.rem_euclid(second));
    let sec = i32::try_from(sec).unwrap_or(if sec < 0 { i32::MIN } else { i32::MAX });
    out.extend(sec.to_le_bytes());
    out.extend((nanosec as u32).to_le_bytes());
    // an empty frame_id, padded
    out.extend([1, 0, 0, 0, 0, 0, 0, 0]);
    out.extend(names);
    for array in [
        StateArray::Position,
        StateArray::Velocity,
        StateArray::Effort,
    ] {
        let columns = topic.arrays.iter().find(|(kind, _)| *kind == array);
        let columns = columns.map_or(&[][..], |(_, columns)| columns);
        doubles(out, columns.iter().map(|column| row[*column]));
    }
}

/// Appends a list of numbers to CDR.
fn doubles(out: &mut Vec<u8>, values: impl ExactSizeIterator<Item = f64>) {
    out.extend((values.len() as u32).to_le_bytes());
    // Alignment counts from after the first four bytes.
    while values.len() > 0 && !(out.len() - 4).is_multiple_of(8) {
        out.push(0);
    }
    values.for_each(|x| out.extend(x.to_le_bytes()));
}

/// The error of the system, or that of the format.
pub(super) fn plain(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other.to_string()),
    }
}
