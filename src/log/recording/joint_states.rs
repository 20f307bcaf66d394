//! Every `JointState` of a recording as one table, whatever robot it is of.
//!
//! The topic of the joints gives `q_<joint>`, `tau_<joint>`, `dq_<joint>`; another topic puts its own
//! name before that of the joint. Messages of one instant are one row.

use std::fmt;
use std::path::PathBuf;

use super::encoding::reader_of;
use super::message::{MessageHead, MessageReader, Schema, Wanted};
use super::parts::MessageFiles;
use super::path::FieldPath;
use super::value::Value;
use crate::log::names::{escape, list};
use crate::log::rows::LogRows;
use crate::log::time::{Instant, Stamped};
use crate::log::{LogError, source};

/// Messages that are looked at for topics and their names.
const LOOKED_AT: u64 = 20_000;
/// Messages of one topic that are looked at for its names.
const OF_TOPIC: u32 = 200;
/// Names of one topic that become columns, the first ones.
const NAMES: usize = 1024;
/// Topics of joint states that are read, the first ones.
const TOPICS: usize = 32;
/// Topic of joints, by the convention of ROS.
const JOINTS: &str = "joint_states";
/// Topic whose names are those of columns, not of joints.
const COLUMNS: &str = "columns";
/// Topic of times that are no whole nanoseconds.
const TIMES: &str = "/t";

/// The arrays of a message, in the order of the columns.
const ARRAYS: [(&str, &str); 3] = [("position", "q"), ("effort", "tau"), ("velocity", "dq")];

/// One topic and the columns that it fills.
struct StateTopic {
    topic: String,
    schema: Schema,
    reader: Box<dyn MessageReader>,
    values: Vec<Value>,
    /// Place of its first column.
    first: usize,
    stamped: bool,
}

/// What a topic was found to hold.
struct FoundTopic {
    topic: String,
    schema: Schema,
    probe: Box<dyn MessageReader>,
    names: Vec<String>,
    arrays: [bool; 3],
    stamped: bool,
    looked_at: u32,
}

#[derive(Debug, Clone, Default)]
struct StateRow {
    key: i128,
    /// The time where it is no whole nanosecond.
    exact: Option<f64>,
    values: Vec<f64>,
    sources: Vec<bool>,
    full: bool,
}

/// The rows of a recording.
pub(in crate::log) struct JointStates {
    recording: MessageFiles,
    sources: Vec<StateTopic>,
    times: Option<(Schema, Box<dyn MessageReader>)>,
    columns: Vec<String>,
    row: StateRow,
    /// The row that begins with the message after this row.
    ahead: StateRow,
    /// A time that waits for its row: when it was recorded, and what it is.
    exact: Option<(u64, f64)>,
    other_topics: Vec<String>,
    unreadable: u64,
    incomplete: u64,
}

impl fmt::Debug for JointStates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("JointStates")
            .field("columns", &self.columns)
            .finish_non_exhaustive()
    }
}

impl JointStates {
    /// Finds the topics.
    ///
    /// # Errors
    /// A file that cannot be read; a recording without a `JointState`.
    pub(in crate::log) fn open(paths: &[PathBuf]) -> Result<Self, LogError> {
        let (mut found, other_topics, times) = survey(paths)?;
        if found.is_empty() {
            return Err(LogError::Topic {
                file: source::shown_all(paths),
                problem: "no topic holds sensor_msgs/msg/JointState".to_owned(),
                remedy: format!(
                    "say with a robot file (-r) which fields are the channels; the topics are {}",
                    list(other_topics.iter().map(String::as_str))
                ),
            });
        }
        let main = main_topic(&found);
        found.sort_by_key(|one| (one.topic != main, one.topic.trim_matches('/') == COLUMNS));
        let mut columns = vec!["t".to_owned()];
        let mut sources = Vec::new();
        for one in found {
            let first = columns.len();
            let mut fields = vec![
                vec![
                    FieldPath::parse("header.stamp.sec"),
                    FieldPath::parse("header.stamp.secs"),
                ],
                vec![
                    FieldPath::parse("header.stamp.nanosec"),
                    FieldPath::parse("header.stamp.nsecs"),
                ],
            ];
            for ((array, letter), _) in ARRAYS.iter().zip(one.arrays).filter(|(_, filled)| *filled)
            {
                for name in &one.names {
                    fields.push(vec![FieldPath::named(array, "name", name)]);
                    columns.push(column(&one, letter, name, &main));
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
            });
        }
        let mut names: Vec<String> = sources.iter().map(|s| s.topic.clone()).collect();
        if times.is_some() {
            names.push(TIMES.to_owned());
        }
        let mut states = Self {
            recording: MessageFiles::open(paths, Wanted { names })?,
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
            let key = one.key(&head);
            let same = self.row.full && self.row.key == key && !self.row.sources[at];
            let row = match same {
                true => &mut self.row,
                false => &mut self.ahead,
            };
            let numbers = one.values[2..]
                .iter()
                .map(|v| v.number().unwrap_or(f64::NAN));
            for (to, number) in row.values[one.first..].iter_mut().zip(numbers) {
                *to = number;
            }
            row.sources[at] = true;
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

    fn next(&mut self) -> Result<Option<Stamped>, LogError> {
        std::mem::swap(&mut self.row, &mut self.ahead);
        if !self.row.full {
            // It is at the end for good.
            self.ahead.clear();
            return Ok(None);
        }
        self.begin()?;
        self.incomplete += u64::from(self.row.sources.contains(&false));
        Ok(Some(match self.row.exact {
            Some(seconds) => Stamped::Seconds(seconds),
            None => Stamped::Exact(Instant::from_ns(self.row.key)),
        }))
    }

    fn logged(&self, column: usize) -> Option<f64> {
        self.row.values.get(column).copied()
    }

    fn warnings(&self) -> Vec<String> {
        let mut out: Vec<String> = self.breaks();
        if !self.other_topics.is_empty() {
            let topics = list(self.other_topics.iter().map(String::as_str));
            out.push(format!("{topics} hold no JointState and are left out"));
        }
        if self.unreadable > 0 {
            out.push(format!(
                "{} messages cannot be decoded and are left out",
                self.unreadable
            ));
        }
        if self.incomplete > 0 && self.sources.len() > 1 {
            out.push(format!(
                "{} rows have no message of one of the topics at their time, and no numbers there",
                self.incomplete
            ));
        }
        out
    }

    fn breaks(&self) -> Vec<String> {
        let broken = self.recording.broken.iter();
        broken
            .map(|(path, broken)| {
                format!(
                    "{} breaks off {} ({}): everything before is used",
                    escape(&source::file_name(path)),
                    broken.place,
                    escape(&broken.reason)
                )
            })
            .collect()
    }
}

impl StateTopic {
    /// Instant of a message [ns].
    fn key(&self, head: &MessageHead) -> i128 {
        let part = |index: usize| self.values.get(index).and_then(|v| v.integer());
        match (self.stamped, part(0), part(1)) {
            (true, Some(s), Some(ns)) => s * 1_000_000_000 + ns,
            _ => i128::from(head.log_ns),
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

/// The topic whose columns have no name of a topic before them.
fn main_topic(found: &[FoundTopic]) -> String {
    let last = |one: &&FoundTopic| one.topic.rsplit('/').next() == Some(JOINTS);
    let both = |one: &&FoundTopic| one.arrays[0] && one.arrays[1];
    let named = found.iter().find(last);
    let best = named.or_else(|| found.iter().find(both)).or(found.first());
    best.map(|one| one.topic.clone()).unwrap_or_default()
}

/// Name of the column with one array's element.
fn column(of: &FoundTopic, letter: &str, name: &str, main: &str) -> String {
    if of.topic == main && of.topic.trim_matches('/') != COLUMNS {
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

type Survey = (
    Vec<FoundTopic>,
    Vec<String>,
    Option<(Schema, Box<dyn MessageReader>)>,
);

/// Looks at the beginning of a recording.
fn survey(paths: &[PathBuf]) -> Result<Survey, LogError> {
    let mut recording = MessageFiles::open(paths, Wanted::default())?;
    let mut found: Vec<FoundTopic> = Vec::new();
    let mut times = None;
    let mut messages = 0;
    while messages < LOOKED_AT
        && let Some(message) = recording.next()?
    {
        messages += 1;
        let (topic, schema) = (&message.topic.name, &*message.topic.schema);
        let known = found
            .iter()
            .position(|f| f.topic == *topic && f.schema == *schema);
        let at = match known {
            Some(at) => at,
            None if schema.name.ends_with("JointState") && found.len() < TOPICS => {
                let Ok(probe) = reader_of(schema, &probes()) else {
                    continue;
                };
                found.push(FoundTopic {
                    topic: topic.clone(),
                    schema: schema.clone(),
                    probe,
                    names: Vec::new(),
                    arrays: [false; 3],
                    stamped: false,
                    looked_at: 0,
                });
                found.len() - 1
            }
            None => {
                if topic == TIMES && schema.name.ends_with("Float64") && times.is_none() {
                    let reader = reader_of(schema, &[vec![FieldPath::parse("data")]]);
                    times = reader.ok().map(|reader| (schema.clone(), reader));
                }
                continue;
            }
        };
        found[at].look(message.data);
    }
    found.retain(|one| !one.names.is_empty() && one.arrays.contains(&true));
    let others = recording.seen.iter().map(|topic| topic.name.clone());
    let used = |name: &String| {
        found.iter().any(|one| one.topic == *name) || (times.is_some() && name == TIMES)
    };
    let others = others.filter(|name| !used(name)).collect();
    Ok((found, others, times))
}

/// What is asked of a message to see what it holds; the last makes the decoder look at the names.
fn probes() -> Vec<Vec<FieldPath>> {
    let mut fields: Vec<Vec<FieldPath>> = ARRAYS
        .iter()
        .map(|(array, _)| vec![FieldPath::parse(&format!("{array}[0]"))])
        .collect();
    fields.push(vec![
        FieldPath::parse("header.stamp.sec"),
        FieldPath::parse("header.stamp.secs"),
    ]);
    fields.push(vec![
        FieldPath::parse("header.stamp.nanosec"),
        FieldPath::parse("header.stamp.nsecs"),
    ]);
    fields.push(vec![FieldPath::named("position", "name", "")]);
    fields
}

impl FoundTopic {
    fn look(&mut self, data: &[u8]) {
        if self.looked_at >= OF_TOPIC {
            return;
        }
        self.looked_at += 1;
        let mut values = [Value::Absent; 6];
        if self.probe.read(data, &mut values).is_err() {
            return;
        }
        for (filled, value) in self.arrays.iter_mut().zip(&values) {
            *filled |= *value != Value::Absent;
        }
        self.stamped |= values[3..5]
            .iter()
            .any(|v| v.integer().is_some_and(|x| x != 0));
        for name in self.probe.names(data) {
            if self.names.len() < NAMES && !self.names.contains(&name) {
                self.names.push(name);
            }
        }
    }
}
