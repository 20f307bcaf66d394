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

pub(super) fn errors(
    problem: &DriveProblem,
    at: &LawEstimate,
    held_out: &[&DriveLog],
) -> DriveErrorsByUse {
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

/// Mean position errors on held-out logs, by the fit to all others and by one that saw no log of their motion: what
/// foretells a motion that was fitted at another gain may still fail at one that was not.
fn means(problem: &DriveProblem, law: &LawEstimate, held_out: &[&DriveLog]) -> [Option<f64>; 2] {
    let unseen = unseen(problem, law, held_out);
    [Some(errors_on(problem, law, held_out)), unseen].map(|errors| errors.map(|e| e.mae(None)))
}

fn is_worse(with: [Option<f64>; 2], without: [Option<f64>; 2]) -> bool {
    let mut pairs = with.iter().zip(&without);
    pairs.any(|(with, without)| with > without)
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
    let errors = |law: &LawEstimate| means(problem, law, held_out);
    let mut with = errors(&found.refined);
    for at in (0..found.steps.len()).rev() {
        if !found.steps[at].written() {
            continue;
        }
        let less = estimate::without(problem, &found.refined, found.steps[at].effect);
        let without = errors(&less);
        if is_worse(with, without) {
            found.steps[at].status = StepCertainty::HeldOutWorse;
            (found.refined, with) = (less, without);
        }
    }
}

/// What is written is no worse on held-out logs than the law without effects: while it is, the least sure effect leaves.
pub(super) fn leave_no_harm(
    (problem, bare): (&mut DriveProblem, &DriveProblem),
    found: &mut FoundDrive,
    held_out: &[&DriveLog],
) {
    if held_out.is_empty() {
        return;
    }
    let without = means(bare, &found.given, held_out);
    while is_worse(means(problem, &found.refined, held_out), without) {
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
