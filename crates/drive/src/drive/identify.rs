//! Drives from logs: the stage as a function of a dataset and a request.

use cft_ident_core::robot::Robot;

use super::blocks::{BlocksAre, pieces};
use super::candidate::DriveEffect;
use super::chain::RobotChains;
use super::error::DriveError;
use super::estimate::{self, LawEstimate};
use super::fit::DriveProblem;
use super::held_out::{DriveErrorsByUse, confirm_held_out, errors, leave_no_harm};
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
    /// As in [`DriveLog::number`].
    pub number: usize,
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
    let before = errors(&bare, &found.given, &held_out);
    let after = leave_no_harm(&mut problem, &mut found, (&held_out, &before));
    found.take_sizes();
    let others = other_laws(&problem, &mut found);
    let drawn = held_out.iter().map(|log| (true, *log));
    let drawn = drawn
        .chain(fitted.iter().map(|log| (false, *log)))
        .take(COURSES);
    let courses = drawn
        .map(|(held_out, log)| PositionCourse {
            log: log.name.clone(),
            number: log.number,
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
        let only = |logs: &[DriveLog], j: usize| {
            let one = |(number, log): (usize, &DriveLog)| {
                let track = log.joints.get(j).filter(|track| !track.rests)?.clone();
                Some(DriveLog {
                    number,
                    joints: vec![track],
                    ..log.clone()
                })
            };
            logs.iter().enumerate().filter_map(one).collect()
        };
        let of = |j: usize| {
            let fitted: Vec<DriveLog> = only(&self.fitted, j);
            if fitted.is_empty() {
                return Err(DriveError::Request {
                    what: format!(
                        "joint {}: command or position never moves in the logs that are fitted",
                        self.fitted[0].joints[j].joint
                    ),
                    remedy: "check the columns of this joint, give a log in which it moves, or leave it out"
                        .to_owned(),
                });
            }
            Ok(DriveData {
                fitted,
                held_out: only(&self.held_out, j),
                links: None,
                kind: self.kind,
            })
        };
        (0..joints).map(of).collect()
    }
}

/// Positions of joints that were identified one by one, log by log.
pub fn joined_courses(each: &[IdentifiedDrives]) -> Vec<PositionCourse> {
    let Some((first, rest)) = each.split_first() else {
        return Vec::new();
    };
    let same =
        |a: &PositionCourse, b: &PositionCourse| (a.held_out, a.number) == (b.held_out, b.number);
    // a log in which one of the joints rests has no course of it
    let in_all = |course: &&PositionCourse| {
        let mut rest = rest.iter();
        rest.all(|of| of.courses.iter().any(|c| same(c, course)))
    };
    let mut out: Vec<PositionCourse> = first.courses.iter().filter(in_all).cloned().collect();
    for other in rest {
        for course in &mut out {
            let Some(more) = other.courses.iter().find(|c| same(c, course)) else {
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
