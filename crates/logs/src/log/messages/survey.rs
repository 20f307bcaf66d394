//! Finds the topics that hold a robot's channels, by reading the beginning of a recording.

use std::ops::Range;
use std::path::PathBuf;

use super::encoding::reader_of;
use super::fields::{PartialMessage, RobotFields, TimeSource};
use super::message::{MessageHead, OpenedReader, UnevenArray, refused};
use super::parts::MessageFiles;
use super::sources::ZeroStamps;
use super::value::Value;
use crate::log::LogError;
use crate::log::layout::Layout;
use crate::log::names::{escape, list, nearest, suggestion};
use crate::log::section::StampSource;

/// Messages of a topic that are looked at before it is given up.
const TRIES: u32 = 200;
/// Messages that are looked at for further topics once the channels are found.
const FURTHER: u32 = 2000;

/// The topics that a log is read from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TopicChoice {
    /// Topic of the positions; of the torques where there are no positions to read.
    pub(super) topic: String,
    /// Topic of the torques, where it is another one.
    pub(super) torque_topic: Option<String>,
    pub(super) time: TimeSource,
    pub(super) velocities: bool,
    /// Whether a stamp of 0 in a header is a time.
    pub(super) zero_is_time: bool,
    pub(super) notes: Vec<String>,
}

struct TopicCandidate {
    name: String,
    kind: String,
    reader: OpenedReader,
    tries: u32,
    shown: TopicContents,
    /// Which velocities were a number at least once.
    measured: Vec<bool>,
    stamps: ZeroStamps,
    /// Fields of messages of one instant, each of which holds some of the joints.
    parts: PartialMessage,
    /// An array that no name can be given to the elements of.
    uneven: Option<UnevenArray>,
    /// Fields that no message had so far.
    missing: Vec<bool>,
    names: Vec<String>,
}

/// What messages of a topic were seen to hold.
#[derive(Clone, Copy, Default, PartialEq)]
struct TopicContents {
    /// Channels as numbers.
    measured: Channels,
    /// Channels by their names; a driver without that sensor publishes NaN.
    named: Channels,
    /// No message with the positions was without the velocities.
    velocities: bool,
    header: bool,
    time: bool,
}

/// Which channels of the robot some message held all of.
#[derive(Clone, Copy, Default, PartialEq)]
struct Channels {
    positions: bool,
    torques: bool,
    /// Both in one message.
    both: bool,
}

impl Channels {
    /// Adds those of one message; a robot without positions (or torques) to read finds them everywhere.
    fn add(&mut self, fields: &RobotFields, is: impl Fn(&Value) -> bool, values: &[Value]) {
        let all = |range: &Range<usize>| values[range.clone()].iter().all(&is);
        let (q, tau) = (all(&fields.positions), all(&fields.torques));
        self.positions |= q && !fields.positions.is_empty();
        self.torques |= tau && !fields.torques.is_empty();
        self.both |= q && tau;
    }
}

impl TopicCandidate {
    /// Looks at one message; whether it shows anything new.
    fn look(
        &mut self,
        (head, data): (&MessageHead, &[u8]),
        fields: &RobotFields,
        values: &mut [Value],
    ) -> bool {
        let before = self.shown;
        self.tries += 1;
        let Ok(reader) = &mut self.reader else {
            return false;
        };
        if let Err(reason) = reader.read(data, values) {
            if self.tries >= TRIES && self.names.is_empty() {
                self.reader = Err(format!("its messages cannot be read: {reason}"));
            }
            return false;
        }
        if self.names.is_empty() {
            self.names = reader.names(data);
        }
        if self.uneven.is_none() {
            self.uneven = reader.uneven();
        }
        for (missing, value) in self.missing.iter_mut().zip(&*values) {
            *missing &= *value == Value::Absent;
        }
        if let Some(ns) = fields.header_ns(values) {
            self.stamps.take(ns);
        }
        let shown = &mut self.shown;
        shown.header |= fields.has_header(values);
        shown.time |= fields.has_time(values);
        self.parts.join(fields, head, values);
        let is_measured = |value: &Value| value.number().is_some_and(f64::is_finite);
        if RobotFields::all(values, &fields.positions) || fields.positions.is_empty() {
            // one that is NaN is no measurement, as a driver without velocities publishes them
            let own = &values[fields.velocities.clone()];
            self.measured.resize(own.len(), false);
            for (measured, value) in self.measured.iter_mut().zip(own) {
                *measured |= is_measured(value);
            }
            shown.velocities = (shown.velocities || !shown.named.positions)
                && RobotFields::all(values, &fields.velocities);
        }
        shown.measured.add(fields, is_measured, values);
        let is_there = |value: &Value| *value != Value::Absent;
        shown.named.add(fields, is_there, values);
        before != *shown
    }
}

/// Reads the beginning of a recording, and chooses.
pub(super) fn choose(
    paths: &[PathBuf],
    layout: &Layout,
) -> Result<(TopicChoice, Layout), LogError> {
    let mut surveys = Vec::new();
    for layout in [Some(layout), layout.otherwise.as_deref()]
        .into_iter()
        .flatten()
    {
        let fields = RobotFields::new(layout);
        let found = survey(paths, layout, &fields)?;
        if let Ok(choice) = pick(&found, layout, &fields, &[MEASURED]) {
            return Ok((choice, layout.clone()));
        }
        surveys.push((layout, fields, found));
    }
    let mut refusal = None;
    for (layout, fields, found) in surveys {
        match pick(&found, layout, &fields, &[MEASURED, NAMED]) {
            Ok(choice) => return Ok((choice, layout.clone())),
            Err(problem) => refusal = refusal.or(Some(problem)),
        }
    }
    let (problem, remedy) = refusal.unwrap_or_default();
    Err(refused(paths, problem, remedy))
}

/// Looks at the messages of every topic until the channels are found and no other topic has them.
fn survey(
    paths: &[PathBuf],
    layout: &Layout,
    fields: &RobotFields,
) -> Result<Vec<TopicCandidate>, LogError> {
    let mut recording = MessageFiles::open(paths, Vec::new())?;
    let mut found: Vec<TopicCandidate> = Vec::new();
    let mut values = vec![Value::Absent; fields.paths.len()];
    let (mut complete, mut further) = (false, 0);
    while let Some(message) = recording.next()? {
        let index = match found.iter().position(|c| c.name == message.topic.name) {
            Some(index) => index,
            None => {
                found.push(TopicCandidate {
                    name: message.topic.name.clone(),
                    kind: message.topic.schema.name.clone(),
                    reader: reader_of(&message.topic.schema, &fields.paths),
                    tries: 0,
                    shown: TopicContents::default(),
                    measured: Vec::new(),
                    stamps: ZeroStamps::default(),
                    parts: PartialMessage::default(),
                    uneven: None,
                    missing: vec![true; fields.paths.len()],
                    names: Vec::new(),
                });
                found.len() - 1
            }
        };
        let candidate = &mut found[index];
        if candidate.tries < TRIES
            && candidate.look((&message.head, message.data), fields, &mut values)
        {
            complete = pick(&found, layout, fields, &[MEASURED]).is_ok();
        }
        if complete {
            let named = layout.section.topic.is_some();
            further += 1;
            if further > if named { TRIES } else { FURTHER } {
                break;
            }
        }
    }
    if found.is_empty() {
        if let Some((path, broken)) = recording.broken.first() {
            let (place, reason) = (&broken.place, escape(&broken.reason));
            return Err(refused(
                std::slice::from_ref(path),
                format!("holds no message before it breaks off {place}: {reason}"),
                "copy it again from where it was recorded, or record again",
            ));
        }
        let remedy = match recording.seen.is_empty() {
            true => "record again, with the topics of the robot".to_owned(),
            false => format!(
                "its topics are {}; record again while the robot moves",
                list(recording.seen.iter().map(|topic| topic.name.as_str()))
            ),
        };
        return Err(refused(paths, "holds no message", remedy));
    }
    Ok(found)
}

/// The topics that hold the channels of a robot.
struct ChannelTopics<'c> {
    /// Positions and torques in one message.
    both: Option<&'c TopicCandidate>,
    positions: Option<&'c TopicCandidate>,
    torques: Option<&'c TopicCandidate>,
}

/// What counts as held.
type CountedChannels = fn(&TopicContents) -> Channels;
const MEASURED: CountedChannels = |shown| shown.measured;
const NAMED: CountedChannels = |shown| shown.named;

/// The one topic that holds each of the channels; an error where several do.
fn holding<'c>(
    found: &'c [TopicCandidate],
    layout: &Layout,
    fields: &RobotFields,
    counted: CountedChannels,
) -> Result<ChannelTopics<'c>, (String, String)> {
    let asked = &layout.section;
    let one = |holds: &dyn Fn(&TopicCandidate) -> bool, key: &str, what: &str| {
        let mut holding = found.iter().filter(|c| holds(c));
        let first = holding.next();
        match (first, holding.count()) {
            (first, 0) => Ok(first),
            (_, more) => Err((
                format!("{} topics hold the {what} of all joints", more + 1),
                format!(
                    "name one of {} as `{key}` in [log] of the robot file",
                    list(found.iter().filter(|c| holds(c)).map(|c| c.name.as_str()))
                ),
            )),
        }
    };
    let is = |c: &TopicCandidate, name: &Option<String>| name.as_ref().is_none_or(|n| *n == c.name);
    let key = match layout.temperatures {
        true => "temperature_topic",
        false => "topic",
    };
    let separate = asked.torque_topic.is_some() && asked.torque_topic != asked.topic;
    let both = match separate {
        true => None,
        false => one(
            &|c| counted(&c.shown).both && is(c, &asked.topic),
            key,
            match fields.torques.is_empty() {
                true if layout.temperatures => "temperatures",
                true => "positions",
                false => "positions and torques",
            },
        )?,
    };
    let (mut positions, mut torques) = (None, None);
    if both.is_none() {
        let q = |c: &TopicCandidate| counted(&c.shown).positions && is(c, &asked.topic);
        let tau = |c: &TopicCandidate| counted(&c.shown).torques && is(c, &asked.torque_topic);
        positions = one(&q, key, "positions")?;
        torques = one(&tau, "torque_topic", "torques")?;
    }
    Ok(ChannelTopics {
        both,
        positions,
        torques,
    })
}

/// Chooses among the topics by the first of these that counts enough; else what is wrong and what to do.
fn pick(
    found: &[TopicCandidate],
    layout: &Layout,
    fields: &RobotFields,
    counted: &[CountedChannels],
) -> Result<TopicChoice, (String, String)> {
    let mut positions = None;
    for counted in counted {
        let found = holding(found, layout, fields, *counted)?;
        let (first, second) = match (found.both, found.positions, found.torques) {
            (Some(both), ..) => (both, None),
            (None, Some(q), Some(tau)) => (q, Some(tau)),
            (None, q, _) => {
                positions = q;
                continue;
            }
        };
        return choice(first, second, layout.section.stamp);
    }
    Err(missing(found, layout, fields, positions))
}

fn choice(
    first: &TopicCandidate,
    second: Option<&TopicCandidate>,
    stamp: StampSource,
) -> Result<TopicChoice, (String, String)> {
    let (time, notes) = time_source(first, second, stamp)?;
    Ok(TopicChoice {
        topic: first.name.clone(),
        torque_topic: second.map(|c| c.name.clone()),
        time,
        velocities: first.shown.velocities && !first.measured.contains(&false),
        zero_is_time: first.stamps.are_times() && second.is_none_or(|c| c.stamps.are_times()),
        notes,
    })
}

/// Which time of the messages counts, and a note on it; else what is wrong and what to do.
fn time_source(
    first: &TopicCandidate,
    second: Option<&TopicCandidate>,
    asked: StampSource,
) -> Result<(TimeSource, Vec<String>), (String, String)> {
    let shown = [
        first.shown,
        second.map_or(first.shown, |second| second.shown),
    ];
    let headers = shown.map(|shown| shown.header);
    let source = match asked {
        StampSource::Header if headers.contains(&false) => {
            let topic = escape(&first.name);
            return Err((
                format!("messages of {topic} have no stamp in a header"),
                "set `stamp = \"log\"` in [log] of the robot file".to_owned(),
            ));
        }
        StampSource::Header => TimeSource::Header,
        StampSource::Publish => TimeSource::Publish,
        StampSource::Auto if shown.iter().all(|shown| shown.time) => TimeSource::Field,
        StampSource::Auto if !headers.contains(&false) => TimeSource::Header,
        StampSource::Auto if headers.contains(&true) => {
            let note = "only one of the two topics has stamps in headers: the times of recording are used for both, delays of transport included";
            return Ok((TimeSource::Log, vec![note.to_owned()]));
        }
        StampSource::Auto | StampSource::Log => TimeSource::Log,
    };
    Ok((source, Vec::new()))
}

fn missing(
    found: &[TopicCandidate],
    layout: &Layout,
    fields: &RobotFields,
    positions: Option<&TopicCandidate>,
) -> (String, String) {
    let asked = &layout.section;
    let wanted = match positions {
        Some(_) => &asked.torque_topic,
        None => &asked.topic,
    };
    let topics = || found.iter().map(|c| c.name.as_str());
    if let Some(name) = wanted.as_ref().or(asked.topic.as_ref())
        && !found.iter().any(|c| c.name == *name)
    {
        let near = suggestion(name, topics());
        return (
            format!("no message of topic `{}`", escape(name)),
            format!("{near}the topics are {}", list(topics())),
        );
    }
    // The topic that comes nearest to what is wanted.
    let (range, channels, what) = match positions {
        Some(_) => (&fields.torques, &layout.torques, "torque"),
        None if fields.positions.is_empty() => (&fields.torques, &layout.torques, "torque"),
        None => (&fields.positions, &layout.positions, layout.what()),
    };
    let count = |c: &TopicCandidate| c.missing[range.clone()].iter().filter(|m| !**m).count();
    let meant = |c: &&TopicCandidate| wanted.as_ref().is_none_or(|name| *name == c.name);
    let nearness =
        |c: &&TopicCandidate| (c.reader.is_ok(), count(c), c.kind.contains("JointState"));
    let Some(best) = found.iter().filter(meant).max_by_key(nearness) else {
        let problem = "no topic holds the robot's channels";
        return (problem.to_owned(), String::new());
    };
    let (topic, kind) = (escape(&best.name), escape(&best.kind));
    if let Err(reason) = &best.reader {
        return (
            format!(
                "messages of {topic} ({kind}) cannot be read: {}",
                escape(reason)
            ),
            format!("the topics are {}", list(topics())),
        );
    }
    if let Some(uneven) = &best.uneven
        && range.clone().any(|index| best.missing[index])
    {
        return (
            format!("in messages of {topic}, {uneven}"),
            format!(
                "where it is known whose they are, say so by their places, `{what} = \"{}[0]\"`, .. in [log.joint] of the robot file; else record again with one number for each name",
                escape(&uneven.array)
            ),
        );
    }
    let lacking = range.clone().find(|index| best.missing[*index]);
    let index = lacking.map_or(0, |index| index - range.start);
    let joint = layout.name_in_messages(index).unwrap_or_default();
    let column = channels.get(index).map_or("", |c| c.column.as_str());
    // the names of a message of temperatures may be those of the joints too
    if !layout.temperatures && lacking.is_some() && best.names.iter().any(|name| name == joint) {
        let joint = escape(joint);
        return (
            format!("messages of {topic} name {joint}, and hold no number as its {what}"),
            "see what publishes them: NaN and null are no numbers; record again".to_owned(),
        );
    }
    let near = nearest(joint, best.names.iter().map(String::as_str));
    let near = near.map(|name| format!("the nearest is `{}`; ", escape(name)));
    let problem = match lacking {
        Some(_) => format!(
            "no topic holds the {what} of {}: neither field `{}` nor joint `{}`",
            escape(layout.joints.get(index).map_or(joint, String::as_str)),
            escape(column),
            escape(joint)
        ),
        None => format!("no message of {topic} holds the {what}s of all joints at once"),
    };
    let remedy = format!(
        "{}{topic} ({kind}) holds {}: name the joint as `name`, or the field as `{what}`, in [log.joint] of the robot file",
        near.unwrap_or_default(),
        list(best.names.iter().map(String::as_str)),
    );
    (problem, remedy)
}
