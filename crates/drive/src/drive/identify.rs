//! Drives from logs: the stage as a function of a dataset and a request.

use std::collections::BTreeSet;

use cft_ident_core::robot::Robot;

use super::candidate::DriveEffect;
use super::chain::RobotChains;
use super::error::DriveError;
use super::estimate::{self, LawEstimate};
use super::fit::{DriveProblem, LogPiece};
use super::judge::NUMBERS;
use super::law::DriveLawKind;
use super::roll_out::{COARSE_STEP, FINE_STEP};
use super::search::{self, FoundDrive, StepCertainty};
use super::start;
use super::track::median;
use super::track::{DriveLoad, DriveLog};
use super::unknown::{DriveUnknown, UnknownFrame};

/// Logs by what they are for.
#[derive(Debug, Clone)]
pub struct DriveData {
    pub fitted: Vec<DriveLog>,
    pub held_out: Vec<DriveLog>,
    /// The robot whose links the drives move, with its base parameters.
    pub links: Option<(Robot, Vec<f64>)>,
    pub kind: DriveLawKind,
}

/// What the jackknife leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlocksAre {
    MotionsAndGains,
    /// Too few of those: equal times of the logs.
    Time,
}

/// Time blocks where motions and gains are too few.
const TIME_BLOCKS: usize = 24;

/// Errors of predicted positions.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivePositionErrors {
    /// Log by log, joint by joint: mean size and mean square [rad, rad^2].
    pub logs: Vec<(String, usize, Vec<[f64; 2]>)>,
}

impl DrivePositionErrors {
    fn mean(&self, of: impl Fn(&[f64; 2]) -> f64, joint: Option<usize>) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (_, rows, joints) in &self.logs {
            for (j, error) in joints.iter().enumerate() {
                if joint.is_none_or(|only| only == j) {
                    sum += of(error) * *rows as f64;
                    count += *rows as f64;
                }
            }
        }
        sum / count
    }

    /// Mean size over all samples [rad], of all joints or of one.
    pub fn mae(&self, joint: Option<usize>) -> f64 {
        self.mean(|e| e[0], joint)
    }

    pub fn rmse(&self, joint: Option<usize>) -> f64 {
        self.mean(|e| e[1], joint).sqrt()
    }
}

/// Errors of a model on logs by their use.
#[derive(Debug, Clone)]
pub struct DriveErrorsByUse {
    pub train: DrivePositionErrors,
    pub holdout: Option<DrivePositionErrors>,
    /// Held-out logs, each by a fit without the logs of its motion.
    pub unseen: Option<DrivePositionErrors>,
}

/// What was identified.
#[derive(Debug, Clone)]
pub struct IdentifiedDrives {
    pub found: FoundDrive,
    pub frame: UnknownFrame,
    pub joints: Vec<String>,
    pub blocks_are: BlocksAre,
    pub blocks: usize,
    /// Whether every torque is a ratio to the inertia.
    pub ratios: bool,
    pub before: DriveErrorsByUse,
    pub after: DriveErrorsByUse,
    /// Laws that these data do not tell from the one that is written.
    pub others: OtherLaws,
    /// Positions of some logs, held-out ones first.
    pub courses: Vec<PositionCourse>,
}

/// Laws with another effect in the place of one that is written.
#[derive(Debug, Clone)]
pub struct OtherLaws {
    /// The law that is written, by the steps of the others.
    pub written: LawEstimate,
    /// Each with the effect that it has instead.
    pub each: Vec<(DriveEffect, LawEstimate)>,
}

/// Positions along a log, joint after joint [rad].
#[derive(Debug, Clone, PartialEq)]
pub struct PositionCourse {
    pub log: String,
    pub held_out: bool,
    pub t: Vec<f64>,
    pub command: Vec<Vec<f64>>,
    pub measured: Vec<Vec<f64>>,
    /// Without any effect.
    pub given: Vec<Vec<f64>>,
    /// With those that are written.
    pub refined: Vec<Vec<f64>>,
}

/// Most logs whose positions are kept for pictures.
const COURSES: usize = 24;

/// Identifies the drives of a dataset.
pub fn identify(data: &DriveData, doing: &dyn Fn(&str)) -> Result<IdentifiedDrives, DriveError> {
    let fitted: Vec<&DriveLog> = data.fitted.iter().collect();
    let all: Vec<&DriveLog> = data.fitted.iter().chain(&data.held_out).collect();
    same_joints(&all)?;
    let first = fitted[0];
    let links = data.links.as_ref();
    let chains = links.map(|(robot, theta)| RobotChains::new(robot, theta, &all));
    let chains = chains.as_ref();
    let kind = data.kind;
    let sizes = start::sizes(&fitted, kind, chains);
    let (pieces, blocks, blocks_are) = pieces(&fitted);
    let volts: Vec<f64> = fitted
        .iter()
        .flat_map(|log| log.joints[0].supply.clone())
        .collect();
    let supply = (!volts.is_empty()).then(|| median(volts));
    let mut problem = DriveProblem {
        logs: &fitted,
        frame: UnknownFrame {
            kind,
            supply: match kind {
                DriveLawKind::Volts(_) => supply,
                DriveLawKind::Torque => None,
            },
            joints: first.joints.len(),
            stribeck_speed: sizes.iter().map(|s| STRIBECK_SPEED * s.speed).collect(),
            longest_step: COARSE_STEP,
            held: Vec::new(),
        },
        sizes,
        pieces,
        blocks,
        chains,
    };
    let gravity = match first.load {
        DriveLoad::PendulumRig(_) => true,
        DriveLoad::Robot => {
            chains.is_some_and(|c| c.gravity(first, 0).iter().any(|g| g.abs() > 1e-9))
        }
        DriveLoad::Unknown => false,
    };
    doing("gain, damping, friction");
    let unknowns = start::declared(&fitted, kind);
    let given = estimate::declared(&problem, &unknowns);
    let possible = DriveEffect::possible(kind, gravity, first.load != DriveLoad::Unknown);
    let mut found = search::search(&problem, given, &possible, doing);
    problem = problem.by_steps(FINE_STEP);
    let held_out: Vec<&DriveLog> = data.held_out.iter().collect();
    confirm_held_out(&problem, &mut found, &held_out);
    found.take_sizes();
    shrink(&mut problem, &mut found);
    let bare = DriveProblem {
        frame: UnknownFrame {
            held: Vec::new(),
            ..problem.frame.clone()
        },
        ..problem.clone()
    };
    doing("held-out data");
    leave_no_harm((&mut problem, &bare), &mut found, &held_out);
    found.take_sizes();
    let before = errors(&bare, &found.given, &held_out);
    let after = errors(&problem, &found.refined, &held_out);
    let others = other_laws(&problem, &mut found);
    let drawn = held_out.iter().map(|log| (true, *log));
    let drawn = drawn
        .chain(fitted.iter().map(|log| (false, *log)))
        .take(COURSES);
    let courses = drawn
        .map(|(held_out, log)| PositionCourse {
            log: log.name.clone(),
            held_out,
            t: log.t.clone(),
            command: log.joints.iter().map(|j| j.command.clone()).collect(),
            measured: log.joints.iter().map(|j| j.position.clone()).collect(),
            given: bare.positions(log, &found.given.unknowns, &found.given.values),
            refined: problem.positions(log, &found.refined.unknowns, &found.refined.values),
        })
        .collect();
    Ok(IdentifiedDrives {
        joints: first.joints.iter().map(|j| j.joint.clone()).collect(),
        ratios: first.load == DriveLoad::Unknown,
        frame: problem.frame.clone(),
        found,
        blocks_are,
        blocks,
        before,
        after,
        others,
        courses,
    })
}

impl DriveData {
    /// The same joint by joint, where no links couple several; logs in which a joint rests are none of its own.
    ///
    /// # Errors
    /// A joint that rests in every log that is fitted.
    pub fn by_joint(&self) -> Result<Vec<DriveData>, DriveError> {
        let joints = self.fitted.first().map_or(0, |log| log.joints.len());
        if self.links.is_some() || joints < 2 {
            return Ok(vec![self.clone()]);
        }
        for track in &self.fitted[0].joints {
            let own = |log: &DriveLog| {
                log.joints
                    .iter()
                    .any(|t| t.joint == track.joint && !t.rests)
            };
            if !self.fitted.iter().any(own) {
                return Err(DriveError::Request {
                    what: format!(
                        "joint {}: command or position never moves in the logs that are fitted",
                        track.joint
                    ),
                    remedy: "check the columns of this joint, give a log in which it moves, or leave it out"
                        .to_owned(),
                });
            }
        }
        let only = |logs: &[DriveLog], j: usize| {
            let one = |log: &DriveLog| {
                let track = log.joints.get(j).filter(|track| !track.rests)?.clone();
                Some(DriveLog {
                    joints: vec![track],
                    ..log.clone()
                })
            };
            logs.iter().filter_map(one).collect()
        };
        let of = |j| DriveData {
            fitted: only(&self.fitted, j),
            held_out: only(&self.held_out, j),
            links: None,
            kind: self.kind,
        };
        Ok((0..joints).map(of).collect())
    }
}

/// Positions of joints that were identified one by one, log by log.
pub fn joined_courses(each: &[IdentifiedDrives]) -> Vec<PositionCourse> {
    let Some((first, rest)) = each.split_first() else {
        return Vec::new();
    };
    // a log in which one of the joints rests has no course of it
    let in_all = |course: &PositionCourse| {
        let has = |of: &IdentifiedDrives| of.courses.iter().any(|c| c.log == course.log);
        rest.iter().all(has)
    };
    let mut out: Vec<PositionCourse> = first
        .courses
        .iter()
        .filter(|c| in_all(c))
        .cloned()
        .collect();
    for other in rest {
        for course in &mut out {
            let Some(more) = other.courses.iter().find(|c| c.log == course.log) else {
                continue;
            };
            course.command.extend(more.command.iter().cloned());
            course.measured.extend(more.measured.iter().cloned());
            course.given.extend(more.given.iter().cloned());
            course.refined.extend(more.refined.iter().cloned());
        }
    }
    out
}

/// vs over the speed that a joint reaches.
const STRIBECK_SPEED: f64 = 0.05;

fn same_joints(logs: &[&DriveLog]) -> Result<(), DriveError> {
    let wrong = |what: String, remedy: &str| DriveError::Request {
        what,
        remedy: remedy.to_owned(),
    };
    let Some(first) = logs.first() else {
        return Err(wrong(
            "no log is left to fit".to_owned(),
            "hold out fewer logs",
        ));
    };
    for log in logs {
        let same = log.joints.len() == first.joints.len();
        if !same || std::mem::discriminant(&log.load) != std::mem::discriminant(&first.load) {
            return Err(wrong(
                format!("{} and {} are not of one machine", first.name, log.name),
                "identify each machine by itself",
            ));
        }
    }
    Ok(())
}

/// How logs are cut into blocks.
fn pieces(logs: &[&DriveLog]) -> (Vec<LogPiece>, usize, BlocksAre) {
    let names: Vec<_> = logs.iter().map(|log| log.block()).collect();
    let each: BTreeSet<_> = names.iter().cloned().collect();
    if each.len() >= NUMBERS.blocks {
        let whole = logs.iter().enumerate().map(|(l, log)| LogPiece {
            log: l,
            from: 0,
            to: log.t.len(),
            block: each.iter().position(|name| *name == names[l]).unwrap_or(0),
        });
        return (whole.collect(), each.len(), BlocksAre::MotionsAndGains);
    }
    let total: usize = logs.iter().map(|log| log.t.len()).sum();
    let long = total.div_ceil(TIME_BLOCKS);
    let (mut out, mut block, mut room) = (Vec::new(), 0, long);
    for (l, log) in logs.iter().enumerate() {
        let mut from = 0;
        while from < log.t.len() {
            let to = (from + room).min(log.t.len());
            out.push(LogPiece {
                log: l,
                from,
                to,
                block,
            });
            room -= to - from;
            if room == 0 {
                (block, room) = (block + 1, long);
            }
            from = to;
        }
    }
    let blocks = if room == long { block } else { block + 1 };
    (out, blocks, BlocksAre::Time)
}

/// Errors of a solution on logs.
pub fn errors_on(
    problem: &DriveProblem,
    at: &LawEstimate,
    logs: &[&DriveLog],
) -> DrivePositionErrors {
    let on = DriveProblem {
        logs,
        pieces: Vec::new(),
        blocks: 0,
        ..problem.clone()
    };
    let residuals = on.residuals(&at.unknowns, &at.values);
    let of = |(log, joints): (&&DriveLog, Vec<Vec<f64>>)| {
        let rows = log.t.len();
        let sums = joints.iter().map(|r| {
            let mean = |of: fn(f64) -> f64| r.iter().map(|r| of(*r)).sum::<f64>() / rows as f64;
            [mean(f64::abs), mean(|r| r * r)]
        });
        (log.name.clone(), rows, sums.collect())
    };
    DrivePositionErrors {
        logs: logs.iter().zip(residuals).map(of).collect(),
    }
}

fn errors(problem: &DriveProblem, at: &LawEstimate, held_out: &[&DriveLog]) -> DriveErrorsByUse {
    DriveErrorsByUse {
        train: errors_on(problem, at, problem.logs),
        holdout: (!held_out.is_empty()).then(|| errors_on(problem, at, held_out)),
        unseen: unseen(problem, at, held_out),
    }
}

/// Errors on held-out logs, each by a fit without its motion; none where no motion was fitted.
fn unseen(
    problem: &DriveProblem,
    at: &LawEstimate,
    held_out: &[&DriveLog],
) -> Option<DrivePositionErrors> {
    let motions: BTreeSet<&str> = held_out.iter().map(|log| log.motion.as_str()).collect();
    let mut logs = Vec::new();
    for motion in motions {
        let kept: Vec<usize> = (0..problem.logs.len())
            .filter(|l| problem.logs[*l].motion != motion)
            .collect();
        if kept.is_empty() {
            continue;
        }
        let rest: Vec<&DriveLog> = kept.iter().map(|l| problem.logs[*l]).collect();
        let (pieces, blocks, _) = pieces(&rest);
        let without = DriveProblem {
            logs: &rest,
            pieces,
            blocks,
            ..problem.by_steps(COARSE_STEP)
        };
        let fitted = match kept.len() == problem.logs.len() {
            true => at.clone(),
            false => {
                let scales = without.scales(&at.unknowns, &at.values);
                let fitted = without.fit(&at.unknowns, &at.values, &scales, UNSEEN_STEPS);
                LawEstimate {
                    values: fitted.values,
                    ..at.clone()
                }
            }
        };
        let of: Vec<&DriveLog> = held_out
            .iter()
            .filter(|log| log.motion == motion)
            .copied()
            .collect();
        logs.extend(errors_on(problem, &fitted, &of).logs);
    }
    (!logs.is_empty()).then_some(DrivePositionErrors { logs })
}

/// Steps of a fit without a motion, from the fit with it.
const UNSEEN_STEPS: usize = 8;

/// Steps that make held-out logs worse leave, by the fit to all others or by one that saw no log of their motion.
fn confirm_held_out(problem: &DriveProblem, found: &mut FoundDrive, held_out: &[&DriveLog]) {
    if held_out.is_empty() {
        return;
    }
    // what foretells a motion that was fitted at another gain may still fail at one that was not
    let errors = |law: &LawEstimate| {
        let unseen = unseen(problem, law, held_out);
        [Some(errors_on(problem, law, held_out)), unseen].map(|errors| errors.map(|e| e.mae(None)))
    };
    let mut with = errors(&found.refined);
    for at in (0..found.steps.len()).rev() {
        if !found.steps[at].written() {
            continue;
        }
        let less = estimate::without(problem, &found.refined, found.steps[at].effect);
        let without = errors(&less);
        let mut pairs = with.iter().zip(&without);
        if pairs.any(|(with, without)| with > without) {
            found.steps[at].status = StepCertainty::HeldOutWorse;
            (found.refined, with) = (less, without);
        }
    }
}

/// Shapes of friction that are not confirmed are held at s times their estimate, everything else fitted around them.
fn shrink(problem: &mut DriveProblem, found: &mut FoundDrive) {
    let steps = found.steps.iter().filter(|step| step.written());
    let indicated = steps.filter(|step| step.status == StepCertainty::Indicated);
    let smaller: Vec<_> = indicated
        .map(|step| {
            let s = step.judged.shrinkage;
            let held = step.unknowns.iter().zip(&step.values);
            let held: Vec<(DriveUnknown, f64)> = held.map(|(u, x)| (*u, s * x)).collect();
            (step.effect, held)
        })
        .collect();
    for (effect, held) in smaller {
        problem.frame.held.extend(held);
        found.refined = estimate::without(problem, &found.refined, effect);
    }
}

/// What is written is no worse on held-out logs than the law without effects: while it is, the least sure effect leaves.
fn leave_no_harm(
    (problem, bare): (&mut DriveProblem, &DriveProblem),
    found: &mut FoundDrive,
    held_out: &[&DriveLog],
) {
    if held_out.is_empty() {
        return;
    }
    let errors = |problem: &DriveProblem, law: &LawEstimate| {
        let unseen = unseen(problem, law, held_out);
        [Some(errors_on(problem, law, held_out)), unseen].map(|errors| errors.map(|e| e.mae(None)))
    };
    let without = errors(bare, &found.given);
    loop {
        let with = errors(problem, &found.refined);
        let mut pairs = with.iter().zip(&without);
        if !pairs.any(|(with, without)| with > without) {
            return;
        }
        let written = found.steps.iter_mut().filter(|step| step.written());
        let least = written.min_by(|a, b| a.judged.shrinkage.total_cmp(&b.judged.shrinkage));
        let Some(step) = least else {
            // it is the refit of the declared numbers
            found.refined = found.given.clone();
            return;
        };
        step.status = StepCertainty::HeldOutWorse;
        let gone = step.unknowns.clone();
        (problem.frame.held).retain(|(unknown, _)| !gone.contains(unknown));
        found.refined = estimate::without(problem, &found.refined, step.effect);
    }
}

/// The laws that do nearly as well in the end: a written effect exchanged for one that stood beside it when it joined.
/// What stands in the model too, or does worse with everything else fitted, is no alternative.
fn other_laws(problem: &DriveProblem, found: &mut FoundDrive) -> OtherLaws {
    let written = found.steps.iter().filter(|step| step.written());
    let written: Vec<DriveEffect> = written.map(|step| step.effect).collect();
    for step in &mut found.steps {
        let stands = written.contains(&step.effect);
        (step.alternatives).retain(|other| stands && !written.contains(other));
    }
    let mut out = OtherLaws {
        written: found.refined.clone(),
        each: Vec::new(),
    };
    if found.steps.iter().all(|step| step.alternatives.is_empty()) {
        return out;
    }
    let coarse = problem.by_steps(COARSE_STEP);
    let LawEstimate {
        unknowns, values, ..
    } = &found.refined;
    out.written = estimate::fit(&coarse, unknowns, values, Some(&found.refined.scales));
    for step in &mut found.steps {
        let own = step.effect;
        step.alternatives.retain(|other| {
            let near = search::near_exchange(&coarse, &out.written, own, *other);
            let is_near = near.is_some();
            out.each.extend(near.map(|law| (*other, law)));
            is_near
        });
    }
    out
}
