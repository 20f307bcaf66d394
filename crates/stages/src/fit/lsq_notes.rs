//! What is noticed of a fit.

use super::computed_torque::{asked_for, unused_commands};
use super::consistent::ConsistentLinks;
use super::contact::contacts_in;
use super::estimate::{EstimatorAccount, InertialEstimate};
use super::judged_estimate::JudgedEstimate;
use super::lsq_problem::LsqProblem;
use crate::input::error::IdentifyError;
use crate::input::lsq_rows::LsqRows;
use crate::input::robot_setup::RobotSetup;
use crate::input::unknowns::FittedUnknown;
use crate::note::{FitNote, NumberWithStd, StageNote};
use cft_ident_core::inertia::accumulate::BlockFactors;
use cft_ident_core::inertia::between_logs::disagreeing_log;
use cft_ident_core::inertia::instruments::ReferenceSource;
use cft_ident_core::inertia::solution::ConfoundedUnknowns;
use cft_ident_core::inertia::solve::Fit;
use cft_ident_core::math::descent::IterationEnding;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::model_file::is_positive;

/// Unknowns of a combination that are named.
const NAMED_TERMS: usize = 6;

/// All of a fit, in order: of the logs' motion, of the robot file and the method, of the rows, of the numbers. `bridged` is
/// what the bridges of spikes move.
pub(crate) fn lsq_notes(
    problem: &LsqProblem,
    rows: &LsqRows,
    judged: &JudgedEstimate,
    bridged: Option<FitNote>,
) -> Result<Vec<StageNote>, IdentifyError> {
    let (setup, estimate) = (&problem.data.setup, &judged.estimate);
    let gains = problem.settings.gains.iter();
    let mut notes = contacts_in(rows)?;
    let unused = unused_commands(setup, &problem.data.logs);
    notes.extend(
        unused
            .into_iter()
            .map(|(key, columns)| StageNote::Fit(FitNote::UnusedCommands { key, columns })),
    );
    notes.extend(asked_for(setup, &problem.data.logs).map(StageNote::Fit));
    notes.extend(StageNote::of_robot(&setup.file));
    notes.extend(gains.flat_map(|gains| gains.notes.clone()));
    notes.extend(of_method(problem, judged).map(StageNote::Fit));
    notes.extend(rows.notes());
    let failed = judged.not_consistent.then_some(FitNote::NotConsistent);
    let resting = rests(setup, &estimate.basis.sums.resting_shares());
    notes.extend(failed.into_iter().chain(resting).map(StageNote::Fit));
    notes.extend(disagreement(setup, rows, &estimate.basis.by_log));
    notes.extend(doubts_of_friction(problem, judged)?);
    let doubts = confounded(&estimate.fit, &judged.unknowns);
    let doubts = bridged.into_iter().chain(doubts);
    let of_numbers = doubts.chain(negative(&judged.unknowns));
    notes.extend(of_numbers.map(StageNote::Fit));
    notes.extend(judged.wrong_cutoffs.iter().cloned());
    let geometry = judged.geometry.iter().cloned().map(Box::new);
    notes.extend(geometry.map(FitNote::Geometry).map(StageNote::Fit));
    Ok(notes)
}

/// A log that one fit does not bring together with the others.
fn disagreement(setup: &RobotSetup, rows: &LsqRows, by_log: &BlockFactors) -> Option<StageNote> {
    let found = disagreeing_log(by_log).ok().flatten()?;
    let names = rows.names_in_order();
    Some(StageNote::Fit(FitNote::Disagrees {
        log: names.get(found.log)?.clone(),
        other: (names.len() == 2).then(|| names[1 - found.log].clone()),
        joint: setup.robot.joint_names()[found.joint].clone(),
        own: found.own,
        others: found.others,
    }))
}

/// What is noticed of how the fit was made.
fn of_method(problem: &LsqProblem, judged: &JudgedEstimate) -> impl Iterator<Item = FitNote> {
    let consistent = judged.consistent.iter().flat_map(ConsistentLinks::notes);
    let law = problem.law;
    let fitted = problem.before.is_none();
    let fitted = fitted.then_some(FitNote::FrictionFitted { law });
    consistent
        .chain(fitted)
        .chain(judged.estimate.account.notes())
        .chain(problem.friction_of_reduced())
}

/// Joints whose known friction the logs contradict, and those that move faster than in the logs of their friction; none
/// where the fit has the friction among its unknowns.
fn doubts_of_friction(
    problem: &LsqProblem,
    judged: &JudgedEstimate,
) -> Result<Vec<StageNote>, IdentifyError> {
    let InertialEstimate {
        columns,
        covariance,
        contradicted,
        ..
    } = &judged.estimate;
    let beside = columns.known.iter().any(Option::is_some);
    let Some(before) = problem.before.as_ref().filter(|_| beside) else {
        return Ok(Vec::new());
    };
    let (setup, fastest) = (&problem.data.setup, problem.data.top_speeds()?);
    let mut notes = before.contradictions(setup, (columns, covariance), contradicted);
    notes.extend(before.beyond(setup, columns, covariance, &fastest));
    Ok(notes)
}

impl EstimatorAccount {
    /// What did not come as it should.
    pub(crate) fn notes(&self) -> Vec<FitNote> {
        let mut out = Vec::new();
        if self.estimator == EstimatorKind::Oe && !self.law_refined {
            out.push(FitNote::NothingNonlinear);
        }
        if let Some(simulated) = &self.simulated {
            if simulated.reference == ReferenceSource::Smoothed {
                out.push(FitNote::SmoothedReference);
            }
            if simulated.failed_steps_share > 0.0 {
                out.push(FitNote::FailedSteps {
                    share: simulated.failed_steps_share,
                });
            }
        }
        if self.status == IterationEnding::IterationLimit {
            out.push(FitNote::NotSettled {
                estimator: self.estimator,
                passes: self.iterations,
            });
        }
        out
    }
}

/// Share of a joint's rows at rest from which on they are reported.
const SHOWN_AT_REST: f64 = 0.01;

/// Rows at rest that are not fitted.
fn rests(setup: &RobotSetup, shares: &[f64]) -> Option<FitNote> {
    let names = setup.robot.joint_names().iter().cloned();
    let joints = names.zip(shares.iter().copied());
    let joints: Vec<(String, f64)> = joints
        .filter(|(_, share)| *share >= SHOWN_AT_REST)
        .collect();
    (!joints.is_empty()).then_some(FitNote::AtRest { joints })
}

/// Friction and inertias that are below zero by more than two deviations.
fn negative(unknowns: &[FittedUnknown]) -> Option<FitNote> {
    let positive = |u: &&FittedUnknown| is_positive(&u.key, u.joint.is_some());
    let below = |u: &&FittedUnknown| u.fitted < -2.0 * u.fitted_std;
    let unknowns: Vec<_> = unknowns
        .iter()
        .filter(positive)
        .filter(below)
        .map(|u| {
            let name = match &u.joint {
                Some(joint) => format!("{}:{joint}", u.key),
                None => u.key.clone(),
            };
            let number = NumberWithStd {
                value: u.fitted,
                std: u.fitted_std,
            };
            (name, number, u.unit.clone())
        })
        .collect();
    (!unknowns.is_empty()).then_some(FitNote::BelowZero { unknowns })
}

/// What the data do not separate.
fn confounded(fit: &Fit, unknowns: &[FittedUnknown]) -> Vec<FitNote> {
    let name = |i: usize| match &unknowns[i].joint {
        Some(joint) if !unknowns[i].key.contains(joint.as_str()) => {
            format!("{} of {joint}", unknowns[i].key)
        }
        _ => unknowns[i].key.clone(),
    };
    let (silent, mixed): (Vec<&ConfoundedUnknowns>, Vec<&ConfoundedUnknowns>) =
        fit.confounded.iter().partition(|c| c.terms.len() == 1);
    let silent: Vec<String> = silent.iter().map(|c| name(c.terms[0].0)).collect();
    let silent = (!silent.is_empty()).then_some(FitNote::NotExcited { unknowns: silent });
    let mixed = mixed.iter().map(|c| {
        let most = c.terms.iter().take(NAMED_TERMS);
        FitNote::Confounded {
            terms: most.map(|(i, x)| (name(*i), *x)).collect(),
        }
    });
    silent.into_iter().chain(mixed).collect()
}
