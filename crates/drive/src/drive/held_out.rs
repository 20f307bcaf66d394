//! What held-out logs say of a law: its errors on them, and the effects that leave by them.

use std::collections::BTreeSet;

use super::blocks::pieces;
use super::estimate::{self, LawEstimate};
use super::fit::DriveProblem;
use super::roll_out::COARSE_STEP;
use super::search::{FoundDrive, StepCertainty};
use super::track::DriveLog;

/// Errors of predicted positions.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivePositionErrors {
    pub logs: Vec<LogErrors>,
}

/// The same of one log.
#[derive(Debug, Clone, PartialEq)]
pub struct LogErrors {
    pub name: String,
    /// As in [`DriveLog::number`].
    pub number: usize,
    pub rows: usize,
    /// Joint by joint: mean size and mean square [rad, rad^2].
    pub joints: Vec<[f64; 2]>,
}

impl DrivePositionErrors {
    fn mean(&self, of: impl Fn(&[f64; 2]) -> f64, joint: Option<usize>) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for log in &self.logs {
            for (j, error) in log.joints.iter().enumerate() {
                if joint.is_none_or(|only| only == j) {
                    sum += of(error) * log.rows as f64;
                    count += log.rows as f64;
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
        LogErrors {
            name: log.name.clone(),
            number: log.number,
            rows,
            joints: sums.collect(),
        }
    };
    DrivePositionErrors {
        logs: logs.iter().zip(residuals).map(of).collect(),
    }
}

pub(super) fn errors(
    problem: &DriveProblem,
    at: &LawEstimate,
    held_out: &[&DriveLog],
) -> DriveErrorsByUse {
    by_use(problem, at, errors_held_out(problem, at, held_out))
}

fn by_use(
    problem: &DriveProblem,
    at: &LawEstimate,
    [holdout, unseen]: HeldOutErrors,
) -> DriveErrorsByUse {
    DriveErrorsByUse {
        train: errors_on(problem, at, problem.logs),
        holdout,
        unseen,
    }
}

/// By the fit to all others, and by one that saw no log of their motion: what foretells a motion that was fitted at another
/// gain may still fail at one that was not.
type HeldOutErrors = [Option<DrivePositionErrors>; 2];

fn errors_held_out(
    problem: &DriveProblem,
    at: &LawEstimate,
    held_out: &[&DriveLog],
) -> HeldOutErrors {
    let by_all = (!held_out.is_empty()).then(|| errors_on(problem, at, held_out));
    [by_all, unseen(problem, at, held_out)]
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

/// Whether the mean errors of one law are above those of another.
fn is_worse(
    with: [&Option<DrivePositionErrors>; 2],
    without: [&Option<DrivePositionErrors>; 2],
) -> bool {
    let mean = |errors: &Option<DrivePositionErrors>| errors.as_ref().map(|e| e.mae(None));
    let mut pairs = with.into_iter().zip(without);
    pairs.any(|(with, without)| mean(with) > mean(without))
}

/// Steps that make held-out logs worse leave, by the fit to all others or by one that saw no log of their motion.
pub(super) fn confirm_held_out(
    problem: &DriveProblem,
    found: &mut FoundDrive,
    held_out: &[&DriveLog],
) {
    if held_out.is_empty() {
        return;
    }
    let errors = |law: &LawEstimate| errors_held_out(problem, law, held_out);
    let mut with = errors(&found.refined);
    for at in (0..found.steps.len()).rev() {
        if !found.steps[at].written() {
            continue;
        }
        let less = estimate::without(problem, &found.refined, found.steps[at].effect);
        let without = errors(&less);
        if is_worse(with.each_ref(), without.each_ref()) {
            found.steps[at].status = StepCertainty::HeldOutWorse;
            (found.refined, with) = (less, without);
        }
    }
}

/// What is written is no worse on held-out logs than the law without effects: while it is, the least sure effect leaves.
/// Gives its errors.
pub(super) fn leave_no_harm(
    problem: &mut DriveProblem,
    found: &mut FoundDrive,
    (held_out, without): (&[&DriveLog], &DriveErrorsByUse),
) -> DriveErrorsByUse {
    loop {
        let with = errors_held_out(problem, &found.refined, held_out);
        if !is_worse(with.each_ref(), [&without.holdout, &without.unseen]) {
            return by_use(problem, &found.refined, with);
        }
        let written = found.steps.iter_mut().filter(|step| step.written());
        let least = written.min_by(|a, b| a.judged.shrinkage.total_cmp(&b.judged.shrinkage));
        let Some(step) = least else {
            // it is the refit of the declared numbers
            found.refined = found.given.clone();
            return errors(problem, &found.refined, held_out);
        };
        step.status = StepCertainty::HeldOutWorse;
        let gone = step.unknowns.clone();
        (problem.frame.held).retain(|(unknown, _)| !gone.contains(unknown));
        found.refined = estimate::without(problem, &found.refined, step.effect);
    }
}
