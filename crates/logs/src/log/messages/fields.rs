//! What is asked of a message: the channels of the robot and the time, and where they may stand.

use std::ops::Range;

use super::message::MessageHead;
use super::path::FieldPath;
use super::value::{Value, stamp_ns};
use crate::log::layout::{Channel, Layout, column_number};
use crate::log::time::{FAR_S, Instant, RowTime};
use cft_ident_core::number::is_usable;

/// The fields of one robot in messages, each with the paths that it may have.
#[derive(Debug, Clone)]
pub(super) struct RobotFields {
    pub(super) paths: Vec<Vec<FieldPath>>,
    pub(super) positions: Range<usize>,
    pub(super) torques: Range<usize>,
    pub(super) velocities: Range<usize>,
    /// Index of the time that the robot file names.
    time: usize,
    /// Indices of the header's seconds and nanoseconds.
    header: [usize; 2],
    /// Seconds per unit of the time field.
    time_factor: f64,
}

/// Which time of a message counts, once it is decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TimeSource {
    Field,
    Header,
    Log,
    Publish,
}

impl RobotFields {
    pub(super) fn new(layout: &Layout) -> Self {
        let mut paths: Vec<Vec<FieldPath>> = Vec::new();
        let mut add = |channels: &[Channel], field: &str| -> Range<usize> {
            let from = paths.len();
            for (index, channel) in channels.iter().enumerate() {
                let mut places = Vec::new();
                if column_number(&channel.column).is_none() {
                    places.push(FieldPath::parse(&channel.column));
                }
                if let Some(joint) = layout.name_in_messages(index) {
                    // no list of messages is usually one of temperatures: as an entry of the column's name among
                    // others, but for a topic that is said to hold them
                    let among_others = layout.temperatures && layout.section.topic.is_none();
                    let name = match among_others {
                        true => &channel.column,
                        false => joint,
                    };
                    places.push(FieldPath::named(field, "name", name));
                }
                paths.push(places);
            }
            from..paths.len()
        };
        let positions = add(&layout.positions, "position");
        let torques = add(&layout.torques, "effort");
        let velocities = add(&layout.velocities, "velocity");
        let time = paths.len();
        let named = layout.time.key.is_some() && column_number(&layout.time.column).is_none();
        paths.push(match named {
            true => vec![FieldPath::parse(&layout.time.column)],
            false => Vec::new(),
        });
        // ROS 2, ROS 1, and the stamps of Foxglove's messages as protobuf and JSON.
        let parse = |texts: &[&str]| texts.iter().map(|text| FieldPath::parse(text)).collect();
        paths.push(parse(&[
            "header.stamp.sec",
            "header.stamp.secs",
            "timestamp.seconds",
            "timestamp.sec",
        ]));
        paths.push(parse(&[
            "header.stamp.nanosec",
            "header.stamp.nsecs",
            "timestamp.nanos",
            "timestamp.nsec",
        ]));
        Self {
            paths,
            positions,
            torques,
            velocities,
            time,
            header: [time + 1, time + 2],
            time_factor: layout.time.factor,
        }
    }

    /// Whether a message holds every field of a range, and the range is not empty.
    pub(super) fn all(values: &[Value], range: &Range<usize>) -> bool {
        !range.is_empty() && !values[range.clone()].contains(&Value::Absent)
    }

    pub(super) fn has_time(&self, values: &[Value]) -> bool {
        values[self.time] != Value::Absent
    }

    /// The stamp of a message's header \[ns\].
    pub(super) fn header_ns(&self, values: &[Value]) -> Option<i128> {
        stamp_ns(values[self.header[0]], values[self.header[1]])
    }

    /// Whether a message has a header with a stamp other than 0.
    pub(super) fn has_header(&self, values: &[Value]) -> bool {
        self.header_ns(values).is_some_and(|ns| ns != 0)
    }

    /// Time of a message; `None` where it has none of this kind.
    pub(super) fn stamp(
        &self,
        values: &[Value],
        head: &MessageHead,
        source: TimeSource,
    ) -> Option<RowTime> {
        match source {
            TimeSource::Log => Some(RowTime::Exact(Instant::from_ns(head.log_ns))),
            TimeSource::Publish => Some(RowTime::Exact(Instant::from_ns(head.publish_ns))),
            TimeSource::Header => {
                let part = |index: usize| values[index].integer()?.try_into().ok();
                let (s, ns): (i64, i64) = (part(self.header[0])?, part(self.header[1])?);
                Some(RowTime::Exact(Instant::from_s_ns(s, ns)))
            }
            TimeSource::Field => match values[self.time] {
                Value::Absent => None,
                Value::Float(value) => {
                    let seconds = value * self.time_factor;
                    is_usable(seconds).then(|| match seconds.abs() < FAR_S {
                        true => RowTime::Seconds(seconds),
                        false => RowTime::Exact(Instant::default().plus(seconds)),
                    })
                }
                whole => {
                    let value = whole.integer()?;
                    // Units of time are whole numbers of nanoseconds.
                    let ns = (self.time_factor * 1e9).round() as i128;
                    Some(RowTime::Exact(Instant::from_ns(value.checked_mul(ns)?)))
                }
            },
        }
    }
}

/// Fields of the last message that lacked some.
#[derive(Debug, Clone, Default)]
pub(super) struct PartialMessage {
    /// Its instant \[ns\]; none where nothing waits.
    instant: Option<i128>,
    values: Vec<Value>,
    waiting: u64,
}

impl PartialMessage {
    /// Fills in what messages of the same instant held; how many of those this one makes whole.
    pub(super) fn join(
        &mut self,
        fields: &RobotFields,
        head: &MessageHead,
        values: &mut [Value],
    ) -> u64 {
        let channels = 0..fields.time;
        let absent = |values: &[Value]| values[channels.clone()].contains(&Value::Absent);
        if !absent(values) {
            self.instant = None;
            return 0;
        }
        let stamped = fields.header_ns(values).filter(|ns| *ns != 0);
        let instant = stamped.unwrap_or(i128::from(head.log_ns));
        if self.instant.replace(instant) == Some(instant) {
            for (value, known) in values[channels.clone()].iter_mut().zip(&self.values) {
                if *value == Value::Absent {
                    *value = *known;
                }
            }
        } else {
            self.waiting = 0;
        }
        self.values.clear();
        self.values.extend(&values[channels.clone()]);
        self.waiting += 1;
        match absent(values) {
            true => 0,
            false => std::mem::take(&mut self.waiting) - 1,
        }
    }
}
