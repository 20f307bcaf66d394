//! Messages of one topic that come from several publishers: distinguished by their channel and by the names that
//! they list, and those that contradict the others left out.
//!
//! A publisher may list its joints in another order each time. So one with other names, or on another channel, is
//! another machine's only where its numbers are not those of the motion: between two messages of the main
//! publisher they lie outside of both by more than that ever moves from message to message.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::encoding::SchemaReaders;
use super::message::{MessageHead, MessageReader};
use super::parts::MessageFiles;
use super::path::FieldPath;
use super::value::Value;
use crate::log::LogError;

/// Who published a message: its channel, and the order of its names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct MessagePublisher {
    channel: u16,
    order: u64,
}

impl MessagePublisher {
    pub(super) fn of(head: &MessageHead, reader: &dyn MessageReader) -> Self {
        Self {
            channel: head.channel,
            order: reader.order(),
        }
    }
}

/// The publishers of a topic, and which of them a log is read from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct PublisherSet {
    /// Each with whether its messages are used.
    known: Vec<(MessagePublisher, bool)>,
    left_out: u64,
    /// None of the numbers that were left out was other than 0.
    zeros: bool,
    /// The one whose message came last: mostly the next one's too.
    last: Option<MessagePublisher>,
}

impl PublisherSet {
    /// Whether a message is used. Once a second publisher appears, the whole topic is gone through.
    pub(super) fn take(
        &mut self,
        publisher: MessagePublisher,
        (paths, topic): (&[PathBuf], &str),
        fields: &[Vec<FieldPath>],
        values: &[Value],
    ) -> Result<bool, LogError> {
        if self.last == Some(publisher) {
            return Ok(true);
        }
        let known = |of: &Self| {
            let mut known = of.known.iter();
            known.find_map(|(known, used)| (*known == publisher).then_some(*used))
        };
        if known(self).is_none() {
            if !self.known.is_empty() {
                self.known = judged(paths, topic, fields)?;
            }
            if known(self).is_none() {
                self.known.push((publisher, true));
            }
        }
        let used = known(self).unwrap_or(true);
        if used {
            self.last = Some(publisher);
        } else {
            let zero = |value: &Value| value.number().is_none_or(|x| x == 0.0);
            self.zeros = (self.zeros || self.left_out == 0) && values.iter().all(zero);
            self.left_out += 1;
        }
        Ok(used)
    }

    /// Messages of other publishers that were left out, and a sentence on them.
    pub(super) fn left_out(&self, topic: &str) -> Option<(u64, String)> {
        let zeros = if self.zeros { ", all of them zero" } else { "" };
        let count = self.left_out;
        let text = format!(
            "{count} messages of {topic} come from another publisher and contradict the others{zeros}: they are left out"
        );
        (count > 0).then_some((count, text))
    }
}

/// What the messages of one topic showed: how many, their first and last numbers, and their steps.
#[derive(Default)]
struct TopicActivity {
    messages: u64,
    first: Vec<f64>,
    last: Vec<f64>,
    moved: bool,
    /// Largest step of each number from message to message, and its least and largest value.
    steps: Vec<f64>,
    ranges: Vec<[f64; 2]>,
    /// Messages between two of the main publisher, and those of them that are off.
    compared: u64,
    off: u64,
}

impl TopicActivity {
    fn take(&mut self, numbers: &[f64]) {
        self.messages += 1;
        if self.first.is_empty() {
            self.first = numbers.to_vec();
            self.steps = vec![0.0; numbers.len()];
            self.ranges = numbers.iter().map(|x| [*x; 2]).collect();
        } else {
            self.moved |= self.first != numbers;
            for (step, (a, b)) in self.steps.iter_mut().zip(self.last.iter().zip(numbers)) {
                *step = step.max((a - b).abs());
            }
        }
        for ([low, high], x) in self.ranges.iter_mut().zip(numbers) {
            (*low, *high) = (low.min(*x), high.max(*x));
        }
        self.last.clear();
        self.last.extend(numbers);
    }

    /// The largest step of each number; infinite where it is no motion that was sampled finely.
    fn fine_steps(&self) -> Vec<f64> {
        let fine = |(step, [low, high]): (&f64, &[f64; 2])| {
            let fine = *step <= MAX_STEP_SHARE_OF_RANGE * (high - low);
            if fine { *step } else { f64::INFINITY }
        };
        self.steps.iter().zip(&self.ranges).map(fine).collect()
    }
}

/// Every publisher of a topic, and whether its messages are used.
fn judged(
    paths: &[PathBuf],
    topic: &str,
    fields: &[Vec<FieldPath>],
) -> Result<Vec<(MessagePublisher, bool)>, LogError> {
    let mut all: BTreeMap<MessagePublisher, TopicActivity> = BTreeMap::new();
    through(paths, topic, fields, &mut |publisher, numbers| {
        all.entry(publisher).or_default().take(numbers);
    })?;
    let main = all
        .iter()
        .max_by_key(|(_, seen)| (seen.moved, seen.messages))
        .map(|(publisher, _)| *publisher);
    let steps = main.and_then(|main| all.get(&main));
    let steps = steps.map_or_else(Vec::new, TopicActivity::fine_steps);
    let mut before: Option<Vec<f64>> = None;
    let mut between: Vec<(MessagePublisher, Vec<f64>)> = Vec::new();
    through(paths, topic, fields, &mut |publisher, numbers| {
        if Some(publisher) != main {
            if before.is_some() && between.len() < MOST_BETWEEN {
                between.push((publisher, numbers.to_vec()));
            }
            return;
        }
        if let Some(before) = &before {
            for (publisher, own) in between.drain(..) {
                let ends = before.iter().zip(numbers).zip(&steps);
                let off = own
                    .iter()
                    .zip(ends)
                    .any(|(x, ((a, b), step))| *x < a.min(*b) - step || *x > a.max(*b) + step);
                if let Some(seen) = all.get_mut(&publisher) {
                    seen.compared += 1;
                    seen.off += u64::from(off);
                }
            }
        }
        before = Some(numbers.to_vec());
    })?;
    let used = |seen: &TopicActivity| 2 * seen.off <= seen.compared;
    Ok(all.iter().map(|(one, seen)| (*one, used(seen))).collect())
}

/// Share of its range that a number goes from message to message at most where a motion was sampled finely.
const MAX_STEP_SHARE_OF_RANGE: f64 = 0.25;
/// Messages that wait for the next one of the main publisher at most.
const MOST_BETWEEN: usize = 4096;

/// Hands out the numbers of every message of a topic, NaN where it lacks one.
fn through(
    paths: &[PathBuf],
    topic: &str,
    fields: &[Vec<FieldPath>],
    take: &mut dyn FnMut(MessagePublisher, &[f64]),
) -> Result<(), LogError> {
    let mut recording = MessageFiles::open(paths, vec![topic.to_owned()])?;
    let mut readers = SchemaReaders::default();
    let mut values = vec![Value::Absent; fields.len()];
    let mut numbers = Vec::new();
    while let Some(message) = recording.next()? {
        if let Ok(reader) = readers.of(&message.topic.schema, fields)
            && reader.read(message.data, &mut values).is_ok()
        {
            numbers.clear();
            numbers.extend(values.iter().map(|v| v.number().unwrap_or(f64::NAN)));
            take(MessagePublisher::of(&message.head, &**reader), &numbers);
        }
    }
    Ok(())
}

/// Stamps of headers, of which 0 is a time where a simulation begins there, and none of a driver without a clock yet.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct ZeroStamps {
    zeros: u32,
    first: Option<i128>,
    second: Option<i128>,
}

/// Usual steps from a stamp of 0 to the next one where the clock began at 0.
const FROM_ZERO: i128 = 10;

impl ZeroStamps {
    /// Takes the stamps of the first messages \[ns\].
    pub(super) fn take(&mut self, ns: i128) {
        match (ns, self.first) {
            (0, _) => self.zeros += 1,
            (ns, None) => self.first = Some(ns),
            (ns, Some(first)) => self.second = self.second.or(Some(ns).filter(|ns| *ns > first)),
        }
    }

    /// Whether a message that is stamped 0 has a time.
    pub(super) fn are_times(&self) -> bool {
        match (self.zeros, self.first, self.second) {
            (0 | 1, Some(first), Some(second)) => first <= FROM_ZERO * (second - first),
            (0 | 1, ..) => true,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stamp_of_zero_is_a_time_where_the_clock_goes_on_from_it() {
        let of = |all: &[i128]| {
            let mut stamps = ZeroStamps::default();
            all.iter().for_each(|ns| stamps.take(*ns));
            stamps.are_times()
        };
        assert!(of(&[0, 10, 20]));
        assert!(!of(&[0, 0, 0, 30_000, 30_010]));
        assert!(!of(&[0, 30_000, 30_010]));
        assert!(of(&[5, 10]) && of(&[]));
    }
}
