//! What is written for prediction alone, beside what is named: laws that are linear in their amplitude, at the fixed shapes
//! of the grid. Many terms of two or three deviations make the torques of other motions better together, each shrunk by
//! what of it may be chance (the nonnegative garrote, Breiman 1995); that one is written is no statement on the machine.

use rayon::prelude::*;

use super::{EffectJudge, FittedEffect, PendingEffect, StepResult, give_amplitudes};
use crate::diagnose::candidates::{candidates, no_finding};
use crate::diagnose::outcome::{JudgedEffects, NotWritten, PredictingTerm};
use crate::diagnose::prepared::{PreparedCase, SummedProducts};
use crate::diagnose::problem::data_split::LogRole;
use crate::diagnose::problem::prediction_numbers::PredictionNumbers;
use crate::diagnose::problem::unknowns::{DiagnosisUnknowns, Unknown, step};
use crate::diagnose::search::{ChosenCandidate, own_joint};
use crate::diagnose::searched::SearchedCase;
use crate::diagnose::tables::{EffectEstimates, VerifiedEffect, beside_the_others};
use crate::diagnose::watch::DiagnosisWatch;
use crate::effect::{AugmentedModel, ModelEffect};
use crate::judge::{BlockSums, Bound, Numbers, Terms, compare, divide};

mod choose;
mod stretches;

/// Adds to what is named what predicts.
pub fn write_for_prediction(
    prepared: &PreparedCase,
    searched: &SearchedCase,
    named: JudgedEffects,
    watch: DiagnosisWatch,
) -> StepResult<JudgedEffects> {
    let case = prepared.case;
    if case.wishes.named_only || case.kept.is_some() || !searched.determined {
        return Ok(named);
    }
    let fitted = prepared.independent_blocks();
    if fitted.len() < case.prediction.least_blocks {
        return Ok(JudgedEffects {
            too_few_stretches: Some(fitted.len()),
            ..named
        });
    }
    let about = named.written.clone();
    let (mut list, _) = candidates(&about, case, &prepared.cover);
    for candidate in &mut list {
        if !choose::may_predict(&about, (case, &prepared.cover), &candidate.effect) {
            candidate.bounds.clear();
        }
    }
    let of_model = |d: &&ModelEffect| !about.effects.iter().any(|e| same_place(e, d));
    let directions: Vec<ModelEffect> = (searched.directions.iter())
        .filter(of_model)
        .cloned()
        .collect();
    let held = prepared.held_out_blocks();
    let blocks = [fitted.as_slice(), &held].concat();
    let mut summed = prepared.summed_over(about, &list, (&directions, &blocks))?;
    let held = summed.sums.split_off(fitted.len());
    hold_bodies(&mut summed.declared, &prepared.unknowns);
    let chosen = prepared.field(&list, &summed).choose_predicting(watch)?;
    let mut terms: Vec<PendingEffect> = chosen.into_iter().map(PendingEffect::of).collect();
    if terms.is_empty() {
        return Ok(named);
    }
    let mut work = EffectJudge {
        prepared,
        field: prepared.field(&list, &summed),
        noisier: None,
        other_numbers: true,
    };
    work.keep_what_predicts(&mut terms)?;
    while let Some(harm) = work.worst_on(&terms, &held) {
        terms[harm].left = Some(NotWritten::HeldOut);
        work.keep_what_predicts(&mut terms)?;
    }
    let errors = work.held_out_errors(&terms, &held);
    // blocks that are set aside are of the fitted logs: asked, they are fitted with the others
    let whole;
    if !case.roles.contains(&LogRole::Holdout) {
        whole = SummedProducts {
            sums: summed.sums.followed_by(held),
            ..summed.clone()
        };
        work.field = prepared.field(&list, &whole);
    }
    work.with_terms(terms, errors, named)
}

/// Whether two effects are of one law at one place.
fn same_place(a: &ModelEffect, b: &ModelEffect) -> bool {
    a.name() == b.name() && a.place == b.place
}

impl PreparedCase<'_> {
    /// Held-out rows in blocks as long as those that are fitted.
    fn held_out_blocks(&self) -> Vec<crate::judge::TimeBlock> {
        let logs = self.data.split.logs(self.case.rows(), LogRole::Holdout);
        let logs: Vec<_> = (logs.into_iter())
            .filter(|log| !log.pieces.is_empty())
            .collect();
        let count = (self.case.numbers.blocks, 1);
        divide(&logs, self.blocks.least_s, count).list
    }
}

impl EffectJudge<'_> {
    fn prediction(&self) -> &PredictionNumbers {
        &self.prepared.case.prediction
    }

    /// Lets terms leave until each that stands has an amplitude that is not nil beside the others and gains on blocks left
    /// out, the least sure of each place first; gives the rest the part of their amplitude that predicts.
    fn keep_what_predicts(&self, terms: &mut [PendingEffect]) -> StepResult<EffectEstimates> {
        loop {
            let set: Vec<usize> = (0..terms.len()).filter(|i| terms[*i].stands()).collect();
            let estimates = self.fit_together(terms, &set)?;
            let mut leaves: Vec<(usize, NotWritten, f64)> = Vec::new();
            for i in &set {
                if let Some(why) = self.predicts_nothing(&terms[*i]) {
                    leaves.push((*i, why, part_of(&terms[*i])));
                }
            }
            if leaves.is_empty() {
                give_amplitudes(terms, part_of);
                return Ok(estimates);
            }
            leaves.sort_by(|a, b| a.2.total_cmp(&b.2));
            let mut places = Vec::new();
            for (i, why, _) in leaves {
                let place = self.field.effect(&terms[i].chosen).place;
                if !places.contains(&place) {
                    terms[i].left = Some(why);
                    places.push(place);
                }
            }
        }
    }

    /// The joint fit of some terms, and what it makes of each.
    fn fit_together(
        &self,
        terms: &mut [PendingEffect],
        set: &[usize],
    ) -> StepResult<EffectEstimates> {
        let chosen: Vec<ChosenCandidate> = set.iter().map(|i| terms[*i].chosen.clone()).collect();
        let estimates = EffectEstimates::of(&self.field, &chosen)?;
        let own = self.prediction();
        let numbers = Numbers {
            deviations: own.nil,
            least_blocks: own.least_blocks,
            ..*self.field.numbers()
        };
        let of_term = |at: usize| -> StepResult<FittedEffect> {
            let places = &estimates.places[at].terms;
            Ok(FittedEffect {
                verified: VerifiedEffect {
                    amplitude: estimates.fit.amplitude(places, (None, false), &numbers),
                    blocks: Vec::new(),
                    beside: beside_the_others(&self.field, &chosen, at)?,
                },
                effect: estimates.effect(&self.field, &chosen[at], at),
                covariance: Vec::new(),
            })
        };
        let found = (0..set.len()).into_par_iter().map(of_term);
        let found = found.collect::<StepResult<Vec<_>>>()?;
        for (i, found) in set.iter().zip(found) {
            terms[*i].found = Some(found);
        }
        Ok(estimates)
    }

    /// Why a term leaves, where it does.
    fn predicts_nothing(&self, term: &PendingEffect) -> Option<NotWritten> {
        let FittedEffect {
            verified, effect, ..
        } = term.found.as_ref()?;
        let PreparedCase { case, cover, .. } = self.prepared;
        let gain = &verified.beside.gain;
        let gain = own_joint(effect.place).map_or(gain.value, |j| gain.joints[j][0]);
        match no_finding(&self.field.summed.about, case, cover, effect) {
            Some(_) => Some(NotWritten::Bound),
            None if verified.amplitude.s <= 0.0 || gain <= 0.0 => Some(NotWritten::Unsure),
            None => None,
        }
    }

    /// The term that harms held-out rows most, where one does: its own joint by anything at all, another one beyond the
    /// errors of these blocks and what one would notice.
    fn worst_on(&self, terms: &[PendingEffect], held: &BlockSums) -> Option<usize> {
        if held.blocks.is_empty() {
            return None;
        }
        let set: Vec<usize> = (0..terms.len()).filter(|i| terms[*i].stands()).collect();
        let with = self.held_out_squares(&of_set(terms, &set, None), held);
        let weights = &self.field.summed.declared.weights;
        let own = self.prediction();
        let harm = |i: usize| {
            let without = self.held_out_squares(&of_set(terms, &set, Some(i)), held);
            let gain = compare(&without, &with, weights);
            let part = |j: usize| {
                let total = weights[j] * without.iter().map(|e| e[j]).sum::<f64>();
                gain.joints[j][0] / total.max(f64::MIN_POSITIVE)
            };
            let joint = own_joint(self.field.effect(&terms[i].chosen).place);
            let is_worse = |j: &usize| match Some(*j) == joint {
                true => gain.joints[*j][0] < 0.0,
                false => {
                    gain.joints[*j][0] < -own.errors * gain.joints[*j][1]
                        && part(*j) < -2.0 * own.part
                }
            };
            let worse = (0..weights.len()).filter(is_worse).map(part);
            let all = (joint.is_none() && gain.value < 0.0).then_some(-f64::MIN_POSITIVE);
            let most = worse.chain(all).min_by(f64::total_cmp)?;
            Some((i, most))
        };
        let harms = set.par_iter().filter_map(|i| harm(*i));
        let most = harms.min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(most.0)
    }

    /// Squared errors of held-out blocks by terms at their amplitudes, the declared numbers refitted, `[block][joint]`.
    fn held_out_squares(&self, terms: &[&PendingEffect], held: &BlockSums) -> Vec<Vec<f64>> {
        let chosen: Vec<ChosenCandidate> = terms.iter().map(|t| t.chosen.clone()).collect();
        let first = self.field.summed.declared.len();
        let amplitudes = terms.iter().filter_map(|t| t.amplitude.as_ref()).flatten();
        let fixed: Vec<(usize, f64)> = (first..).zip(amplitudes.copied()).collect();
        let all = self.field.terms(&chosen);
        let values = all.fit(&self.field.total(), &fixed).values;
        let blocks = held.blocks.iter();
        blocks.map(|block| all.squares(block, &values)).collect()
    }

    /// Root mean square torque error of each term's joint on held-out rows, without and with it.
    fn held_out_errors(&self, terms: &[PendingEffect], held: &BlockSums) -> Vec<Option<[f64; 2]>> {
        let set: Vec<usize> = (0..terms.len()).filter(|i| terms[*i].stands()).collect();
        let with = self.held_out_squares(&of_set(terms, &set, None), held);
        let of_term = |i: usize| {
            let joint = own_joint(self.field.effect(&terms[i].chosen).place)?;
            let without = self.held_out_squares(&of_set(terms, &set, Some(i)), held);
            let rows: f64 = held.rows.iter().map(|rows| rows[joint]).sum();
            let square = |errors: &[Vec<f64>]| errors.iter().map(|e| e[joint]).sum::<f64>() / rows;
            (rows > 0.0 && terms[i].stands())
                .then(|| [square(&without).sqrt(), square(&with).sqrt()])
        };
        (0..terms.len()).into_par_iter().map(of_term).collect()
    }

    /// What is named with the terms that predict, whose model as it is written is asked on held-out rows joint by joint.
    fn with_terms(
        &mut self,
        mut terms: Vec<PendingEffect>,
        errors: Vec<Option<[f64; 2]>>,
        named: JudgedEffects,
    ) -> StepResult<JudgedEffects> {
        let joints = self.prepared.case.given.model.robot.joint_names();
        loop {
            let estimates = self.keep_what_predicts(&mut terms)?;
            if !terms.iter().any(PendingEffect::stands) {
                return Ok(named);
            }
            let written = self.beside_named(&terms, &estimates, &named)?;
            let rows = self.prepared.held_out(LogRole::Holdout);
            let change = rows.change([&named.written, &written.1])?;
            let noticeable = self.field.numbers().noticeable;
            let worse = change.into_iter().flat_map(|c| c.joints);
            let worse: Vec<usize> = worse
                .filter(|joint| joint.noticeably_worse(noticeable))
                .filter_map(|joint| joints.iter().position(|name| *name == joint.joint))
                .collect();
            let mut harmless = true;
            for term in terms.iter_mut().filter(|t| t.left.is_none()) {
                let place = self.field.effect(&term.chosen).place;
                if worse.iter().any(|j| place.touches(*j)) {
                    (term.left, harmless) = (Some(NotWritten::HeldOut), false);
                }
            }
            if harmless {
                return Ok(self.put_beside(named, (&terms, &errors), written));
            }
        }
    }

    /// The terms beside what is named: the friction of a joint moves with the terms on it, and bodies stay, for what a
    /// joint's own torque asks of them other joints and other poses would pay.
    fn beside_named(
        &self,
        terms: &[PendingEffect],
        estimates: &EffectEstimates,
        named: &JudgedEffects,
    ) -> StepResult<(AugmentedModel, AugmentedModel)> {
        let stand: Vec<&PendingEffect> = terms.iter().filter(|t| t.amplitude.is_some()).collect();
        let beside = self.fitted(&stand);
        let unknowns = &self.prepared.unknowns;
        let mut model = named.proposed.clone();
        let mut by = unknowns.moved(&self.field.summed.about, &beside);
        for (by, unknown) in by.iter_mut().zip(&unknowns.list) {
            let place = |t: &&PendingEffect| self.field.effect(&t.chosen).place;
            let of_term = |j: usize| stand.iter().any(|t| place(t).touches(j));
            match unknown {
                Unknown::Friction { joint, .. } if of_term(*joint) => {}
                Unknown::Offset(joint) if of_term(*joint) => {}
                _ => *by = 0.0,
            }
        }
        step(&mut model, unknowns, &by);
        model.effects = beside.effects;
        let numbers_of = Some(named.proposed.effects.as_slice());
        let in_use = self.in_use((&model, numbers_of), estimates)?;
        Ok((model, in_use))
    }

    /// The named effects and the terms beside them in one model.
    fn put_beside(
        &self,
        mut named: JudgedEffects,
        (terms, errors): (&[PendingEffect], &[Option<[f64; 2]>]),
        (proposed, written): (AugmentedModel, AugmentedModel),
    ) -> JudgedEffects {
        let unknowns = &self.prepared.unknowns;
        // what a named effect is drawn beside has the terms too
        for found in &mut named.steps {
            if let (Some(without), Some(place)) = (&mut found.without, found.written) {
                let by = unknowns.moved(&named.written, without);
                *without = written.clone();
                step(without, unknowns, &by);
                without.effects.remove(place);
            }
        }
        let moved = unknowns.moved(&proposed, &named.proposed);
        for (shift, by) in named.to_estimate.iter_mut().zip(moved) {
            *shift += by;
        }
        let own = self.prediction();
        let stand = terms.iter().zip(errors).filter(|(term, _)| term.stands());
        let first = self.field.summed.about.effects.len();
        let described = stand.enumerate().filter_map(|(at, (term, held_out))| {
            let FittedEffect {
                verified, effect, ..
            } = term.found.as_ref()?;
            let amplitude = &verified.amplitude;
            Some(PredictingTerm {
                estimate: effect.clone(),
                written: first + at,
                shrinkage: amplitude.s,
                deviations: own.nil * amplitude.certainty().sqrt(),
                torque: amplitude.torque,
                gain: verified.beside.gain.clone(),
                held_out: *held_out,
            })
        });
        named.predicting = described.collect();
        (named.proposed, named.written) = (proposed, written);
        named
    }
}

/// Holds the bodies of a model.
fn hold_bodies(declared: &mut Terms, unknowns: &DiagnosisUnknowns) {
    for (i, (term, unknown)) in declared.list.iter_mut().zip(&unknowns.list).enumerate() {
        if !matches!(unknown, Unknown::Theta(_)) {
            continue;
        }
        term.columns.clear();
        term.bound = Bound::NIL;
        if i < declared.prior.1.len() {
            declared.prior.0.row_mut(i).fill(0.0);
            declared.prior.0.column_mut(i).fill(0.0);
            declared.prior.1[i] = 0.0;
        }
    }
}

/// Part of a term's amplitude that predicts.
fn part_of(term: &PendingEffect) -> f64 {
    let found = term.found.as_ref();
    found.map_or(0.0, |found| found.verified.amplitude.s)
}

/// The terms of a set, without one of them.
fn of_set<'t>(
    terms: &'t [PendingEffect],
    set: &[usize],
    without: Option<usize>,
) -> Vec<&'t PendingEffect> {
    let own = set.iter().filter(|i| Some(**i) != without);
    own.map(|i| &terms[*i]).collect()
}
