//! The parameters of robots over their logs: what each log says by itself, followed in order of time.

use std::collections::BTreeMap;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::one_log::{OneEstimate, Source};
use super::track_source::TrackSource;
use crate::input::control::Control;
use crate::input::error::IdentifyError;
use crate::input::reduced::reduced_log::MadeWith;
use crate::input::track_error::TrackError;
use crate::note::{StageNote, TrackNote};
use cft_ident_fleet::track::{
    ChangeKind, LogEstimate, ParameterChange, ParameterCourse, ParameterLevel, apart,
    follow_together,
};
use cft_ident_logs::log::Provenance;

/// Probability of a false change at one look at a robot; over fifty logs there are more (`study_track`).
const FALSE_ALARM_PROBABILITY: f64 = 0.0002;
/// The same of robots of a fleet that are alike.
const FALSE_DIFFERENCE_PROBABILITY: f64 = 0.01;
/// A time between two logs over the usual one from which on the clock is doubted.
const CLOCK_JUMP_STEPS: f64 = 1000.0;

/// One robot, and its logs or models.
#[derive(Debug, Clone)]
pub struct RobotSources {
    pub name: String,
    pub sources: Vec<TrackSource>,
}

/// What became of the parameters.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Tracked {
    pub robots: Vec<TrackedRobot>,
    /// Robots that differ from the others, the clearest first.
    pub fleet: Vec<FleetDifference>,
    #[serde(skip)]
    pub inputs: Vec<Provenance>,
    #[serde(skip)]
    pub notes: Vec<StageNote>,
}

/// One robot over its logs.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct TrackedRobot {
    pub name: String,
    /// Names of the logs or models, in order of time.
    pub logs: Vec<String>,
    pub parameters: Vec<TrackedParameter>,
    pub changes: Vec<TrackedChange>,
}

/// One parameter over time.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct TrackedParameter {
    pub name: String,
    pub joint: Option<String>,
    pub unit: String,
    /// By the logs' own clock \[s\], or the numbers of the logs from 0 where their clocks do not order them.
    pub times: Vec<f64>,
    /// Smoothed \[unit\]; null where no log determines the parameter.
    pub values: Vec<Option<f64>>,
    /// Standard deviations of these.
    pub std: Vec<Option<f64>>,
    /// What each log says by itself, and its standard deviation.
    pub estimates: Vec<Option<f64>>,
    pub estimates_std: Vec<Option<f64>>,
    /// Standard deviation of the random walk from log to log.
    pub walk: f64,
    /// Standard deviation by which estimates scatter beyond their own.
    pub scatter: f64,
    /// Numbers of the logs whose estimate stands alone, from 0.
    pub outliers: Vec<usize>,
    /// Size from which on a step in the middle of the course is reported \[unit\]; null where there are too few logs.
    pub least_seen: Option<f64>,
}

/// A change of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TrackedChange {
    pub parameter: String,
    pub joint: Option<String>,
    /// Time of the first log that it shows in.
    pub time: f64,
    /// By how much, a ramp up to the last log \[unit\].
    pub size: f64,
    pub std: f64,
    /// The size over the parameter before it; null where that is nothing.
    pub relative: Option<f64>,
    pub kind: ChangeKind,
    /// Probability of one as clear in this course without a change; in the courses of all sizes of a joint's friction,
    /// which are followed together.
    pub p_value: f64,
    pub unit: String,
    /// Number of the log, from 0.
    pub log: usize,
}

/// A robot that differs from the others in a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FleetDifference {
    pub robot: String,
    pub parameter: String,
    pub joint: Option<String>,
    /// After its last log \[unit\].
    pub value: f64,
    /// Median over the robots.
    pub usual: f64,
    /// Standard deviation by which robots that are alike differ.
    pub std: f64,
    /// Corrected for all comparisons.
    pub p_value: f64,
    pub unit: String,
}

/// Follows the parameters of robots.
pub fn track(robots: &[RobotSources], control: &Control) -> Result<Tracked, IdentifyError> {
    if robots.iter().all(|r| r.sources.is_empty()) {
        return Err(TrackError::Empty.into());
    }
    let work = control.begin("tracking", Some(robots.len() as u64));
    let (mut inputs, mut notes) = (Vec::new(), Vec::new());
    let mut all = Vec::new();
    for robot in robots {
        let mut noticed = Vec::new();
        let (sources, times) = ordered(robot, &mut noticed)?;
        inputs.extend(sources.iter().map(|s| s.provenance().clone()));
        all.push(followed(&robot.name, &sources, &times, control)?);
        if sources.len() == 1 {
            noticed.push(TrackNote::OneLog {
                log: sources[0].name().to_owned(),
            });
        }
        notes.extend(noticed.into_iter().map(|note| StageNote::Track {
            robot: robot.name.clone(),
            note,
        }));
        work.advance(1);
    }
    let fleet = compared(&all);
    Ok(Tracked {
        robots: all,
        fleet,
        inputs,
        notes,
    })
}

/// Sources in order of time, and their times.
fn ordered(
    robot: &RobotSources,
    notes: &mut Vec<TrackNote>,
) -> Result<(Vec<TrackSource>, Vec<f64>), TrackError> {
    let name = || robot.name.clone();
    let given = &robot.sources;
    if let Some([first, second]) = twice(given) {
        return Err(TrackError::Twice {
            robot: name(),
            first: first.shown(),
            second: second.shown(),
        });
    }
    one_robot(robot)?;
    let mut places: Vec<usize> = (0..given.len()).collect();
    let bounds: Option<Vec<[f64; 2]>> = given.iter().map(TrackSource::bounds).collect();
    let numbers = || (0..given.len()).map(|k| k as f64).collect();
    let Some(bounds) = bounds else {
        notes.push(TrackNote::NoTimes);
        return Ok((given.clone(), numbers()));
    };
    places.sort_by(|a, b| bounds[*a][0].total_cmp(&bounds[*b][0]));
    let overlap = places
        .windows(2)
        .find(|p| bounds[p[0]][1] > bounds[p[1]][0]);
    if let Some(pair) = overlap {
        let file = |k: usize| match &given[k] {
            TrackSource::Part { file, .. } => *file,
            TrackSource::Model { .. } => k,
        };
        let mut files: Vec<usize> = (0..given.len()).map(file).collect();
        files.dedup();
        if files.len() < given.len() {
            return Err(TrackError::NoOrder {
                robot: name(),
                first: given[pair[0]].name().to_owned(),
                second: given[pair[1]].name().to_owned(),
            });
        }
        notes.push(TrackNote::ClocksOverlap);
        return Ok((given.clone(), numbers()));
    }
    if places.windows(2).any(|p| p[0] > p[1]) {
        let separate = given.iter().enumerate().all(|(k, s)| match s {
            TrackSource::Part { file, .. } => *file == k,
            TrackSource::Model { .. } => true,
        });
        if separate {
            notes.push(TrackNote::OutOfOrder);
        }
    }
    let times: Vec<f64> = places.iter().map(|k| bounds[*k][0]).collect();
    notes.extend(jump(robot, &places, &times));
    Ok((places.iter().map(|k| given[*k].clone()).collect(), times))
}

/// Two sources that say the same: spans of one log that meet, a log under two names, and models of the same rows.
fn twice(given: &[TrackSource]) -> Option<[&TrackSource; 2]> {
    let mut of_log: BTreeMap<&str, Vec<&TrackSource>> = BTreeMap::new();
    for source in given {
        let [first, ..] = source.rows() else { continue };
        let known = of_log.entry(first.sha256.as_str()).or_default();
        if let Some(other) = known.iter().find(|other| source.same_rows(other)) {
            return Some([*other, source]);
        }
        known.push(source);
    }
    None
}

/// A time between two logs that is no time between two logs.
fn jump(robot: &RobotSources, places: &[usize], times: &[f64]) -> Option<TrackNote> {
    let mut steps: Vec<f64> = times.windows(2).map(|p| p[1] - p[0]).collect();
    let far = steps.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    let (at, far) = far.map(|(at, far)| (at, *far))?;
    steps.sort_by(f64::total_cmp);
    let usual = steps[steps.len() / 2];
    (steps.len() > 2 && usual > 0.0 && far > CLOCK_JUMP_STEPS * usual).then(|| {
        TrackNote::ClockJump {
            by_s: far,
            between: [at, at + 1].map(|k| robot.sources[places[k]].name().to_owned()),
            steps: CLOCK_JUMP_STEPS,
        }
    })
}

/// Refuses sources of several robots in the place of one.
fn one_robot(robot: &RobotSources) -> Result<(), TrackError> {
    let mut first: Option<&MadeWith> = None;
    let mut joints: Option<(Vec<String>, &str)> = None;
    for source in &robot.sources {
        let other = |difference: String| TrackError::Other {
            robot: robot.name.clone(),
            source_name: source.name().to_owned(),
            difference,
        };
        let own = match source {
            TrackSource::Part { log, .. } => {
                if let Some(difference) = first.and_then(|m| log.made_with.difference(m)) {
                    return Err(other(difference));
                }
                first = Some(&log.made_with);
                log.made_with.joints.clone()
            }
            TrackSource::Model { file, .. } => file.robot.joint_names(),
        };
        match &joints {
            Some((known, name)) if *known != own => {
                return Err(other(format!(
                    "is of a robot with the joints {}, where {name} has {}",
                    own.join(", "),
                    known.join(", ")
                )));
            }
            _ => joints = Some((own, source.name())),
        }
    }
    Ok(())
}

/// One robot over its sources in order of time.
fn followed(
    name: &str,
    sources: &[TrackSource],
    times: &[f64],
    control: &Control,
) -> Result<TrackedRobot, IdentifyError> {
    let found: Vec<Source> = sources
        .par_iter()
        .map(|source| {
            if control.stopped() {
                return Err(IdentifyError::Interrupted);
            }
            match source {
                TrackSource::Part { log, .. } => Source::of_part(log, control),
                TrackSource::Model { file, .. } => Ok(Source::of_model(file)),
            }
        })
        .collect::<Result<_, _>>()?;
    let groups = groups(&found);
    let level = FALSE_ALARM_PROBABILITY / groups.len().max(1) as f64;
    let (mut parameters, mut changes) = (Vec::new(), Vec::new());
    for keys in &groups {
        let of_key = |key: &&OneEstimate| -> Vec<LogEstimate> {
            let each = found.iter().zip(times);
            each.map(|(source, time)| {
                let own = source.estimates.iter().find(|t| t.is(key));
                LogEstimate {
                    time: *time,
                    value: own.map_or(0.0, |t| t.value),
                    variance: own.map_or(f64::INFINITY, |t| t.variance),
                }
            })
            .collect()
        };
        let estimates: Vec<Vec<LogEstimate>> = keys.iter().map(of_key).collect();
        let own: Vec<&[LogEstimate]> = estimates.iter().map(Vec::as_slice).collect();
        let courses = follow_together(&own, correlation(&found, keys).as_deref(), level);
        for ((key, estimates), course) in keys.iter().zip(&estimates).zip(&courses) {
            changes.extend(changed(key, course, &courses, times));
            parameters.push(tracked(key, course, estimates, times));
        }
    }
    changes.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    Ok(TrackedRobot {
        name: name.to_owned(),
        logs: sources.iter().map(|s| s.name().to_owned()).collect(),
        parameters,
        changes,
    })
}

/// Parameters that are followed together: sizes of the friction of one joint, and each other one by itself.
fn groups(found: &[Source]) -> Vec<Vec<&OneEstimate>> {
    let mut groups: Vec<Vec<&OneEstimate>> = Vec::new();
    for one in found.iter().flat_map(|source| &source.estimates) {
        if groups.iter().flatten().any(|key| key.is(one)) {
            continue;
        }
        let with = |group: &&mut Vec<&OneEstimate>| {
            let alike = |key: &&OneEstimate| key.is_friction() && key.joint == one.joint;
            one.is_friction() && group.iter().any(alike)
        };
        match groups.iter_mut().find(with) {
            Some(group) => group.push(one),
            None => groups.push(vec![one]),
        }
    }
    groups
}

/// Correlation of the errors of estimates of one log, as the logs say it on average, row by row.
fn correlation(found: &[Source], keys: &[&OneEstimate]) -> Option<Vec<f64>> {
    let mean = |one: &OneEstimate, other: &OneEstimate| {
        let all = found
            .iter()
            .filter_map(|source| source.correlation(one, other));
        let all: Vec<f64> = all.collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    let pairs = keys
        .iter()
        .flat_map(|one| keys.iter().map(move |other| mean(one, other)));
    pairs.collect()
}

/// Deviations from none below which a size of friction is not named in a change that others show.
const MIN_SHOWN_DEVIATIONS: f64 = 2.0;

/// Changes of one parameter of those that are followed together.
fn changed(
    key: &OneEstimate,
    course: &ParameterCourse,
    together: &[ParameterCourse],
    times: &[f64],
) -> Vec<TrackedChange> {
    let clear = |c: &ParameterChange| (c.size / c.std).abs();
    let shown = |(i, change): &(usize, &ParameterChange)| {
        let all = together.iter().map(|course| clear(&course.changes[*i]));
        clear(change) >= all.fold(0.0, f64::max).min(MIN_SHOWN_DEVIATIONS)
    };
    let changes = course.changes.iter().enumerate().filter(shown);
    let reported = changes.map(|(_, c)| {
        let before = course.values[c.at.saturating_sub(1)];
        TrackedChange {
            parameter: key.name.clone(),
            joint: key.joint.clone(),
            time: times[c.at],
            size: c.size,
            std: c.std,
            relative: (before != 0.0).then(|| c.size / before.abs()),
            kind: c.kind,
            p_value: c.p_value,
            unit: key.unit.clone(),
            log: c.at,
        }
    });
    reported.collect()
}

/// One parameter over time.
fn tracked(
    key: &OneEstimate,
    course: &ParameterCourse,
    estimates: &[LogEstimate],
    times: &[f64],
) -> TrackedParameter {
    let known = |x: &[f64]| -> Vec<Option<f64>> {
        let pairs = x.iter().zip(&course.std);
        pairs
            .map(|(x, std)| std.is_finite().then_some(*x))
            .collect()
    };
    let of_log = |of: fn(&LogEstimate) -> f64| -> Vec<Option<f64>> {
        let determined = |e: &LogEstimate| e.variance.is_finite().then(|| of(e));
        estimates.iter().map(determined).collect()
    };
    TrackedParameter {
        name: key.name.clone(),
        joint: key.joint.clone(),
        unit: key.unit.clone(),
        times: times.to_vec(),
        values: known(&course.values),
        std: known(&course.std),
        estimates: of_log(|e| e.value),
        estimates_std: of_log(|e| e.variance.sqrt()),
        walk: course.walk,
        scatter: course.scatter,
        outliers: course.outliers.clone(),
        least_seen: course.least_seen,
    }
}

/// Robots that differ from the others.
fn compared(robots: &[TrackedRobot]) -> Vec<FleetDifference> {
    let Some(first) = robots.first() else {
        return Vec::new();
    };
    let mut levels = Vec::new();
    for (robot, tracked) in robots.iter().enumerate() {
        for (parameter, key) in first.parameters.iter().enumerate() {
            let same = |p: &&TrackedParameter| (&p.name, &p.joint) == (&key.name, &key.joint);
            let own = tracked.parameters.iter().find(same);
            let last = own.and_then(|p| Some(((*p.values.last()?)?, (*p.std.last()?)?)));
            if let Some((value, std)) = last {
                levels.push(ParameterLevel {
                    robot,
                    parameter,
                    value,
                    std,
                });
            }
        }
    }
    apart(&levels, FALSE_DIFFERENCE_PROBABILITY)
        .into_iter()
        .map(|one| {
            let key = &first.parameters[one.level.parameter];
            FleetDifference {
                robot: robots[one.level.robot].name.clone(),
                parameter: key.name.clone(),
                joint: key.joint.clone(),
                value: one.level.value,
                usual: one.usual,
                std: one.std,
                p_value: one.p_value,
                unit: key.unit.clone(),
            }
        })
        .collect()
}
