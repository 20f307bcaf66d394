//! Every `JointState` of a recording as one table, whatever robot it is of.
//!
//! The topic of the joints gives `q_<joint>`, `tau_<joint>`, `dq_<joint>`; another topic puts its own
//! name before that of the joint. Messages of one instant are one row.

use std::path::PathBuf;

use super::encoding::reader_of;
use super::message::{MessageHead, MessageReader, Schema, UnevenArray, refused};
use super::parts::MessageFiles;
use super::path::FieldPath;
use super::sources::{MessagePublisher, PublisherSet};
use super::state_topics::{
    ARRAYS, COLUMNS, FoundTopic, TIMES, TimeReader, TopicSurvey, groups, header_stamp, survey,
};
use super::value::{Value, stamp_ns};
use crate::log::LogError;
use crate::log::names::{escape, list, suggestion};
use crate::log::rows::{LogRows, counted};
use crate::log::time::{Instant, RowTime};

/// What is wrong with a recording without joint states.
const NO_STATES: &str = "no topic holds sensor_msgs/msg/JointState";

/// Whether a recording was refused because it has no joint states at all.
pub(in crate::log) fn has_none(error: &LogError) -> bool {
    matches!(error, LogError::Topic { problem, .. } if problem == NO_STATES)
}

struct StateTopic {
    topic: String,
    schema: Schema,
    reader: Box<dyn MessageReader>,
    values: Vec<Value>,
    first: usize,
    stamped: bool,
    zero_is_time: bool,
    fields: Vec<Vec<FieldPath>>,
    publishers: PublisherSet,
    /// Messages with an array that cannot be given to joints, and the first of them.
    uneven: u64,
    first_uneven: Option<UnevenArray>,
}

#[derive(Default)]
struct StateRow {
    key: i128,
    /// The time where it is no whole nanosecond.
    exact: Option<f64>,
    values: Vec<f64>,
    sources: Vec<bool>,
    full: bool,
}

pub(in crate::log) struct JointStates {
    recording: MessageFiles,
    sources: Vec<StateTopic>,
    times: TimeReader,
    columns: Vec<String>,
    row: StateRow,
    /// The row that begins with the message after this row.
    ahead: StateRow,
    /// A time that waits for its row: when it was recorded, and what it is.
    exact: Option<(u64, f64)>,
    other_topics: Vec<String>,
    unreadable: u64,
    incomplete: u64,
    /// Messages that were stamped 0 before the clock was known.
    unstamped: u64,
    /// Whether a message with a stamp was read, and whether one without came before it.
    begun: bool,
    begins_unstamped: bool,
    paths: Vec<PathBuf>,
}

impl JointStates {
    /// Finds the topics, those of `topic` and of what was recorded at its instants where one is named.
    pub(in crate::log) fn open(paths: &[PathBuf], topic: Option<&str>) -> Result<Self, LogError> {
        let TopicSurvey {
            mut found,
            others: mut other_topics,
            times,
            cause,
        } = survey(paths)?;
        if found.is_empty() {
            return Err(match cause {
                Some((problem, remedy)) => refused(paths, problem, remedy),
                None => refused(
                    paths,
                    NO_STATES,
                    format!(
                        "say with a robot file (-r) which fields are the channels; the topics are {}",
                        list(other_topics.iter().map(String::as_str))
                    ),
                ),
            });
        }
        let groups = groups(&found);
        let names = || groups.iter().map(|group| found[group[0]].topic.as_str());
        let chosen = match (topic, &groups[..]) {
            (None, [only]) => only,
            (None, several) => {
                let count = several.len();
                return Err(refused(
                    paths,
                    format!("holds {count} topics of joint states with instants of their own"),
                    format!("name one with --topic: {}", list(names())),
                ));
            }
            (Some(name), groups) => {
                let has = |group: &&Vec<usize>| group.iter().any(|k| found[*k].topic == name);
                groups.iter().find(has).ok_or_else(|| {
                    let near = suggestion(name, names());
                    refused(
                        paths,
                        format!("no joint states on topic `{}`", escape(name)),
                        format!("{near}the topics are {}", list(names())),
                    )
                })?
            }
        };
        let main = topic.unwrap_or(&found[chosen[0]].topic).to_owned();
        let mut place = 0..;
        found.retain(|one| {
            let kept = place.next().is_some_and(|k| chosen.contains(&k));
            if !kept {
                other_topics.push(one.topic.clone());
            }
            kept
        });
        found.sort_by_key(|one| (one.topic != main, one.is_columns()));
        let mut columns = vec!["t".to_owned()];
        let mut sources = Vec::new();
        // topics of other joints each need no name of a topic before those of their joints
        let joints = found.iter().filter(|one| !one.is_columns());
        let mut joints: Vec<&str> = joints
            .flat_map(|one| one.names.iter().map(|n| &**n))
            .collect();
        let all = joints.len();
        joints.sort_unstable();
        joints.dedup();
        let apart = joints.len() == all;
        for one in found {
            let first = columns.len();
            let mut fields = header_stamp().to_vec();
            for ((array, letter), _) in ARRAYS.iter().zip(one.arrays).filter(|(_, filled)| *filled)
            {
                for name in &one.names {
                    fields.push(vec![FieldPath::named(array, "name", name)]);
                    columns.push(column(&one, letter, name, apart || one.topic == main));
                }
            }
            let Ok(reader) = reader_of(&one.schema, &fields) else {
                continue;
            };
            sources.push(StateTopic {
                values: vec![Value::Absent; fields.len()],
                topic: one.topic,
                schema: one.schema,
                reader,
                first,
                stamped: one.stamped,
                zero_is_time: one.stamps.are_times(),
                fields,
                publishers: PublisherSet::default(),
                uneven: 0,
                first_uneven: None,
            });
        }
        let mut names: Vec<String> = sources.iter().map(|s| s.topic.clone()).collect();
        if times.is_some() {
            names.push(TIMES.to_owned());
        }
        let mut states = Self {
            recording: MessageFiles::open(paths, names)?,
            paths: paths.to_vec(),
            unstamped: 0,
            begun: false,
            begins_unstamped: false,
            row: StateRow::new(columns.len(), sources.len()),
            ahead: StateRow::new(columns.len(), sources.len()),
            sources,
            times,
            columns,
            exact: None,
            other_topics,
            unreadable: 0,
            incomplete: 0,
        };
        states.begin()?;
        Ok(states)
    }

    /// Reads messages into `row`, or the row ahead of it, until that has begun.
    fn begin(&mut self) -> Result<(), LogError> {
        self.ahead.clear();
        loop {
            let Some(message) = self.recording.next()? else {
                return Ok(());
            };
            let (head, topic) = (message.head, message.topic);
            if let Some((schema, reader)) = &mut self.times
                && topic.name == TIMES
                && *topic.schema == *schema
            {
                let mut value = [Value::Absent];
                let read = reader.read(message.data, &mut value);
                if let (Ok(()), Some(t)) = (read, value[0].number()) {
                    self.exact = Some((head.log_ns, t));
                }
                continue;
            }
            let is = |s: &StateTopic| s.topic == topic.name && s.schema == *topic.schema;
            let Some(at) = self.sources.iter().position(is) else {
                self.unreadable += 1;
                continue;
            };
            let one = &mut self.sources[at];
            if one.reader.read(message.data, &mut one.values).is_err() {
                self.unreadable += 1;
                continue;
            }
            let publisher = MessagePublisher::of(&head, &*one.reader);
            let place = (&*self.paths, &*one.topic);
            let numbers = &one.values[2..];
            let fields = &one.fields[2..];
            if !one.publishers.take(publisher, place, fields, numbers)? {
                continue;
            }
            if let Some(uneven) = one.reader.uneven() {
                one.uneven += 1;
                one.first_uneven.get_or_insert(uneven);
            }
            let Some(key) = one.key(&head) else {
                self.unstamped += 1;
                self.begins_unstamped |= !self.begun;
                continue;
            };
            let own = one.first..one.first + one.values.len() - 2;
            // messages of one instant may each hold some of the joints
            let apart = |row: &StateRow| {
                let mut taken = row.values[own.clone()].iter().zip(&one.values[2..]);
                taken.all(|(known, new)| known.is_nan() || *new == Value::Absent)
            };
            let same = self.row.full && self.row.key == key && apart(&self.row);
            let row = match same {
                true => &mut self.row,
                false => &mut self.ahead,
            };
            for (to, value) in row.values[own].iter_mut().zip(&one.values[2..]) {
                *to = value.number().unwrap_or(*to);
            }
            row.sources[at] = true;
            self.begun = true;
            if !same {
                row.full = true;
                row.key = key;
                let exact = self.exact.take().filter(|(log, _)| *log == head.log_ns);
                row.exact = exact.map(|(_, t)| t);
                return Ok(());
            }
        }
    }
}

impl LogRows for JointStates {
    fn names(&self) -> &[String] {
        &self.columns
    }

    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        std::mem::swap(&mut self.row, &mut self.ahead);
        if !self.row.full {
            // It is at the end for good.
            self.ahead.clear();
            return Ok(None);
        }
        self.begin()?;
        self.incomplete += u64::from(self.row.sources.contains(&false));
        Ok(Some(match self.row.exact {
            Some(seconds) => RowTime::Seconds(seconds),
            None => RowTime::Exact(Instant::from_ns(self.row.key)),
        }))
    }

    fn begins(&self) -> Option<f64> {
        // the clock began at 0, before it was published
        let near = !Instant::from_ns(self.row.key).is_far();
        (self.begins_unstamped && near).then_some(0.0)
    }

    fn logged(&self, column: usize) -> Option<f64> {
        self.row.values.get(column).copied()
    }

    fn warnings(&self) -> Vec<String> {
        let mut out: Vec<String> = self.breaks();
        if !self.other_topics.is_empty() {
            let topics = list(self.other_topics.iter().map(String::as_str));
            out.push(format!("topics that are left out: {topics}"));
        }
        for (count, text) in [
            (
                self.unreadable,
                "messages cannot be decoded and are left out",
            ),
            (
                self.unstamped,
                "messages are stamped 0, before their clock was set, and are left out",
            ),
        ] {
            out.extend(counted(count, text));
        }
        out.extend(self.contradictions().into_iter().map(|(_, text)| text));
        out.extend(self.uneven().into_iter().map(|(_, text)| text));
        if self.sources.len() > 1 {
            let lacking =
                "rows have no message of one of the topics at their time, and no numbers there";
            out.extend(counted(self.incomplete, lacking));
        }
        out
    }

    fn breaks(&self) -> Vec<String> {
        self.recording.breaks("")
    }

    fn contradictions(&self) -> Vec<(u64, String)> {
        let left_out = |one: &StateTopic| one.publishers.left_out(&escape(&one.topic));
        self.sources.iter().filter_map(left_out).collect()
    }

    fn uneven(&self) -> Vec<(u64, String)> {
        let of = |one: &StateTopic| {
            let first = one.first_uneven.as_ref()?;
            let (topic, count) = (escape(&one.topic), one.uneven);
            Some((count, format!("in {count} messages of {topic}, {first}")))
        };
        self.sources.iter().filter_map(of).collect()
    }
}

impl StateTopic {
    /// Instant of a message [ns]; `None` where its clock was not set yet.
    fn key(&self, head: &MessageHead) -> Option<i128> {
        let stamp = stamp_ns(self.values[0], self.values[1]).filter(|_| self.stamped);
        match stamp {
            Some(0) if !self.zero_is_time => None,
            stamp => Some(stamp.unwrap_or(i128::from(head.log_ns))),
        }
    }
}

impl StateRow {
    fn new(columns: usize, sources: usize) -> Self {
        Self {
            values: vec![f64::NAN; columns],
            sources: vec![false; sources],
            ..Self::default()
        }
    }

    fn clear(&mut self) {
        self.values.fill(f64::NAN);
        self.sources.fill(false);
        self.exact = None;
        self.full = false;
    }
}

fn column(of: &FoundTopic, letter: &str, name: &str, by_joint: bool) -> String {
    if by_joint && !of.is_columns() {
        return format!("{letter}_{name}");
    }
    let topic = of.topic.trim_matches('/');
    let alone = of.arrays.iter().filter(|filled| **filled).count() == 1;
    match (topic, alone) {
        (COLUMNS, true) => name.to_owned(),
        (topic, true) => format!("{}_{name}", topic.replace('/', ".")),
        (topic, false) => format!("{}.{letter}_{name}", topic.replace('/', ".")),
    }
}
