//! The loop: fit what is declared, one pass over the rows with every candidate, choose, ask the parts, look at held-out
//! data.

use rayon::prelude::*;

use super::change::friction_changes;
use super::error::DiagnoseError;
use super::held_out::split_errors;
use super::outcome::{Diagnosis, FoundEffect, LeftCandidate, SplitErrors, WhatIsLeft};
use super::prepared::{PreparedCase, filtered, residuals};
use super::problem::case::Case;
use super::problem::data_split::{DataSplit, LogRole};
use super::problem::unknowns::Unknowns;
use super::searched::SearchedCase;
use super::steps::{Judged, judge};
use super::unexplained::dependence::{Left, dependences};
use super::unexplained::{noise, part_unexplained, unexplained};
use super::watch::Watch;
use crate::effect::{AugmentedModel, Search, Torques};
use crate::judge::Numbers;
use crate::motion::{MotionError, Stretch};

/// Diagnoses; `watch` hears of every step and is asked now and then whether to stop.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose(case: &Case, watch: Watch) -> Result<Diagnosis, DiagnoseError> {
    let robot = &case.given.model.robot;
    let split = DataSplit::of(
        robot,
        &case.stretches,
        &case.roles,
        &case.filters,
        case.cutoff_hz,
    );
    check(case, &split)?;
    let prepared = PreparedCase::of(case, &split)?;
    unless_stopped(watch)?;
    let searched = prepared.search(watch)?;
    unless_stopped(watch)?;
    let judged = judge(&prepared, &searched)?;
    unless_stopped(watch)?;
    let mut found = prepared.evaluate(&searched, judged.clone())?;
    if case.wishes.search {
        let formulas = prepared.formulas((&searched, &judged), &found, watch)?;
        if let Some((searched, judged)) = formulas.accepted {
            found = prepared.evaluate(&searched, judged)?;
        }
        found.formulas = formulas.formulas;
    }
    Ok(found)
}

/// Errors of another model on the rows of a diagnosis, pieces drawn together as it had them.
///
/// # Errors
/// [`DiagnoseError`].
pub fn errors_of(
    case: &Case,
    together: usize,
    model: &AugmentedModel,
) -> Result<SplitErrors, DiagnoseError> {
    let split = DataSplit::of(
        &case.given.model.robot,
        &case.stretches,
        &case.roles,
        &case.filters,
        case.cutoff_hz,
    );
    split_errors((case, &split, together), model)
}

fn unless_stopped(watch: Watch) -> Result<(), DiagnoseError> {
    match (watch.stop)() {
        true => Err(DiagnoseError::Interrupted),
        false => Ok(()),
    }
}

/// Refuses what cannot be fitted.
fn check(case: &Case, split: &DataSplit) -> Result<(), DiagnoseError> {
    let unknowns = Unknowns::of(&case.given, &case.open, case.keep).len();
    let rows = split.rows_of(LogRole::Train);
    if rows < 10 * unknowns {
        return Err(DiagnoseError::TooFewRows { rows, unknowns });
    }
    for (j, joint) in case.given.model.robot.joint_names().iter().enumerate() {
        let silent = |s: &Stretch| s.tau[j].iter().all(|x| *x == 0.0);
        if case.stretches.iter().all(silent) {
            return Err(DiagnoseError::NoTorque {
                joint: joint.clone(),
            });
        }
    }
    Ok(())
}

impl PreparedCase<'_> {
    fn evaluate(
        &self,
        searched: &SearchedCase,
        judged: Judged,
    ) -> Result<Diagnosis, DiagnoseError> {
        let case = self.case;
        let before = self.split_errors(&case.given)?;
        let refitted = self.split_errors(&self.fitted.model)?.train;
        let after = self.split_errors(&judged.judge)?;
        let had_a_say = judged.steps.iter().any(FoundEffect::vetoed);
        let selected = match had_a_say {
            true => Some(self.split_errors(&judged.written)?),
            false => None,
        };
        // what is left is looked at with the numbers refitted: those that other logs gave are no missing physics
        let alone = &self.fitted.model;
        let added = judged.written.effects.len() > case.given.effects.len();
        let last = if added { &judged.written } else { alone };
        let numbers = &case.numbers;
        let left = self.what_is_left(last)?;
        let residual_std = rms_of(&filtered(last, &self.data)?, self.split);
        Ok(Diagnosis {
            left,
            left_alone: added.then(|| self.what_is_left(alone)).transpose()?,
            changes: friction_changes(self, searched),
            candidates: left_candidates(searched, numbers),
            determined: searched.determined,
            model: judged.written,
            estimates: judged.estimates,
            covariance: judged.covariance,
            information: judged.information,
            steps: judged.steps,
            unknowns: self.unknowns.list.clone(),
            before,
            refitted,
            after,
            selected,
            set_aside: self.split.set_aside.clone(),
            residual_std,
            fitted_logs: case.roles.iter().filter(|r| **r == LogRole::Train).count(),
            together: self.together,
            parts: self.blocks.parts,
            block_s: self.blocks.least_s,
            parts_needed: numbers.parts,
            formulas: Vec::new(),
        })
    }

    /// What a model leaves of the torques, beside the noise.
    fn what_is_left(&self, model: &AugmentedModel) -> Result<WhatIsLeft, DiagnoseError> {
        let case = self.case;
        let floor_of = |role| -> Result<Option<Vec<f64>>, MotionError> {
            let own = case.stretches_of(role);
            match own.is_empty() {
                true => Ok(None),
                false => noise(&residuals(model, &own), case, &own).map(Some),
            }
        };
        let floor = floor_of(LogRole::Train)?.unwrap_or_default();
        let floor_unseen = floor_of(LogRole::Holdout)?;
        let found = self.moving(model, LogRole::Train)?;
        let given = self.moving(&case.given, LogRole::Train)?;
        let (found, given) = match found.zip(given) {
            Some(both) => both,
            None => {
                let refitted = self.split_errors(&self.fitted.model)?.train;
                (refitted.clone(), refitted)
            }
        };
        let unseen = self.moving(model, LogRole::Holdout)?;
        let unexplained = unexplained(&found, &floor, unseen.as_ref().zip(floor_unseen));
        let structured = unexplained.iter().enumerate();
        let structured = structured.filter(|(_, l)| l.is_structure()).map(|(j, _)| j);
        let structured: Vec<usize> = structured.collect();
        let residual = filtered(model, &self.data)?;
        let torques: Vec<Torques> = (case.stretches.par_iter())
            .map(|s| model.torques(s))
            .collect();
        let left = Left {
            data: &self.data,
            residual: &residual,
            torques: &torques,
        };
        Ok(WhatIsLeft {
            dependence: dependences(&left, &structured, self.together),
            part_unexplained: part_unexplained(&floor, &given, &found),
            unexplained,
        })
    }
}

/// Root mean square of each joint's residual over the fitted rows.
fn rms_of(residual: &[Vec<Vec<f64>>], split: &DataSplit) -> Vec<f64> {
    let joints = residual.first().map_or(0, Vec::len);
    let of_joint = |j: usize| {
        let train = split.pieces.iter().filter(|p| p.role == LogRole::Train);
        let own = train.filter(|p| !split.is_stationary(p.stretch, j));
        let rows = own.flat_map(|p| &residual[p.stretch][j][p.rows.clone()]);
        let (sum, count) = rows.fold((0.0, 0.0), |(s, n), e| (s + e * e, n + 1.0));
        (sum / f64::max(count, 1.0)).sqrt()
    };
    (0..joints).map(of_joint).collect()
}

/// The best shape of every law and place that was not chosen, with why.
fn left_candidates(searched: &SearchedCase, numbers: &Numbers) -> Vec<LeftCandidate> {
    let mut out: Vec<LeftCandidate> = Vec::new();
    let effect = |i: usize| &searched.candidates[i].effect;
    let chosen: Vec<_> = searched
        .chosen
        .iter()
        .map(|c| effect(c.candidate))
        .collect();
    for l in &searched.looked {
        let own = effect(l.candidate);
        let score = l.gain.value / searched.error.max(f64::MIN_POSITIVE);
        let waves = own.law.entry.search == Search::Orders;
        let same = |c: &LeftCandidate| c.law.entry.name == own.name() && c.place == own.place;
        let known = chosen
            .iter()
            .any(|c| c.name() == own.name() && c.place == own.place);
        if known && !waves {
            continue;
        }
        let reason = match l.gain.value > 0.0 {
            false => "no gain on blocks left out".to_owned(),
            true => format!(
                "gain of {:.1} standard errors on blocks left out, {} are needed",
                l.gain.value / l.gain.se.max(f64::MIN_POSITIVE),
                numbers.screen
            ),
        };
        match out.iter_mut().find(|c| same(c)) {
            Some(best) if best.score.is_some_and(|s| s >= score) => {}
            Some(best) => {
                (best.effect, best.score, best.reason) = (Some(own.clone()), Some(score), reason)
            }
            None => out.push(LeftCandidate {
                law: own.law,
                place: own.place,
                effect: Some(own.clone()),
                score: Some(score),
                reason,
            }),
        }
    }
    let not_tried = searched.not_tried.iter();
    out.extend(not_tried.map(|n| LeftCandidate {
        law: n.law,
        place: n.place,
        effect: None,
        score: None,
        reason: n.lacking.clone(),
    }));
    out
}
