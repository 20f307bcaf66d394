//! Which topics of a recording hold joint states, and which of them are of one machine: those whose
//! messages have the same instants.

use std::collections::HashSet;
use std::path::PathBuf;

use super::encoding::reader_of;
use super::message::{MessageHead, MessageReader, Schema};
use super::parts::MessageFiles;
use super::path::FieldPath;
use super::sources::ZeroStamps;
use super::value::{Value, stamp_ns};
use crate::log::{LogError, escape};

/// Messages that are looked at for topics and their names.
const SEARCHED_MESSAGES: u64 = 20_000;
/// Messages of one topic that are looked at for its names.
const OF_TOPIC: u32 = 200;
/// Names of one topic that become columns, the first ones.
const NAMES: usize = 1024;
/// Topics of joint states that are read, the first ones.
const TOPICS: usize = 32;
/// Topic of joints, by the convention of ROS.
const JOINTS: &str = "joint_states";
/// Topic whose names are those of columns, not of joints.
pub(super) const COLUMNS: &str = "columns";
/// Topic of times that are no whole nanoseconds.
pub(super) const TIMES: &str = "/t";
/// Part of the instants of one topic that another one has too, where one machine wrote both.
const MIN_SHARED_INSTANTS: f64 = 0.8;

/// The arrays of a message, in the order of the columns.
pub(super) const ARRAYS: [(&str, &str); 3] =
    [("position", "q"), ("effort", "tau"), ("velocity", "dq")];

pub(super) struct FoundTopic {
    pub topic: String,
    pub schema: Schema,
    probe: Box<dyn MessageReader>,
    pub names: Vec<String>,
    /// Names in one message, at most.
    pub most: usize,
    /// Which arrays are filled.
    pub arrays: [bool; 3],
    pub stamped: bool,
    pub stamps: ZeroStamps,
    looked_at: u32,
    /// Instants of its messages [ns], by the header's stamp where that is set.
    instants: HashSet<i128>,
}

/// The reader of times that are no whole nanoseconds, with its schema.
pub(super) type TimeReader = Option<(Schema, Box<dyn MessageReader>)>;

/// What a recording holds beside the topics of joint states: other topics, and a topic of times.
pub(super) struct TopicSurvey {
    pub found: Vec<FoundTopic>,
    pub others: Vec<String>,
    pub times: TimeReader,
    /// Why a recording whose topics are of that kind holds no joint state, and what to do, where none was found.
    pub cause: Option<(String, &'static str)>,
}

pub(super) fn survey(paths: &[PathBuf]) -> Result<TopicSurvey, LogError> {
    let mut recording = MessageFiles::open(paths, Vec::new())?;
    let mut found: Vec<FoundTopic> = Vec::new();
    let mut times = None;
    let mut messages = 0;
    let mut unreadable: Option<(String, String)> = None;
    while messages < SEARCHED_MESSAGES
        && let Some(message) = recording.next()?
    {
        messages += 1;
        let (topic, schema) = (&message.topic.name, &*message.topic.schema);
        let known = found
            .iter()
            .position(|f| f.topic == *topic && f.schema == *schema);
        let at = match known {
            Some(at) => at,
            None if is_joint_state(schema) && found.len() < TOPICS => {
                let probe = match reader_of(schema, &probes()) {
                    Ok(probe) => probe,
                    Err(reason) => {
                        unreadable.get_or_insert((topic.clone(), reason));
                        continue;
                    }
                };
                found.push(FoundTopic {
                    topic: topic.clone(),
                    schema: schema.clone(),
                    probe,
                    names: Vec::new(),
                    most: 0,
                    arrays: [false; 3],
                    stamped: false,
                    stamps: ZeroStamps::default(),
                    looked_at: 0,
                    instants: HashSet::new(),
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
        if let Err(reason) = found[at].look(&message.head, message.data) {
            unreadable.get_or_insert((found[at].topic.clone(), reason));
        }
    }
    let cause = cause(&recording, &found, unreadable);
    found.retain(|one| !one.names.is_empty() && one.arrays.contains(&true));
    let others = recording.seen.iter().map(|topic| topic.name.clone());
    let used = |name: &String| {
        found.iter().any(|one| one.topic == *name) || (times.is_some() && name == TIMES)
    };
    let others = others.filter(|name| !used(name)).collect();
    Ok(TopicSurvey {
        found,
        others,
        times,
        cause,
    })
}

/// What is wrong with a recording that breaks off, or with its topics of joint states, where it has some.
fn cause(
    recording: &MessageFiles,
    found: &[FoundTopic],
    unreadable: Option<(String, String)>,
) -> Option<(String, &'static str)> {
    const AGAIN: &str = "copy it again from where it was recorded, or record again";
    if let Some((topic, reason)) = unreadable {
        let (topic, reason) = (escape(&topic), escape(&reason));
        let remedy = match reason.contains("definition") || reason.contains("encoding") {
            true => "record with its message definitions, as `ros2 bag record` does",
            false => AGAIN,
        };
        return Some((
            format!("messages of {topic} cannot be read: {reason}"),
            remedy,
        ));
    }
    let mut declared = recording.seen.iter();
    let declared = declared.find(|topic| is_joint_state(&topic.schema));
    let of = declared.map(|topic| format!(" of {}", escape(&topic.name)));
    if found.is_empty()
        && let Some((_, broken)) = recording.broken.first()
    {
        let (of, reason) = (of.unwrap_or_default(), escape(&broken.reason));
        let place = &broken.place;
        let problem = format!("holds no joint states{of} before it breaks off {place}: {reason}");
        return Some((problem, AGAIN));
    }
    let of = of?;
    Some(match found.is_empty() {
        true => (
            format!("holds no message{of}"),
            "record again while the robot moves",
        ),
        false => (
            format!("the messages{of} name no joint, or hold no number of one"),
            "record again with names, positions and efforts filled in",
        ),
    })
}

/// Whether messages are joint states by their type, and no other type whose name ends so.
fn is_joint_state(schema: &Schema) -> bool {
    let last = schema.name.rsplit(['/', '.']).next();
    last == Some("JointState")
}

/// What is asked of a message to see what it holds; the last makes the decoder look at the names.
fn probes() -> Vec<Vec<FieldPath>> {
    let mut fields = FieldPath::each(&["position[0]", "effort[0]", "velocity[0]"]);
    fields.extend(header_stamp());
    fields.extend(ARRAYS.map(|(array, _)| vec![FieldPath::named(array, "name", "")]));
    fields
}

/// Seconds and nanoseconds of a header's stamp, as ROS 2 and ROS 1 name them.
pub(super) fn header_stamp() -> [Vec<FieldPath>; 2] {
    let paths = [
        ["header.stamp.sec", "header.stamp.secs"],
        ["header.stamp.nanosec", "header.stamp.nsecs"],
    ];
    paths.map(|either| either.map(FieldPath::parse).to_vec())
}

impl FoundTopic {
    fn look(&mut self, head: &MessageHead, data: &[u8]) -> Result<(), String> {
        let mut values = [Value::Absent; 8];
        self.probe.read(data, &mut values)?;
        let stamp = stamp_ns(values[3], values[4]);
        if let Some(ns) = stamp {
            self.stamps.take(ns);
        }
        let stamp = stamp.filter(|ns| *ns != 0);
        self.instants
            .insert(stamp.unwrap_or(i128::from(head.log_ns)));
        if self.looked_at >= OF_TOPIC {
            return Ok(());
        }
        self.looked_at += 1;
        for (filled, value) in self.arrays.iter_mut().zip(&values) {
            *filled |= value.number().is_some_and(|x| !x.is_nan());
        }
        self.stamped |= stamp.is_some();
        let names = self.probe.names(data);
        self.most = self.most.max(names.len());
        for name in names {
            if self.names.len() < NAMES && !self.names.contains(&name) {
                self.names.push(name);
            }
        }
        Ok(())
    }

    pub(super) fn is_columns(&self) -> bool {
        self.topic.trim_matches('/') == COLUMNS
    }

    /// Whether the messages of two topics have the same instants, where both were recorded.
    fn goes_with(&self, other: &Self) -> bool {
        let ends = |of: &Self| Some((*of.instants.iter().min()?, *of.instants.iter().max()?));
        let (Some((a0, a1)), Some((b0, b1))) = (ends(self), ends(other)) else {
            return false;
        };
        // a topic for each joint, each by its own clock
        if let ([one], [two]) = (&self.names[..], &other.names[..])
            && one != two
        {
            return a0.max(b0) <= a1.min(b1);
        }
        let both = a0.max(b0)..=a1.min(b1);
        let within = |of: &Self| of.instants.iter().filter(|t| both.contains(*t)).count();
        let shared = self.instants.intersection(&other.instants).count();
        let fewer = within(self).min(within(other));
        fewer > 0 && shared as f64 >= MIN_SHARED_INSTANTS * fewer as f64
    }
}

/// The topic whose columns have no name of a topic before them.
fn main_topic(found: &[FoundTopic]) -> usize {
    let last = |one: &FoundTopic| one.topic.rsplit('/').next() == Some(JOINTS);
    let both = |one: &FoundTopic| one.arrays[0] && one.arrays[1];
    let named = found.iter().position(last);
    named.or_else(|| found.iter().position(both)).unwrap_or(0)
}

/// Topics that are of one machine, the main one of each first, and the recording's main topic in the first group.
pub(super) fn groups(found: &[FoundTopic]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..found.len()).collect();
    let main = main_topic(found);
    order.sort_by_key(|k| (*k != main, found[*k].is_columns()));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for k in order {
        let of = |group: &&mut Vec<usize>| {
            found[k].is_columns() || group.iter().any(|g| found[*g].goes_with(&found[k]))
        };
        match groups.iter_mut().find(of) {
            Some(group) => group.push(k),
            None => groups.push(vec![k]),
        }
    }
    groups
}

/// A topic of a recording with what belongs to it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StateGroup {
    /// Topic of the joints.
    pub topic: String,
    /// Further topics whose messages have the same instants.
    pub with: Vec<String>,
    /// Names of the joints of the first one.
    pub joints: Vec<String>,
    /// Whether any of them holds positions, torques, velocities.
    pub holds: [bool; 3],
}

/// The machines whose joint states a recording holds, the main one first.
pub(in crate::log) fn state_groups(paths: &[PathBuf]) -> Result<Vec<StateGroup>, LogError> {
    let found = survey(paths)?.found;
    let of = |group: &Vec<usize>| StateGroup {
        topic: found[group[0]].topic.clone(),
        with: (group[1..].iter().map(|k| found[*k].topic.clone())).collect(),
        joints: found[group[0]].names.clone(),
        holds: std::array::from_fn(|i| group.iter().any(|k| found[*k].arrays[i])),
    };
    Ok(groups(&found).iter().map(of).collect())
}
