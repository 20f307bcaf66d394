//! Messages of a recording as rows of channels in SI units.

use std::path::PathBuf;

use super::encoding::SchemaReaders;
use super::fields::{PartialMessage, RobotFields, TimeSource};
use super::message::refused;
use super::pairing::{Sample, TorquePairing};
use super::parts::{Message, MessageFiles};
use super::sources::{MessagePublisher, PublisherSet};
use super::survey::{self, TopicChoice};
use super::value::Value;
use crate::log::layout::{Channel, Layout};
use crate::log::rows::{LogRows, counted};
use crate::log::time::RowTime;
use crate::log::{Block, LogError, escape, source};
use cft_ident_core::number::{beyond, is_usable};

pub(in crate::log) struct MessageRows {
    recording: MessageFiles,
    reading: SampleReader,
    pairing: Option<TorquePairing>,
    row: Sample,
    previous: Sample,
    messages: u64,
    /// Names of the columns: of the time, and of what the samples hold.
    names: Vec<String>,
}

struct SampleReader {
    layout: Layout,
    fields: RobotFields,
    choice: TopicChoice,
    readers: SchemaReaders,
    values: Vec<Value>,
    /// Messages that lack a joint or a time, and those that cannot be decoded, with the first reason.
    incomplete: LeftOut,
    unreadable: LeftOut,
    /// Messages that were stamped 0 before the clock was known.
    unstamped: u64,
    /// Whether a message with a stamp was read, and whether one without came before it.
    begun: bool,
    begins_unstamped: bool,
    /// Files of the recording, and who publishes on the topics of positions and of torques.
    paths: Vec<PathBuf>,
    publishers: [PublisherSet; 2],
    parts: [PartialMessage; 2],
}

#[derive(Default)]
struct LeftOut {
    count: u64,
    first: String,
}

impl LeftOut {
    fn add(&mut self, reason: impl FnOnce() -> String) {
        if self.count == 0 {
            self.first = reason();
        }
        self.count += 1;
    }
}

/// What a message gives to a row.
#[derive(Clone, Copy, PartialEq, Eq)]
enum SampleContent {
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
        let fields = RobotFields::new(&layout);
        let pairing = choice
            .torque_topic
            .is_some()
            .then(|| TorquePairing::new(&layout));
        let velocities = match choice.velocities {
            true => &layout.velocities[..],
            false => &[],
        };
        let channels = (layout.positions.iter())
            .chain(&layout.torques)
            .chain(velocities);
        let channels = channels.map(|channel| channel.column.clone());
        let rows = Self {
            names: std::iter::once("t".to_owned()).chain(channels).collect(),
            recording: MessageFiles::open(paths, names)?,
            pairing,
            row: Sample::default(),
            previous: Sample::default(),
            messages: 0,
            reading: SampleReader {
                values: vec![Value::Absent; fields.paths.len()],
                layout: layout.clone(),
                fields,
                choice,
                readers: SchemaReaders::default(),
                incomplete: LeftOut::default(),
                unreadable: LeftOut::default(),
                unstamped: 0,
                begun: false,
                begins_unstamped: false,
                paths: paths.to_vec(),
                publishers: Default::default(),
                parts: Default::default(),
            },
        };
        Ok((rows, layout))
    }

    fn append_part(
        &self,
        channels: &[Channel],
        numbers: &[f64],
        to: &mut Vec<f64>,
    ) -> Result<(), LogError> {
        for (channel, number) in channels.iter().zip(numbers) {
            let value = number * channel.factor + channel.offset;
            if !is_usable(value) {
                return Err(LogError::NotFinite {
                    at: self.place(),
                    column: escape(&channel.column),
                    text: format!("{number:?}{}", beyond(value)),
                    remedy: "leave it out, or write the channel's unit and scale into [log.joint] of the robot file",
                });
            }
            to.push(value);
        }
        Ok(())
    }
}

impl LogRows for MessageRows {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        std::mem::swap(&mut self.row, &mut self.previous);
        loop {
            if let Some(pairing) = &mut self.pairing
                && pairing.take(&mut self.row)
            {
                return Ok(Some(self.row.stamp));
            }
            let Some(message) = self.recording.next()? else {
                let incomplete = &self.reading.incomplete;
                if self.reading.begun || incomplete.count == 0 {
                    return Ok(None);
                }
                let problem = format!(
                    "none of {} messages holds every channel of the robot (the first: {})",
                    self.messages, incomplete.first
                );
                let remedy = "record again with that channel, or name another one in [log.joint] of the robot file";
                return Err(refused(&self.reading.paths, problem, remedy));
            };
            self.messages += 1;
            let Some(part) = self.reading.read(&message, &mut self.row)? else {
                continue;
            };
            match (&mut self.pairing, part) {
                (None, _) | (_, SampleContent::Whole) => return Ok(Some(self.row.stamp)),
                (Some(pairing), SampleContent::Positions) => pairing.add_positions(&mut self.row),
                (Some(pairing), SampleContent::Torques) => pairing.add_torques(&mut self.row),
            }
        }
    }

    fn append(&self, block: &mut Block) -> Result<(), LogError> {
        let layout = &self.reading.layout;
        self.append_part(&layout.positions, &self.row.q, &mut block.q)?;
        self.append_part(&layout.torques, &self.row.tau, &mut block.tau)?;
        if self.has_velocities() {
            // nothing is fitted to velocities: what was not measured is no reason to refuse a row
            let scaled = layout.velocities.iter().zip(&self.row.dq);
            let scaled = scaled.map(|(channel, x)| x * channel.factor + channel.offset);
            block
                .dq
                .extend(scaled.map(|x| if is_usable(x) { x } else { f64::NAN }));
        }
        Ok(())
    }

    fn takes_delay(&self) -> bool {
        self.pairing.is_some()
    }

    fn has_velocities(&self) -> bool {
        self.reading.choice.velocities
    }

    fn begins(&self) -> Option<f64> {
        // the clock began at 0, before it was published
        let near = !self.row.stamp.instant().is_far();
        (self.reading.begins_unstamped && near).then_some(0.0)
    }

    fn repeats(&self) -> bool {
        let (a, b) = (&self.row, &self.previous);
        a.stamp == b.stamp && a.q == b.q && a.tau == b.tau && a.dq == b.dq
    }

    #[cold]
    fn place(&self) -> String {
        format!(
            "{}: message {} ({})",
            self.row.file,
            self.row.number,
            escape(&self.reading.choice.topic)
        )
    }

    #[cold]
    fn clock_remedy(&self) -> Option<String> {
        let remedy = match self.reading.choice.time {
            TimeSource::Log => {
                "its messages lie in another order than that of their times: sort it first, `mcap sort IN.mcap -o OUT.mcap`"
            }
            _ => "take the times of recording, `stamp = \"log\"` in [log] of the robot file",
        };
        Some(remedy.to_owned())
    }

    fn number(&self) -> u64 {
        self.row.number
    }

    fn logged(&self, column: usize) -> Option<f64> {
        let mut numbers = (self.row.q.iter()).chain(&self.row.tau).chain(&self.row.dq);
        numbers.nth(column.checked_sub(1)?).copied()
    }

    fn breaks(&self) -> Vec<String> {
        let messages = self.messages;
        self.recording
            .breaks(&format!(", {messages} messages of the robot's topics"))
    }

    fn contradictions(&self) -> Vec<(u64, String)> {
        let choice = &self.reading.choice;
        let topics = [Some(&choice.topic), choice.torque_topic.as_ref()];
        let each = self.reading.publishers.iter().zip(topics);
        each.filter_map(|(publishers, topic)| publishers.left_out(&escape(topic?)))
            .collect()
    }

    fn warnings(&self) -> Vec<String> {
        let mut out = self.reading.choice.notes.clone();
        let reading = &self.reading;
        out.extend(self.breaks());
        let topic = escape(&reading.choice.topic);
        for (LeftOut { count, first }, why) in [
            (&reading.incomplete, "lack a channel of the robot"),
            (&reading.unreadable, "cannot be decoded"),
        ] {
            let messages = self.messages;
            let text =
                format!("of {messages} messages are left out: they {why} (the first: {first})");
            out.extend(counted(*count, &text));
        }
        let unset = format!(
            "messages of {topic} are stamped 0, before their clock was set, and are left out"
        );
        out.extend(counted(reading.unstamped, &unset));
        out.extend(self.contradictions().into_iter().map(|(_, text)| text));
        if let (Some(pairing), Some(torques)) = (&self.pairing, &reading.choice.torque_topic) {
            out.extend(pairing.warnings(&topic, &escape(torques)));
        }
        out
    }
}

impl SampleReader {
    /// Reads one message into a sample; `None` where it is left out.
    fn read(
        &mut self,
        message: &Message<'_>,
        sample: &mut Sample,
    ) -> Result<Option<SampleContent>, LogError> {
        let Message {
            path,
            topic,
            head,
            data,
        } = message;
        let (schema, topic) = (&topic.schema, &topic.name);
        let place = || format!("message {} of {}", head.number, escape(topic));
        let read = match self.readers.of(schema, &self.fields.paths) {
            Ok(reader) => reader.read(data, &mut self.values).map(|()| reader),
            Err(reason) => Err(reason.clone()),
        };
        let reader = match read {
            Ok(reader) => reader,
            Err(reason) => {
                self.unreadable
                    .add(|| format!("{}: {}", place(), escape(&reason)));
                return Ok(None);
            }
        };
        let unset = self.choice.time == TimeSource::Header && !self.choice.zero_is_time;
        if unset && self.fields.header_ns(&self.values) == Some(0) {
            self.unstamped += 1;
            self.begins_unstamped |= !self.begun;
            return Ok(None);
        }
        let part = match &self.choice.torque_topic {
            None => SampleContent::Whole,
            Some(torques) if torques == topic => SampleContent::Torques,
            Some(_) => SampleContent::Positions,
        };
        let of = usize::from(part == SampleContent::Torques);
        let fields = &self.fields;
        let (q, tau) = (fields.positions.clone(), fields.torques.clone());
        let (needed, q, tau) = match part {
            SampleContent::Whole => (q.start..tau.end, q, tau),
            SampleContent::Positions => (q.clone(), q, 0..0),
            SampleContent::Torques => (tau.clone(), 0..0, tau),
        };
        let dq = match self.choice.velocities && part != SampleContent::Torques {
            true => fields.velocities.clone(),
            false => 0..0,
        };
        let publisher = MessagePublisher::of(head, &**reader);
        let (paths, numbers) = (&fields.paths[needed.clone()], &self.values[needed.clone()]);
        let at = (&*self.paths, &**topic);
        if !self.publishers[of].take(publisher, at, paths, numbers)? {
            return Ok(None);
        }
        if self.values[needed].contains(&Value::Absent) {
            let joined = self.parts[of].join(fields, head, &mut self.values);
            // the last so many were not left out after all
            self.incomplete.count = self.incomplete.count.saturating_sub(joined);
        }
        let values = &self.values;
        let Some(stamp) = fields.stamp(values, head, self.choice.time) else {
            self.incomplete.add(|| format!("{}: no time", place()));
            return Ok(None);
        };
        let parts = [
            (q, &mut sample.q),
            (tau, &mut sample.tau),
            (dq, &mut sample.dq),
        ];
        for (range, to) in parts {
            to.clear();
            for index in range {
                // nothing is fitted to velocities; of the others one that is no number was not measured
                let read = values[index].number();
                let measured = |x: &f64| is_usable(*x) || fields.velocities.contains(&index);
                let Some(number) = read.filter(measured) else {
                    self.incomplete.add(|| {
                        let path = fields.paths[index].last();
                        let path = path.map_or("", |path| path.text());
                        match reader.uneven() {
                            Some(uneven) => format!("in {} {uneven}", place()),
                            None if read.is_some() => {
                                format!("{} holds no number as `{}`", place(), escape(path))
                            }
                            None => format!("{} has no `{}`", place(), escape(path)),
                        }
                    });
                    return Ok(None);
                };
                to.push(number);
            }
        }
        sample.stamp = stamp;
        self.begun = true;
        sample.number = head.number;
        if sample.path != *path {
            sample.path = (*path).to_owned();
            sample.file = source::shown(path);
        }
        Ok(Some(part))
    }
}
