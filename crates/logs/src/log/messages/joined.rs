//! Numbers of any messages as rows: those of one topic, or of several, each on its own clock, brought onto that of the
//! first by linear interpolation.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

use super::encoding::reader_of;
use super::message::{MessageHead, MessageReader, Schema, refused};
use super::parts::MessageFiles;
use super::path::FieldPath;
use super::state_topics::{ARRAYS, FoundTopic, survey};
use super::value::{Value, stamp_ns};
use crate::log::layout::{Channel, Layout};
use crate::log::rows::{LogRows, counted};
use crate::log::time::{Instant, RowTime};
use crate::log::{Block, LogError, escape, list, source};
use cft_ident_core::number::{beyond, is_usable};

/// Messages at the beginning in which topics are looked for.
const SEARCHED_MESSAGES: u64 = 4000;
/// Numbers from which a message is the state of a machine by itself.
const STATE: usize = 4;
/// Columns that are read without a robot file.
const COLUMNS: usize = 1024;
/// Rows that wait for messages of other topics at most.
const MAX_WAITING_ROWS: usize = 1 << 14;
/// A step longer than this many usual ones is a dropout.
const DROPOUT_STEPS: f64 = 2.5;

struct Source {
    topic: String,
    schema: Arc<Schema>,
    reader: Box<dyn MessageReader>,
    /// Its fields, behind the seconds and nanoseconds of a stamp.
    values: Vec<Value>,
    samples: VecDeque<(Instant, Vec<f64>)>,
    /// Sum and number of the steps of its clock \[s\].
    steps: (f64, u32),
}

pub(in crate::log) struct JoinedTopics {
    recording: MessageFiles,
    sources: Vec<Source>,
    /// Names of the columns, the time first, and what they are called by the names in the messages.
    names: Vec<String>,
    labels: Vec<String>,
    layout: Layout,
    /// Place in a row of each position, torque and velocity.
    channels: [Vec<usize>; 3],
    waiting: VecDeque<(Instant, Vec<f64>, u64)>,
    row: Vec<f64>,
    number: u64,
    ended: bool,
    lost: u64,
    file: String,
}

/// Topics, each with its columns and their labels.
type TopicFields = Vec<(String, Vec<(String, String)>)>;

/// `/topic:path` as topic and path.
fn parted(column: &str) -> Option<(&str, &str)> {
    column
        .split_once(':')
        .filter(|(topic, path)| topic.starts_with('/') && !path.is_empty())
}

/// Whether channels are named by their topics, so that each may have its own.
pub(in crate::log) fn of_topics(layout: &Layout) -> bool {
    let mut channels = layout.positions.iter().chain(&layout.torques);
    channels.any(|channel| parted(&channel.column).is_some())
}

impl JoinedTopics {
    /// The channels of a robot, `/topic:path` each; `apart`: joints of one topic may come in messages of their own.
    pub(in crate::log) fn of_robot(
        paths: &[PathBuf],
        layout: &Layout,
        apart: bool,
    ) -> Result<Self, LogError> {
        let named = |channels: &[Channel]| channels.iter().all(|c| parted(&c.column).is_some());
        let mut layout = layout.clone();
        if !named(&layout.velocities) {
            layout.velocities.clear();
        }
        let mut fields = TopicFields::new();
        let mut joints: Vec<usize> = Vec::new();
        let kinds = [&layout.positions, &layout.torques, &layout.velocities];
        let all = kinds.into_iter().flat_map(|of| of.iter().enumerate());
        for (place, channel) in all {
            let joint = layout.joint_of(place);
            let Some((topic, path)) = parted(&channel.column) else {
                let column = escape(&channel.column);
                return Err(refused(
                    paths,
                    format!("`{column}` names no topic, as other channels do"),
                    "write every position and torque as \"/topic:path\" in [log.joint]\n`inspect` lists topics and paths",
                ));
            };
            let entry = (channel.column.clone(), path.to_owned());
            let same =
                |(known, of): (&(String, _), &usize)| known.0 == topic && (!apart || *of == joint);
            match fields.iter().zip(&joints).position(same) {
                Some(at) => fields[at].1.push(entry),
                None => {
                    fields.push((topic.to_owned(), vec![entry]));
                    joints.push(joint);
                }
            }
        }
        let channels = kinds.map(Vec::clone);
        let mut rows = Self::open(paths, fields, layout)?;
        let place = |channel: Channel| {
            let mut names = rows.names.iter();
            Some(names.position(|name| *name == channel.column)? - 1)
        };
        rows.channels = channels.map(|all| all.into_iter().filter_map(place).collect());
        Ok(rows)
    }

    /// Every number of a topic: of the one that is named, of the first that holds a whole state, else of all.
    pub(in crate::log) fn of_all(paths: &[PathBuf], topic: Option<&str>) -> Result<Self, LogError> {
        let mut recording = MessageFiles::open(paths, Vec::new())?;
        let mut found = TopicFields::new();
        let (mut looked, mut unread) = (0, None);
        while looked < SEARCHED_MESSAGES
            && let Some(message) = recording.next()?
        {
            looked += 1;
            let name = &message.topic.name;
            let asked = topic.is_none_or(|topic| topic == name);
            if !asked || found.iter().any(|(known, _)| known == name) {
                continue;
            }
            match reader_of(&message.topic.schema, &[]) {
                Ok(reader) => {
                    let leaves = reader.leaves(message.data).into_iter();
                    found.push((name.clone(), leaves.map(|l| (l.path, l.label)).collect()));
                }
                Err(reason) => {
                    unread.get_or_insert((name.clone(), reason));
                }
            }
        }
        found.retain(|(_, leaves)| !leaves.is_empty());
        let most = found.iter().map(|(_, leaves)| leaves.len()).max();
        if most.is_some_and(|most| most >= STATE) {
            found.retain(|(_, leaves)| Some(leaves.len()) == most);
            found.truncate(1);
        }
        if found.is_empty() {
            let topics = recording.seen.iter().map(|topic| topic.name.as_str());
            let problem = match unread {
                Some((topic, reason)) => {
                    let (topic, reason) = (escape(&topic), escape(&reason));
                    format!("messages of {topic} cannot be read: {reason}")
                }
                None => "no message of it holds numbers that can be read".to_owned(),
            };
            let remedy = format!(
                "record the joints' states, as CDR with ros2msg definitions, protobuf or JSON\nthe topics are {}",
                list(topics)
            );
            return Err(refused(paths, problem, remedy));
        }
        let alone = found.len() == 1;
        let mut left = COLUMNS;
        let fields = found.into_iter().map(|(topic, leaves)| {
            let leaves: Vec<_> = leaves.into_iter().take(left).collect();
            left -= leaves.len();
            let named = leaves.into_iter().map(|(path, label)| match alone {
                true => (path, label),
                false => {
                    let words = topic.trim_matches('/').replace('/', ".");
                    (format!("{topic}:{path}"), format!("{words}.{label}"))
                }
            });
            (topic.clone(), named.collect())
        });
        let fields: TopicFields = fields.collect();
        Self::open(paths, fields, Layout::joint_columns(&[] as &[&str]))
    }

    fn open(paths: &[PathBuf], fields: TopicFields, layout: Layout) -> Result<Self, LogError> {
        let topics: Vec<String> = fields.iter().map(|(topic, _)| topic.clone()).collect();
        let mut schemas: Vec<Option<Arc<Schema>>> = vec![None; topics.len()];
        let mut recording = MessageFiles::open(paths, topics.clone())?;
        while schemas.contains(&None)
            && let Some(message) = recording.next()?
        {
            for (topic, schema) in topics.iter().zip(&mut schemas) {
                if *topic == message.topic.name {
                    schema.get_or_insert_with(|| Arc::clone(&message.topic.schema));
                }
            }
        }
        let refuse = |topic: &str, problem: &str| {
            let problem = format!("topic {}: {problem}", escape(topic));
            let remedy = "`cft-ident inspect` lists the topics and what is in them";
            refused(paths, problem, remedy)
        };
        let mut sources = Vec::new();
        let [mut columns, mut labels] = [(); 2].map(|()| vec!["t".to_owned()]);
        for ((topic, own), schema) in fields.into_iter().zip(schemas) {
            let schema = schema.ok_or_else(|| refuse(&topic, "no message of it"))?;
            let mut wanted = FieldPath::each(&["header.stamp.sec", "header.stamp.nanosec"]);
            for (column, label) in own {
                let path = parted(&column).map_or(&*column, |(_, path)| path);
                wanted.push(vec![FieldPath::parse(path)]);
                columns.push(column);
                labels.push(label);
            }
            let reader = reader_of(&schema, &wanted).map_err(|reason| refuse(&topic, &reason))?;
            sources.push(Source {
                values: vec![Value::Absent; wanted.len()],
                topic,
                schema,
                reader,
                samples: VecDeque::new(),
                steps: (0.0, 0),
            });
        }
        Ok(Self {
            recording: MessageFiles::open(paths, topics)?,
            sources,
            row: vec![f64::NAN; columns.len() - 1],
            names: columns,
            labels,
            layout,
            channels: Default::default(),
            waiting: VecDeque::new(),
            number: 0,
            ended: false,
            lost: 0,
            file: source::shown_all(paths),
        })
    }

    fn take_message(&mut self) -> Result<(), LogError> {
        let Some(message) = self.recording.next()? else {
            self.ended = true;
            return Ok(());
        };
        let (head, topic) = (message.head, message.topic);
        let mut of = self.sources.iter_mut().enumerate();
        let is = |(_, s): &(usize, &mut Source)| s.topic == topic.name && s.schema == topic.schema;
        let mut lost = false;
        while let Some((at, one)) = of.find(is) {
            if one.reader.read(message.data, &mut one.values).is_err() {
                lost = true;
                continue;
            }
            if one.values[2..].iter().all(|value| *value == Value::Absent) {
                continue;
            }
            let t = one.instant(&head);
            let numbers = one.values[2..].iter();
            let numbers: Vec<f64> = numbers.map(|v| v.number().unwrap_or(f64::NAN)).collect();
            if at == 0 {
                self.waiting.push_back((t, numbers, head.number));
                if self.waiting.len() > MAX_WAITING_ROWS {
                    self.waiting.pop_front();
                    lost = true;
                }
                continue;
            }
            if let Some((before, _)) = one.samples.back() {
                if t <= *before {
                    lost = true;
                    continue;
                }
                one.steps = (one.steps.0 + t.since(*before), one.steps.1 + 1);
            }
            one.samples.push_back((t, numbers));
        }
        self.lost += u64::from(lost);
        Ok(())
    }

    /// Puts the first row that waits into place, where all topics have numbers for it; `None` while some may come.
    fn join(&mut self) -> Option<bool> {
        let (t, _, _) = self.waiting.front()?;
        let t = *t;
        let open = |s: &Source| s.samples.back().is_none_or(|(last, _)| *last < t);
        if self.sources[1..].iter().any(open) && !self.ended {
            return None;
        }
        let (_, own, number) = self.waiting.pop_front()?;
        self.row.clear();
        self.row.extend(own);
        for one in &mut self.sources[1..] {
            if !one.at(t, &mut self.row) {
                self.lost += 1;
                return Some(false);
            }
        }
        self.number = number;
        // what is no number was not measured
        let used = self.channels[..2].iter().flatten();
        let whole = used.into_iter().all(|place| self.row[*place].is_finite());
        self.lost += u64::from(!whole);
        Some(whole)
    }
}

impl Source {
    fn instant(&self, head: &MessageHead) -> Instant {
        let stamp = stamp_ns(self.values[0], self.values[1]).filter(|ns| *ns != 0);
        Instant::from_ns(stamp.unwrap_or(i128::from(head.log_ns)))
    }

    /// Its numbers at a time, between the messages before and after it; false where there are none near.
    fn at(&mut self, t: Instant, row: &mut Vec<f64>) -> bool {
        while self.samples.len() > 1 && self.samples[1].0 <= t {
            self.samples.pop_front();
        }
        let Some((before, a)) = self.samples.front() else {
            return false;
        };
        if *before == t {
            row.extend(a);
            return true;
        }
        let Some((after, b)) = self.samples.get(1).filter(|_| *before < t) else {
            return false;
        };
        let step = after.since(*before);
        let usual = self.steps.0 / f64::from(self.steps.1.max(1));
        if step > DROPOUT_STEPS * usual {
            return false;
        }
        let share = t.since(*before) / step;
        row.extend(a.iter().zip(b).map(|(a, b)| a + share * (b - a)));
        true
    }
}

impl LogRows for JoinedTopics {
    fn names(&self) -> &[String] {
        &self.names
    }

    fn label(&self, column: usize) -> Option<&str> {
        self.labels.get(column).map(String::as_str)
    }

    fn next(&mut self) -> Result<Option<RowTime>, LogError> {
        loop {
            let t = self.waiting.front().map(|(t, ..)| *t);
            match (self.join(), t) {
                (Some(true), Some(t)) => return Ok(Some(RowTime::Exact(t))),
                (Some(_), _) => {}
                (None, _) if self.ended => return Ok(None),
                (None, _) => self.take_message()?,
            }
        }
    }

    fn logged(&self, column: usize) -> Option<f64> {
        self.row.get(column.checked_sub(1)?).copied()
    }

    fn append(&self, block: &mut Block) -> Result<(), LogError> {
        let [q, tau, dq] = &self.channels;
        let parts = [
            (&self.layout.positions, q, &mut block.q),
            (&self.layout.torques, tau, &mut block.tau),
        ];
        let scaled = |channel: &Channel, place: usize| {
            let number = self.row.get(place).copied().unwrap_or(f64::NAN);
            number * channel.factor + channel.offset
        };
        for (channels, places, to) in parts {
            for (channel, place) in channels.iter().zip(places) {
                let value = scaled(channel, *place);
                if !is_usable(value) {
                    return Err(LogError::NotFinite {
                        at: self.place(),
                        column: escape(&channel.column),
                        text: format!("{value:?}{}", beyond(value)),
                        remedy: "leave it out, or write the channel's unit and scale into [log.joint] of the robot file",
                    });
                }
                to.push(value);
            }
        }
        let velocities = self.layout.velocities.iter().zip(dq);
        (block.dq).extend(velocities.map(|(channel, place)| scaled(channel, *place)));
        Ok(())
    }

    fn has_velocities(&self) -> bool {
        !self.channels[2].is_empty()
    }

    fn number(&self) -> u64 {
        self.number
    }

    fn place(&self) -> String {
        format!("{}: message {}", self.file, self.number)
    }

    fn breaks(&self) -> Vec<String> {
        self.recording.breaks("")
    }

    fn warnings(&self) -> Vec<String> {
        let mut out = self.breaks();
        let mut topics: Vec<&str> = self.sources.iter().map(|one| one.topic.as_str()).collect();
        topics.dedup();
        let topics = list(topics);
        if self.sources.len() > 1 {
            out.push(format!(
                "rows are those of {topics}, interpolated linearly at the times of the first"
            ));
        }
        let lost = format!(
            "messages of {topics} are left out: no message of another topic is near, or they cannot be read"
        );
        out.extend(counted(self.lost, &lost));
        out
    }
}

/// The rows of a robot each of whose joints is found on one topic alone; `None` where one is not.
pub(in crate::log) fn of_joints(
    paths: &[PathBuf],
    layout: &Layout,
) -> Result<Option<(JoinedTopics, Layout)>, LogError> {
    let found = survey(paths)?.found;
    let needed = [!layout.positions.is_empty(), !layout.torques.is_empty()];
    let topic_of = |joint: usize| -> Option<&FoundTopic> {
        let name = layout.name_in_messages(joint)?;
        let holds = |one: &&FoundTopic| {
            let mut filled = needed.iter().zip(one.arrays);
            one.topic.starts_with('/')
                && one.names.iter().any(|own| own == name)
                && filled.all(|(needed, filled)| filled || !needed)
        };
        let mut all = found.iter().filter(holds);
        all.next().filter(|_| all.next().is_none())
    };
    let topics: Option<Vec<&FoundTopic>> = (0..layout.joints.len()).map(topic_of).collect();
    // one message of one topic that holds them all is refused for another reason
    let several = |topics: &Vec<&FoundTopic>| {
        let [first, others @ ..] = &topics[..] else {
            return false;
        };
        first.most < first.names.len() || others.iter().any(|one| one.topic != first.topic)
    };
    let Some(topics) = topics.filter(several) else {
        return Ok(None);
    };
    let mut split = layout.clone();
    let kinds = [
        &mut split.positions,
        &mut split.torques,
        &mut split.velocities,
    ];
    for (channels, (array, _)) in kinds.into_iter().zip(ARRAYS) {
        for (joint, (channel, one)) in channels.iter_mut().zip(&topics).enumerate() {
            let name = layout.name_in_messages(joint).unwrap_or_default();
            channel.column = format!("{}:{array}[name={name}]", one.topic);
        }
    }
    if !topics.iter().all(|one| one.arrays[2]) {
        split.velocities.clear();
    }
    let rows = JoinedTopics::of_robot(paths, &split, true)?;
    Ok(Some((rows, split)))
}
