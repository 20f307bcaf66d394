//! A log as its columns: names, roles, units, ranges, and its clock.

use std::collections::BTreeMap;

use super::clock::{ClockColumn, sample};
use super::column::LogColumn;
use super::content;
use super::error::MappingError;
use super::units::wrap_of;
use crate::inspect::detectors::word_leaps::WordLeaps;
use crate::inspect::words::{is_command, words};
use crate::inspect::{self, ChannelColumn, ChannelRole, ColumnPlan, InspectedChannel};
use crate::log::{
    self, LogSection, LogSpec, Provenance, RawBlock, RawReader, StateGroup, escape, list, signed,
};

/// Where times come from.
#[derive(Debug, Clone, PartialEq)]
pub enum ClockSource {
    /// Messages have their own.
    Messages,
    /// A column, by its name; seconds per unit of it, and whether anything but its name told that it is
    /// one.
    Column {
        name: String,
        seconds: f64,
        guessed: bool,
    },
    /// Rows lie evenly \[Hz\]; the column of times that is too coarse for them, where there is one.
    Rate { hz: f64, coarse: Option<String> },
}

/// What the user says of the log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LogHints {
    /// Rate of a log without times \[Hz\].
    pub rate_hz: Option<f64>,
    /// Topic of a recording.
    pub topic: Option<String>,
}

/// What a log shows.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenColumns {
    pub columns: Vec<LogColumn>,
    pub clock: ClockSource,
    /// Topic that was chosen among several.
    pub topic: Option<String>,
    /// Topics that were not.
    pub other_topics: Vec<String>,
    /// What columns are is known by what they hold: they have no names, or none that says it.
    pub by_content: bool,
    pub rate_hz: Option<f64>,
    /// Rate at which messages lie evenly, whose stamps come in bursts or jitter \[Hz\].
    pub even_hz: Option<f64>,
    pub duration_s: f64,
    /// The kind of robot that a dataset of LeRobot says it is of.
    pub robot_type: Option<String>,
    pub name: String,
    pub provenance: Provenance,
}

impl SeenColumns {
    /// Whether it is a recording of messages.
    pub fn is_recording(&self) -> bool {
        self.clock == ClockSource::Messages
    }
}

/// Looks at a log, to its end; `joints` is the number of the robot's joints where that is known.
pub fn look(
    spec: &LogSpec,
    asked: &LogHints,
    joints: Option<usize>,
    stop: &dyn Fn() -> bool,
) -> Result<SeenColumns, MappingError> {
    let name = escape(&spec.name());
    let groups = log::topics(spec)?;
    let topic = match &asked.topic {
        Some(topic) => Some(topic.clone()),
        None => match with_torques(spec, &groups)? {
            None => chosen(&groups, &name)?,
            found => found,
        },
    };
    let section = LogSection {
        topic: topic.clone(),
        rate_hz: asked.rate_hz,
        ..LogSection::default()
    };
    let mut log = RawReader::open_plain(spec, &section)?;
    let messages = log.is_recording();
    let time = match messages || asked.rate_hz.is_some() {
        true => None,
        false => Some(ClockColumn::find(&mut log)?),
    };
    let RawBlock {
        t: times,
        columns: sample,
    } = sample(&mut log)?;
    let mut log = RawReader::open_plain(spec, &section)?;
    let headerless = log.names().iter().all(|name| name.starts_with('#'));
    let at = time.map(|time| time.place);
    // the time of a recording is its first column
    let at = at.or_else(|| messages.then_some(0));
    let numbers: Vec<usize> = (0..log.names().len()).filter(|k| Some(*k) != at).collect();
    let column = |k: &usize| LogColumn {
        unit: log.unit(*k).map(str::to_owned),
        whole: is_whole(&sample[*k]),
        wrap: wrap_of(&sample[*k]),
        torque_wrap: range_of_words(&sample[*k]),
        path: log.label(*k).map(|_| log.names()[*k].clone()),
        ..LogColumn::named(log.label(*k).unwrap_or(&log.names()[*k]))
    };
    let mut columns: Vec<LogColumn> = numbers.iter().map(column).collect();
    let by_content = headerless || unsaid(&columns, joints);
    if by_content {
        let held: Vec<&[f64]> = numbers.iter().map(|k| sample[*k].as_slice()).collect();
        for (column, (role, joint)) in columns.iter_mut().zip(content::roles(&held, joints)) {
            (column.role, column.joint) = (role, joint);
            (column.by_content, column.commanded) = (true, false);
        }
    }
    if !by_content {
        let step = match asked.rate_hz {
            Some(hz) => 1.0 / hz,
            None => content::usual_step(&times),
        };
        no_torques(&mut columns, &numbers, &sample, step);
        compare_velocities(&mut columns, &numbers, &sample, step);
    }
    let channels = numbers.iter().zip(&columns).map(|(k, column)| {
        let joint = Some(column.joint.as_str());
        ChannelColumn {
            column: *k,
            factor: 1.0,
            offset: 0.0,
            wrap: None,
            channel: InspectedChannel::new(&column.name, column.role, joint, None),
            unused: false,
        }
    });
    let plan = ColumnPlan {
        time: time.map(|time| (time.place, time.seconds)),
        channels: channels.collect(),
        ..ColumnPlan::default()
    };
    let findings = inspect::look(&mut log, &plan, stop)?.ok_or(MappingError::Interrupted)?;
    // by name: a log may have ten thousands of columns
    let facts = findings.channels.iter().rev();
    let facts: BTreeMap<_, _> = facts.map(|f| (&f.name, f)).collect();
    for (column, at) in columns.iter_mut().zip(&numbers) {
        let fact = facts.get(&column.name);
        if let Some((low, high)) = fact.and_then(|f| f.min.zip(f.max)) {
            column.range = [low, high];
        }
        column.torque_wrap = column
            .torque_wrap
            .filter(|_| column.role == ChannelRole::Torque);
        if let Some(range) = column.torque_wrap {
            let all = sample[*at].iter().map(|x| signed(*x, range));
            column.range = all.fold([0.0; 2], |[low, high], x| [x.min(low), x.max(high)]);
        }
    }
    let even_rate_hz = findings.even_rate_hz.or_else(|| {
        time.filter(|_| log.split_clock().is_none())?;
        let rate = 1.0 / content::rounded_step(&times)?;
        Some(log::round_within(rate, rate / times.len() as f64))
    });
    let own_rate = messages.then(|| rate_of_positions(&columns, &numbers, &sample));
    let clock = match (time, even_rate_hz) {
        (Some(time), Some(hz)) => ClockSource::Rate {
            hz,
            coarse: Some(log.names()[time.place].clone()),
        },
        (Some(time), None) => ClockSource::Column {
            name: log.names()[time.place].clone(),
            seconds: time.seconds,
            guessed: time.guessed,
        },
        (None, _) => match asked.rate_hz {
            Some(hz) if !messages => ClockSource::Rate { hz, coarse: None },
            _ => ClockSource::Messages,
        },
    };
    let others = groups.into_iter().map(|group| group.topic);
    Ok(SeenColumns {
        columns,
        clock,
        other_topics: match &topic {
            Some(topic) => others.filter(|other| other != topic).collect(),
            None => Vec::new(),
        },
        topic,
        by_content,
        even_hz: findings.even_rate_hz.filter(|_| messages),
        rate_hz: even_rate_hz.or(own_rate.flatten()).or(findings.rate_hz),
        duration_s: findings.duration_s,
        robot_type: log.robot_type(),
        name,
        provenance: log.provenance()?,
    })
}

/// Takes torques for what they are where they equal the velocity or the error of the position of their joint.
fn no_torques(columns: &mut [LogColumn], numbers: &[usize], sample: &[Vec<f64>], step: f64) {
    let of = |role: ChannelRole, commanded: bool| -> Vec<usize> {
        let is = |k: &usize| columns[*k].role == role && columns[*k].commanded == commanded;
        (0..columns.len()).filter(is).collect()
    };
    let (torques, measured) = (
        of(ChannelRole::Torque, false),
        of(ChannelRole::Position, false),
    );
    let wanted = of(ChannelRole::Position, true);
    let data = |k: usize| sample[numbers[k]].as_slice();
    let same = |a: usize, b: usize| columns[a].joint == columns[b].joint;
    let mut found = Vec::new();
    for torque in torques {
        for q in measured.iter().copied().filter(|q| same(*q, torque)) {
            let is_rate = step > 0.0 && content::is_rate_of(data(q), data(torque), step);
            let of_joint = wanted.iter().copied().filter(|wanted| same(*wanted, q));
            let is_error = of_joint
                .clone()
                .any(|wanted| content::is_difference(data(wanted), data(q), data(torque)));
            if is_rate {
                found.push((torque, ChannelRole::Velocity));
            } else if is_error {
                found.push((torque, ChannelRole::Other));
            }
        }
    }
    for (torque, role) in found {
        columns[torque].role = role;
    }
}

/// Compares the derivative of each measured position with the velocity of its joint.
fn compare_velocities(
    columns: &mut [LogColumn],
    numbers: &[usize],
    sample: &[Vec<f64>],
    step: f64,
) {
    let is = |column: &LogColumn, role| column.role == role && !column.commanded;
    for k in 0..columns.len() {
        let own = &columns[k];
        let beside = |c: &LogColumn| is(c, ChannelRole::Velocity) && c.joint == own.joint;
        let mut of_joint = (0..columns.len()).filter(|k| beside(&columns[*k]));
        if let (true, Some(velocity), None) = (
            is(own, ChannelRole::Position),
            of_joint.next(),
            of_joint.next(),
        ) {
            let data = [k, velocity].map(|column| sample[numbers[column]].as_slice());
            columns[k].per_velocity = content::rate_over(data[0], data[1], step);
        }
    }
}

/// The rate of the positions, where rows of a recording hold those of some joints alone: its first column is the time.
fn rate_of_positions(columns: &[LogColumn], numbers: &[usize], sample: &[Vec<f64>]) -> Option<f64> {
    let t = sample.first()?;
    let rows = |at: &usize| sample[*at].iter().filter(|x| x.is_finite()).count();
    let of = columns.iter().zip(numbers);
    let of = of.filter(|(column, _)| column.role == ChannelRole::Position && !column.commanded);
    let most = of.map(|(_, at)| rows(at)).max()?;
    let span = t.last()? - t.first()?;
    (most < t.len() && most > 1 && span > 0.0).then(|| (most - 1) as f64 / span)
}

/// Whether no name says what a column holds, and there are positions and torques of every joint, or velocities too.
fn unsaid(columns: &[LogColumn], joints: Option<usize>) -> bool {
    let as_many = |n: usize| n > 1 && [2 * n, 3 * n].contains(&columns.len());
    joints.is_some_and(as_many) && columns.iter().all(LogColumn::is_unsaid)
}

/// The only topic of other messages that holds positions and torques, where no joint states hold torques.
fn with_torques(spec: &LogSpec, groups: &[StateGroup]) -> Result<Option<String>, MappingError> {
    if groups.is_empty() || groups.iter().any(|group| group.holds[1]) {
        return Ok(None);
    }
    let states: Vec<&String> = groups
        .iter()
        .flat_map(|g| g.with.iter().chain([&g.topic]))
        .collect();
    let holds = |fields: &[String], role: ChannelRole| {
        let of = |field: &String| {
            let column = LogColumn::named(field);
            column.role == role && !column.commanded && !column.external
        };
        fields.iter().any(of)
    };
    let whole = |facts: &log::TopicFacts| {
        !states.contains(&&facts.name)
            && holds(&facts.fields, ChannelRole::Position)
            && holds(&facts.fields, ChannelRole::Torque)
    };
    let mut found = log::listing(spec)?.into_iter().filter(whole);
    let only = found.next().filter(|_| found.next().is_none());
    Ok(only.map(|facts| facts.name))
}

/// The topic of the machine that was measured, where a recording holds several; leaders and commands are none.
fn chosen(groups: &[StateGroup], name: &str) -> Result<Option<String>, MappingError> {
    if groups.len() < 2 {
        return Ok(None);
    }
    let measured = |g: &&StateGroup| !is_command(&words(&g.topic));
    let whole = |g: &&StateGroup| g.holds[0] && g.holds[1];
    let best: Vec<&StateGroup> = groups.iter().filter(measured).filter(whole).collect();
    if let [only] = best[..] {
        return Ok(Some(only.topic.clone()));
    }
    let mut ranked: Vec<&StateGroup> = groups.iter().collect();
    ranked.sort_by_key(|g| (!measured(g), !whole(g)));
    Err(MappingError::Topics {
        log: name.to_owned(),
        topics: list(ranked.iter().map(|g| g.topic.as_str())),
    })
}

/// The range of signed numbers that are logged as unsigned ones.
fn range_of_words(numbers: &[f64]) -> Option<f64> {
    let mut leaps = WordLeaps::default();
    let finite = numbers.iter().filter(|x| x.is_finite());
    finite.for_each(|x| leaps.take(*x));
    leaps.range()
}

fn is_whole(numbers: &[f64]) -> bool {
    let finite = || numbers.iter().filter(|x| x.is_finite());
    finite().all(|x| x.fract() == 0.0) && finite().any(|x| *x != 0.0)
}
