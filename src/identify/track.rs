//! The parameters of robots over their logs: what each log tells by itself, followed in order of time.

use std::collections::BTreeMap;
use std::slice::from_ref;
use std::sync::Arc;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::control::Control;
use super::error::IdentifyError;
use super::estimate::estimate;
use super::log::Log;
use super::logged_robot::LoggedRobot;
use super::passes::Passes;
use super::reduced::reduced_log::{MadeWith, ReducedLog};
use super::track_error::TrackError;
use super::unknowns::columns;
use crate::config::campaign::EstimatorKind;
use crate::config::identified::{friction_unit, inertia_unit};
use crate::config::{ModelFile, RobotFile};
use crate::log::Provenance;
use crate::track::{Change, ChangeKind, Estimate, Level, apart, follow};
use crate::verdict::Verdict;

/// Probability at which changes are told of a robot that has none, all its parameters together, at one look. A robot is
/// looked at after each of its logs, and payloads follow no normal law: over fifty logs there are more
/// (`examples/study_track`).
const ALARMS: f64 = 0.0005;
/// The same of robots of a fleet that are alike.
const DIFFERENCES: f64 = 0.01;
/// A time between two logs over the usual one from which on the clock is doubted.
const JUMP: f64 = 1000.0;

/// What a robot's parameters are taken from.
#[derive(Debug, Clone)]
pub enum TrackSource {
    /// A reduced log; `file` counts the files in the order in which they are given.
    Part { log: Arc<ReducedLog>, file: usize },
    /// A model that was identified.
    Model {
        name: String,
        file: Box<ModelFile>,
        provenance: Provenance,
    },
}

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
    pub warnings: Vec<String>,
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
    /// Smoothed \[unit\]; null where no log tells the parameter.
    pub values: Vec<Option<f64>>,
    /// Standard deviations of these.
    pub std: Vec<Option<f64>>,
    /// What each log tells by itself, and its standard deviation.
    pub estimates: Vec<Option<f64>>,
    pub estimates_std: Vec<Option<f64>>,
    /// Standard deviation of the random walk from log to log.
    pub walk: f64,
    /// Standard deviation by which estimates scatter beyond their own.
    pub scatter: f64,
    /// Numbers of the logs whose estimate stands alone, from 0.
    pub outliers: Vec<usize>,
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
    /// Probability of one as clear in this course without a change.
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

/// What one source tells of one parameter.
#[derive(Debug, Clone, PartialEq)]
struct Told {
    name: String,
    joint: Option<String>,
    unit: String,
    value: f64,
    variance: f64,
}

/// Follows the parameters of robots.
///
/// # Errors
/// Sources that cannot be ordered or belong to other robots, and interruption.
pub fn track(robots: &[RobotSources], control: &Control) -> Result<Tracked, IdentifyError> {
    if robots.iter().all(|r| r.sources.is_empty()) {
        return Err(TrackError::Empty.into());
    }
    let work = control.begin("tracking", Some(robots.len() as u64));
    let (mut inputs, mut warnings) = (Vec::new(), Vec::new());
    let mut all = Vec::new();
    for robot in robots {
        let (sources, times) = ordered(robot, &mut warnings)?;
        inputs.extend(sources.iter().map(|s| s.provenance().clone()));
        all.push(followed(&robot.name, &sources, &times, control)?);
        if sources.len() == 1 {
            warnings.push(format!(
                "{}: one log, {}: there is no course to follow",
                robot.name,
                sources[0].name()
            ));
        }
        work.advance(1);
    }
    let fleet = compared(&all);
    Ok(Tracked {
        robots: all,
        fleet,
        inputs,
        warnings,
    })
}

impl TrackSource {
    fn name(&self) -> &str {
        match self {
            Self::Part { log, .. } => log.name(),
            Self::Model { name, .. } => name,
        }
    }

    fn provenance(&self) -> &Provenance {
        match self {
            Self::Part { log, .. } => &log.provenance,
            Self::Model { provenance, .. } => provenance,
        }
    }

    /// Its name with the span of a log.
    fn shown(&self) -> String {
        match (self, &self.provenance().span) {
            (Self::Part { .. }, Some(span)) => format!("{}@{span}", self.name()),
            _ => self.name().to_owned(),
        }
    }

    /// The logs that it tells of; the model file itself where it names none.
    fn rows(&self) -> &[Provenance] {
        match self {
            Self::Model { file, .. } if !file.provenance.inputs.is_empty() => {
                &file.provenance.inputs
            }
            _ => from_ref(self.provenance()),
        }
    }

    /// Whether both tell of the same rows: parts of any, models of all.
    fn same_rows(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Part { log: a, .. }, Self::Part { log: b, .. }) => a.shares_rows(b),
            _ => {
                let (a, b) = (self.rows(), other.rows());
                let same =
                    |(a, b): (&Provenance, &Provenance)| a.sha256 == b.sha256 && a.span == b.span;
                a.len() == b.len() && a.iter().zip(b).all(same)
            }
        }
    }

    /// First and last time, where it is known.
    fn bounds(&self) -> Option<[f64; 2]> {
        match self {
            Self::Part { log, .. } => Some(log.bounds_s),
            Self::Model { .. } => None,
        }
    }
}

/// Sources in order of time, and their times.
fn ordered(
    robot: &RobotSources,
    warnings: &mut Vec<String>,
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
    let numbered = |warnings: &mut Vec<String>, why: &str| {
        warnings.push(format!(
            "{}: {why}: they are taken in the order in which they are given, and their numbers stand for times",
            robot.name
        ));
        (0..given.len()).map(|k| k as f64).collect()
    };
    let Some(bounds) = bounds else {
        let times = numbered(warnings, "models have no time of their own");
        return Ok((given.clone(), times));
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
        let times = numbered(warnings, "the clocks of these logs overlap");
        return Ok((given.clone(), times));
    }
    if places.windows(2).any(|p| p[0] > p[1]) {
        let separate = given.iter().enumerate().all(|(k, s)| match s {
            TrackSource::Part { file, .. } => *file == k,
            TrackSource::Model { .. } => true,
        });
        if separate {
            warnings.push(format!(
                "{}: the logs are given out of order; they are followed in order of their clocks",
                robot.name
            ));
        }
    }
    let times: Vec<f64> = places.iter().map(|k| bounds[*k][0]).collect();
    warnings.extend(jump(robot, &places, &times));
    Ok((places.iter().map(|k| given[*k].clone()).collect(), times))
}

/// Two sources that tell the same: spans of one log that meet, a log under two names, and models of the same rows.
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

/// A time between two logs that is no time between two logs, as a warning.
fn jump(robot: &RobotSources, places: &[usize], times: &[f64]) -> Option<String> {
    let mut steps: Vec<f64> = times.windows(2).map(|p| p[1] - p[0]).collect();
    let far = steps.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
    let (at, far) = far.map(|(at, far)| (at, *far))?;
    steps.sort_by(f64::total_cmp);
    let usual = steps[steps.len() / 2];
    (steps.len() > 2 && usual > 0.0 && far > JUMP * usual).then(|| {
        format!(
            "{}: the clock jumps by {far:.0} s between {} and {}, {JUMP} times the usual time between logs or more; if it was set there, give numbers of seconds that run on",
            robot.name,
            robot.sources[places[at]].name(),
            robot.sources[places[at + 1]].name()
        )
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

/// What a model tells.
fn of_model(file: &ModelFile) -> Vec<Told> {
    let told = |p: &crate::config::model_file::Parameter| {
        let known = p.verdict != Some(Verdict::NotIdentifiable);
        let std = p.std.filter(|std| known && *std > 0.0);
        Told {
            name: p.name.clone(),
            joint: p.joint.clone(),
            unit: p.unit.clone(),
            value: p.value,
            variance: std.map_or(f64::INFINITY, |std| std * std),
        }
    };
    file.parameters.iter().map(told).collect()
}

/// What a reduced log tells by itself; all that is not determined has an infinite variance.
fn of_part(part: &Arc<ReducedLog>, control: &Control) -> Result<Vec<Told>, IdentifyError> {
    let name = format!("the robot file of {}", part.name().replace('.', "-"));
    let file = RobotFile::parse(&name, &part.made_with.robot_file)?;
    let machine = LoggedRobot::new(&name, file);
    part.belongs_to_robot(&machine.file)?;
    let log = Log::Reduced(part.clone());
    let known = part.known_friction();
    let linear = columns(&machine, known.as_deref());
    let mut passes = Passes::new(&machine, from_ref(&log), control);
    let found = match estimate(&mut passes, linear.clone(), EstimatorKind::Wls, false) {
        Ok(found) => Some(found.fit),
        // a log that tells nothing is a log that tells nothing
        Err(IdentifyError::Fit(_)) => None,
        Err(error) => return Err(error),
    };
    let robot = &machine.robot;
    let inertial = robot.parameters().iter().map(|info| {
        let unit = inertia_unit(robot, &info.unit, machine.file.inertial_torque_unit());
        (info.name.to_string(), None, unit)
    });
    let joints = robot.joint_names().iter().enumerate();
    let own = joints.flat_map(|(j, joint)| {
        let unit = machine.file.torque_unit(j);
        linear.own[j].iter().map(move |own| {
            let unit = friction_unit(robot, j, own.name(), unit);
            (own.name().to_owned(), Some(joint.clone()), unit)
        })
    });
    let named = inertial.chain(own).enumerate();
    Ok(named
        .map(|(i, (name, joint, unit))| {
            let told = found.as_ref().filter(|fit| fit.determined[i]);
            let variance = told.map(|fit| fit.covariance[(i, i)]);
            Told {
                name,
                joint,
                unit,
                value: told.map_or(0.0, |fit| fit.theta[i]),
                variance: variance.filter(|v| *v > 0.0).unwrap_or(f64::INFINITY),
            }
        })
        .collect())
}

/// One robot over its sources in order of time.
fn followed(
    name: &str,
    sources: &[TrackSource],
    times: &[f64],
    control: &Control,
) -> Result<TrackedRobot, IdentifyError> {
    let told: Vec<Vec<Told>> = sources
        .par_iter()
        .map(|source| {
            if control.stopped() {
                return Err(IdentifyError::Interrupted);
            }
            match source {
                TrackSource::Part { log, .. } => of_part(log, control),
                TrackSource::Model { file, .. } => Ok(of_model(file)),
            }
        })
        .collect::<Result<_, _>>()?;
    let mut keys: Vec<&Told> = Vec::new();
    for one in told.iter().flatten() {
        if !keys
            .iter()
            .any(|k| (&k.name, &k.joint) == (&one.name, &one.joint))
        {
            keys.push(one);
        }
    }
    let level = ALARMS / keys.len().max(1) as f64;
    let (mut parameters, mut changes) = (Vec::new(), Vec::new());
    for key in keys {
        let estimates: Vec<Estimate> = told
            .iter()
            .zip(times)
            .map(|(told, time)| {
                let same = |t: &&Told| (&t.name, &t.joint) == (&key.name, &key.joint);
                let own = told.iter().find(same);
                Estimate {
                    time: *time,
                    value: own.map_or(0.0, |t| t.value),
                    variance: own.map_or(f64::INFINITY, |t| t.variance),
                }
            })
            .collect();
        let course = follow(&estimates, level);
        let change = |c: &Change| {
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
        };
        changes.extend(course.changes.iter().map(change));
        let known = |x: &[f64]| -> Vec<Option<f64>> {
            let pairs = x.iter().zip(&course.std);
            pairs
                .map(|(x, std)| std.is_finite().then_some(*x))
                .collect()
        };
        let of_log = |of: fn(&Estimate) -> f64| -> Vec<Option<f64>> {
            let told = |e: &Estimate| e.variance.is_finite().then(|| of(e));
            estimates.iter().map(told).collect()
        };
        parameters.push(TrackedParameter {
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
        });
    }
    changes.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    Ok(TrackedRobot {
        name: name.to_owned(),
        logs: sources.iter().map(|s| s.name().to_owned()).collect(),
        parameters,
        changes,
    })
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
                levels.push(Level {
                    robot,
                    parameter,
                    value,
                    std,
                });
            }
        }
    }
    apart(&levels, DIFFERENCES)
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
