//! Messages of a recording as rows of channels in SI units.

use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::container::{Recording, Wanted};
use super::decode::{Decoder, Schema};
use super::fields::{Fields, TimeSource};
use super::pairing::{Pairing, Sample};
use super::survey::{self, Choice};
use super::value::Value;
use crate::log::layout::{Channel, Layout};
use crate::log::row::Stamped;
use crate::log::{Block, LogError, escape, source};

/// The rows of a recording.
pub(in crate::log) struct MessageRows {
    recording: Recording,
    reading: Reading,
    pairing: Option<Pairing>,
    row: Sample,
    previous: Sample,
    messages: u64,
    notes: Vec<String>,
}

/// How messages become samples.
struct Reading {
    layout: Layout,
    fields: Fields,
    choice: Choice,
    decoders: Vec<(Arc<Schema>, Result<Decoder, String>)>,
    values: Vec<Value>,
    /// Messages that lack a joint or a time, and those that cannot be decoded, with the first reason.
    incomplete: Count,
    unreadable: Count,
}

#[derive(Default)]
struct Count {
    count: u64,
    first: String,
}

impl Count {
    fn add(&mut self, reason: impl FnOnce() -> String) {
        if self.count == 0 {
            self.first = reason();
        }
        self.count += 1;
    }
}

impl fmt::Debug for MessageRows {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MessageRows")
            .field("choice", &self.reading.choice)
            .finish_non_exhaustive()
    }
}

/// What a message holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Whole,
    Positions,
    Torques,
}

impl MessageRows {
    /// Opens a recording and finds the channels in it; the layout that it turns out to have.
    pub(in crate::log) fn open(
        paths: &[PathBuf],
        layout: &Layout,
    ) -> Result<(Self, Layout), LogError> {
        let (choice, layout) = survey::choose(paths, layout)?;
        let mut names = vec![choice.topic.clone()];
        names.extend(choice.torque_topic.clone());
        let fields = Fields::new(&layout);
        let pairing = choice
            .torque_topic
            .is_some()
            .then(|| Pairing::new(&layout.messages));
        let rows = Self {
            recording: Recording::open(paths, Wanted { names })?,
            pairing,
            row: Sample::default(),
            previous: Sample::default(),
            messages: 0,
            notes: choice.notes.clone(),
            reading: Reading {
                values: vec![Value::Absent; fields.paths.len()],
                layout: layout.clone(),
                fields,
                choice,
                decoders: Vec::new(),
                incomplete: Count::default(),
                unreadable: Count::default(),
            },
        };
        Ok((rows, layout))
    }

    /// Goes on to the next row; its time, or `None` at the end.
    pub(in crate::log) fn next(&mut self) -> Result<Option<Stamped>, LogError> {
        std::mem::swap(&mut self.row, &mut self.previous);
        loop {
            if let Some(pairing) = &mut self.pairing
                && pairing.take(&mut self.row)
            {
                return Ok(Some(self.row.stamp));
            }
            let Some(message) = self.recording.next()? else {
                return Ok(None);
            };
            self.messages += 1;
            let Some(part) = self.reading.read(
                message.path,
                &message.topic.name,
                &message.topic.schema,
                message.head,
                message.data,
                &mut self.row,
            )?
            else {
                continue;
            };
            match (&mut self.pairing, part) {
                (None, _) | (_, Part::Whole) => return Ok(Some(self.row.stamp)),
                (Some(pairing), Part::Positions) => pairing.add_positions(&mut self.row),
                (Some(pairing), Part::Torques) => pairing.add_torques(&mut self.row),
            }
        }
    }

    /// Appends positions, torques and velocities of the current row to the block.
    pub(in crate::log) fn append(&self, block: &mut Block) -> Result<(), LogError> {
        let layout = &self.reading.layout;
        self.append_part(&layout.positions, &self.row.q, &mut block.q)?;
        self.append_part(&layout.torques, &self.row.tau, &mut block.tau)?;
        if self.has_velocities() {
            self.append_part(&layout.velocities, &self.row.dq, &mut block.dq)?;
        }
        Ok(())
    }

    fn append_part(
        &self,
        channels: &[Channel],
        numbers: &[f64],
        to: &mut Vec<f64>,
    ) -> Result<(), LogError> {
        for (channel, number) in channels.iter().zip(numbers) {
            let value = number * channel.factor + channel.offset;
            if !value.is_finite() {
                return Err(LogError::NotFinite {
                    at: self.place(),
                    column: escape(&channel.column),
                    text: number.to_string(),
                    remedy: "use the parts before and after it as two logs, FILE@0..10s and FILE@10.1..s: a made-up number is worse than a gap",
                });
            }
            to.push(value);
        }
        Ok(())
    }

    pub(in crate::log) fn has_velocities(&self) -> bool {
        self.reading.choice.velocities
    }

    /// Whether the current row equals the one before it.
    pub(in crate::log) fn repeats(&self) -> bool {
        let (a, b) = (&self.row, &self.previous);
        a.stamp == b.stamp && a.q == b.q && a.tau == b.tau && a.dq == b.dq
    }

    /// File, topic and message of the current row.
    #[cold]
    pub(in crate::log) fn place(&self) -> String {
        format!(
            "{}: message {} ({})",
            self.row.file,
            self.row.number,
            escape(&self.reading.choice.topic)
        )
    }

    /// What to do about a time that is not later than the one before, `t` being that of the row.
    #[cold]
    pub(in crate::log) fn clock_remedy(&self, t: f64) -> String {
        let part = format!("use the part before it: FILE@0..{t}s");
        match self.reading.choice.time {
            TimeSource::Log => part,
            _ => format!(
                "take the times of recording, `stamp = \"log\"` in [log] of the robot file, or {part}"
            ),
        }
    }

    /// Number of the message in its file.
    pub(in crate::log) fn number(&self) -> u64 {
        self.row.number
    }

    /// A number of the current row as logged, not scaled: positions, then torques, then velocities.
    pub(in crate::log) fn logged(&self, index: usize) -> f64 {
        let mut numbers = (self.row.q.iter()).chain(&self.row.tau).chain(&self.row.dq);
        numbers.nth(index).copied().unwrap_or(f64::NAN)
    }

    /// Where files break off, once that is known.
    pub(in crate::log) fn breaks(&self) -> Vec<String> {
        let broken = self.recording.broken.iter();
        broken
            .map(|(path, broken)| {
                format!(
                    "{} breaks off {} ({}): everything before is used, {} messages of the robot's topics",
                    escape(&source::file_name(path)),
                    broken.place,
                    escape(&broken.reason),
                    self.messages
                )
            })
            .collect()
    }

    /// What was left out or chosen on the way.
    pub(in crate::log) fn warnings(&self) -> Vec<String> {
        let mut out = self.notes.clone();
        let reading = &self.reading;
        out.extend(self.breaks());
        let topic = escape(&reading.choice.topic);
        if reading.incomplete.count > 0 {
            out.push(format!(
                "{} of {} messages are left out: they lack a channel of the robot (the first: {})",
                reading.incomplete.count, self.messages, reading.incomplete.first
            ));
        }
        if reading.unreadable.count > 0 {
            out.push(format!(
                "{} of {} messages are left out: they cannot be decoded (the first: {})",
                reading.unreadable.count, self.messages, reading.unreadable.first
            ));
        }
        if let (Some(pairing), Some(torques)) = (&self.pairing, &reading.choice.torque_topic) {
            out.extend(pairing.warnings(&topic, &escape(torques)));
        }
        out
    }
}

impl Reading {
    /// Reads one message into a sample; `None` where it is left out.
    fn read(
        &mut self,
        path: &Path,
        topic: &str,
        schema: &Arc<Schema>,
        head: super::container::Head,
        data: &[u8],
        sample: &mut Sample,
    ) -> Result<Option<Part>, LogError> {
        let place = || format!("message {} of {}", head.number, escape(topic));
        let known = self.decoders.iter().position(|(s, _)| s == schema);
        let index = known.unwrap_or_else(|| {
            let decoder = Decoder::new(schema, &self.fields.paths);
            self.decoders.push((schema.clone(), decoder));
            self.decoders.len() - 1
        });
        let read = match &mut self.decoders[index].1 {
            Ok(decoder) => decoder.read(data, &mut self.values),
            Err(reason) => Err(reason.clone()),
        };
        if let Err(reason) = read {
            self.unreadable
                .add(|| format!("{}: {}", place(), escape(&reason)));
            return Ok(None);
        }
        let (fields, values) = (&self.fields, &self.values);
        let Some(stamp) = fields.stamp(values, &head, self.choice.time) else {
            self.incomplete.add(|| format!("{}: no time", place()));
            return Ok(None);
        };
        let part = match &self.choice.torque_topic {
            None => Part::Whole,
            Some(torques) if torques == topic => Part::Torques,
            Some(_) => Part::Positions,
        };
        let none = || 0..0;
        let (q, tau, dq): (Range<usize>, Range<usize>, Range<usize>) = match part {
            Part::Whole => (
                fields.positions.clone(),
                fields.torques.clone(),
                fields.velocities.clone(),
            ),
            Part::Positions => (fields.positions.clone(), none(), fields.velocities.clone()),
            Part::Torques => (none(), fields.torques.clone(), none()),
        };
        let dq = if self.choice.velocities { dq } else { none() };
        let parts = [
            (q, &mut sample.q),
            (tau, &mut sample.tau),
            (dq, &mut sample.dq),
        ];
        for (range, to) in parts {
            to.clear();
            for index in range {
                let Some(number) = values[index].number() else {
                    self.incomplete.add(|| {
                        let path = fields.paths[index].last();
                        let path = path.map_or("", |path| path.text());
                        format!("{} has no `{}`", place(), escape(path))
                    });
                    return Ok(None);
                };
                to.push(number);
            }
        }
        sample.stamp = stamp;
        sample.number = head.number;
        if sample.path != path {
            sample.path = path.to_owned();
            sample.file = source::shown(path);
        }
        Ok(Some(part))
    }
}
