//! The loop: fit what is declared, one pass over the rows with every candidate, choose, ask the parts, look at held-out
//! data.

use rayon::prelude::*;

use super::accepted::refuse_failed;
use super::change::torque_changes;
use super::error::DiagnoseError;
use super::outcome::JudgedEffects;
use super::outcome::{Diagnosis, FoundEffect, LeftCandidate, NotWritten, WhatIsLeft};
use super::prepared::{PreparedCase, filtered, residuals};
use super::problem::case::DiagnosisCase;
use super::problem::constant_columns::ConstantColumns;
use super::problem::data_split::{DataSplit, LogRole};
use super::refit::ModelRefit;
use super::searched::SearchedCase;
use super::steps::{judge, write_for_prediction};
use super::unexplained::dependence::{ModelResiduals, dependences};
use super::unexplained::noise_floor::floor;
use super::unexplained::{part_unexplained, unexplained};
use super::watch::DiagnosisWatch;
use crate::effect::{AugmentedModel, ShapeSearch};
use crate::judge::Numbers;
use crate::motion::Stretch;

/// Diagnoses; `refit` makes the models that would be written, `watch` hears of every step and is asked now and then
/// whether to stop.
///
/// # Errors
/// [`DiagnoseError`].
pub fn diagnose(
    case: &DiagnosisCase,
    refit: &ModelRefit,
    watch: DiagnosisWatch,
) -> Result<Diagnosis, DiagnoseError> {
    let split = case.split();
    check(case, &split)?;
    let constant = ConstantColumns::default();
    let prepared = PreparedCase::of(case, (&split, &constant), refit)?;
    watch.unless_stopped()?;
    let searched = prepared.search(watch)?;
    watch.unless_stopped()?;
    let (searched, judged) = prepared.judged(searched, watch)?;
    refuse_failed(&prepared, &judged)?;
    watch.unless_stopped()?;
    let mut asked = (searched, judged);
    let mut formulas = Vec::new();
    if case.wishes.search {
        // formulas are sought in what the names leave; terms that predict would take part of it
        let named = prepared.evaluate(&asked.0, asked.1.clone())?;
        let sought = prepared.formulas((&asked.0, &asked.1), &named, watch)?;
        formulas = sought.formulas;
        asked = sought.accepted.unwrap_or(asked);
    }
    let (searched, judged) = asked;
    let judged = write_for_prediction(&prepared, &searched, judged, watch)?;
    let found = prepared.evaluate(&searched, judged)?;
    Ok(Diagnosis { formulas, ..found })
}

/// Refuses what cannot be fitted.
fn check(case: &DiagnosisCase, split: &DataSplit) -> Result<(), DiagnoseError> {
    let unknowns = case.unknowns().len();
    let rows = split.rows_of(LogRole::Train);
    if rows < 10 * unknowns {
        return Err(DiagnoseError::TooFewRows { rows, unknowns });
    }
    for (j, joint) in case.given.model.robot.joint_names().iter().enumerate() {
        let silent = |s: &Stretch| s.tau[j].iter().all(|x| *x == 0.0);
        if case.stretches.iter().all(silent) {
            let joint = joint.clone();
            return Err(DiagnoseError::NoTorque { joint });
        }
    }
    Ok(())
}

/// Most times that shapes are fitted anew because effects left.
const SETTLINGS: usize = 3;

impl PreparedCase<'_> {
    /// Judges what was chosen, its shapes fitted anew without what left, until nothing more leaves.
    fn judged(
        &self,
        mut searched: SearchedCase,
        watch: DiagnosisWatch,
    ) -> Result<(SearchedCase, JudgedEffects), DiagnoseError> {
        let mut judged = judge(self, &searched)?;
        for _ in 0..SETTLINGS {
            watch.unless_stopped()?;
            let stand = |of: &JudgedEffects| -> Vec<bool> {
                of.steps.iter().map(|s| s.written.is_some()).collect()
            };
            if !self.forget_those_that_left(&mut searched, &judged.steps)? {
                break;
            }
            let before = stand(&judged);
            judged = judge(self, &searched)?;
            if stand(&judged) == before {
                break;
            }
        }
        Ok((searched, judged))
    }

    fn evaluate(
        &self,
        searched: &SearchedCase,
        judged: JudgedEffects,
    ) -> Result<Diagnosis, DiagnoseError> {
        let case = self.case;
        let before = self.split_errors(&case.in_use)?;
        let refitted = self.split_errors(&self.fitted.model)?;
        let named = self.split_errors(&judged.named)?;
        let is_named = judged.steps.iter().any(|step| step.written.is_some());
        let after = match judged.predicting.is_empty() {
            true => named.clone(),
            false => self.split_errors(&judged.written)?,
        };
        let added = is_named || !judged.predicting.is_empty();
        // what is left is looked at with the numbers refitted: those that other logs gave are no missing physics
        let alone = &self.fitted.model;
        let last = if added { &judged.written } else { alone };
        let left = self.what_is_left(last)?;
        let residual_std = rms_of(&filtered(last, &self.data)?, self.data.split);
        Ok(Diagnosis {
            left,
            left_alone: added.then(|| self.what_is_left(alone)).transpose()?,
            changes: torque_changes(
                &self.field(&searched.candidates, &searched.summed),
                &searched.chosen,
            ),
            candidates: left_candidates(searched, &judged.steps, &case.numbers),
            determined: searched.determined,
            model: judged.proposed,
            in_use: judged.written,
            estimates: judged.estimates,
            covariance: judged.covariance,
            by_effects: judged.by_effects,
            to_estimate: judged.to_estimate,
            steps: noticed(judged.steps),
            predicting: judged.predicting,
            too_few_stretches: judged.too_few_stretches,
            unknowns: self.unknowns.list.clone(),
            before,
            refitted,
            named,
            after,
            set_aside: self.data.split.set_aside.clone(),
            residual_std,
            fitted_logs: case.roles.iter().filter(|r| **r == LogRole::Train).count(),
            together: self.together,
            blocks: self.blocks.list.len(),
            block_s: self.blocks.least_s,
            least_blocks: case.numbers.least_blocks,
            formulas: Vec::new(),
        })
    }

    /// What a model leaves of the torques, beside the noise.
    fn what_is_left(&self, model: &AugmentedModel) -> Result<WhatIsLeft, DiagnoseError> {
        let case = self.case;
        let floor_of = |role| {
            let own = case.stretches_of(role);
            let some = !own.is_empty();
            some.then(|| floor(case, &residuals(model, &own), &own))
                .transpose()
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
        let structured = (0..unexplained.len()).filter(|j| unexplained[*j].is_structure());
        let structured: Vec<usize> = structured.collect();
        let torques = case.stretches.par_iter().map(|s| model.torques(s));
        let left = ModelResiduals {
            data: &self.data,
            residual: &filtered(model, &self.data)?,
            torques: &torques.collect::<Vec<_>>(),
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
    let of_joint = |j: usize| {
        let train = split.pieces.iter().filter(|p| p.role == LogRole::Train);
        let own = train.filter(|p| !split.is_stationary(p.stretch, j));
        let rows = own.flat_map(|p| &residual[p.stretch][j][p.rows.clone()]);
        let (sum, count) = rows.fold((0.0, 0.0), |(s, n), e| (s + e * e, n + 1.0));
        (sum / f64::max(count, 1.0)).sqrt()
    };
    let joints = residual.first().map_or(0, Vec::len);
    (0..joints).map(of_joint).collect()
}

/// Effects that change what one would notice: the others are not named.
fn noticed(mut steps: Vec<FoundEffect>) -> Vec<FoundEffect> {
    steps.retain(|step| step.left != Some(NotWritten::Small));
    steps
}

/// The best shape of every law and place that was not chosen or changes too little, with why.
fn left_candidates(
    searched: &SearchedCase,
    steps: &[FoundEffect],
    numbers: &Numbers,
) -> Vec<LeftCandidate> {
    let small = steps
        .iter()
        .filter(|step| step.left == Some(NotWritten::Small));
    let small = small.map(|step| LeftCandidate {
        law: step.estimate.law,
        place: step.estimate.place,
        effect: Some(step.estimate.clone()),
        score: Some(step.share),
        reason: format!(
            "takes less than {:.0} % off the error of any joint",
            100.0 * numbers.noticeable
        ),
    });
    let mut out: Vec<LeftCandidate> = small.collect();
    let effect = |i: usize| &searched.candidates[i].effect;
    for l in &searched.looked {
        let own = effect(l.candidate);
        let score = l.gain.value / searched.error.max(f64::MIN_POSITIVE);
        let waves = own.law.entry.search == ShapeSearch::Orders;
        let same = |name: &str, place| name == own.name() && place == own.place;
        let mut chosen = searched.chosen.iter().map(|c| effect(c.candidate));
        if !waves && chosen.any(|c| same(c.name(), c.place)) {
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
        let found = LeftCandidate {
            law: own.law,
            place: own.place,
            effect: Some(own.clone()),
            score: Some(score),
            reason,
        };
        let alike = |c: &&mut LeftCandidate| same(c.law.entry.name, c.place);
        match out.iter_mut().find(alike) {
            Some(best) if best.score.is_some_and(|s| s >= score) => {}
            Some(best) => {
                *best = LeftCandidate {
                    law: best.law,
                    ..found
                };
            }
            None => out.push(found),
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
