//! From what was chosen to what is written: the set settles, the model is fitted beside it, held-out data look at both.

use nalgebra::{DMatrix, DVector};

use super::candidates::no_finding;
use super::error::DiagnoseError;
use super::held_out::{EffectChange, HeldOutRows};
use super::outcome::{FoundEffect, JudgedEffects, NotWritten, StepStatus};
use super::prepared::PreparedCase;
use super::problem::data_split::LogRole;
use super::problem::unknowns::step;
use super::refit::ModelProposal;
use super::search::{ChosenCandidate, Field};
use super::searched::SearchedCase;
use super::tables::{self, EffectEstimates, VerifiedEffect};
use crate::effect::{AugmentedModel, ModelEffect};

mod harm;
mod predicting;

use harm::HeldOutVerdict;
pub use predicting::write_for_prediction;

type StepResult<T> = Result<T, DiagnoseError>;

/// One effect on its way.
struct PendingEffect {
    chosen: ChosenCandidate,
    accepted: bool,
    /// By the joint fit in which it was asked last.
    found: Option<FittedEffect>,
    left: Option<NotWritten>,
    came_back: bool,
    /// Amplitude in the predicting model; none where it is not in it.
    amplitude: Option<Vec<f64>>,
    change: Option<EffectChange>,
    /// The written model without it, all else fitted anew.
    without: Option<AugmentedModel>,
}

/// What a joint fit makes of an effect.
struct FittedEffect {
    verified: VerifiedEffect,
    /// With its coefficients there.
    effect: ModelEffect,
    /// Of its (shape, linear), row-major.
    covariance: Vec<f64>,
}

impl PendingEffect {
    /// Nothing of it is known yet but that it was chosen.
    fn of(chosen: ChosenCandidate) -> Self {
        PendingEffect {
            accepted: chosen.accepted,
            chosen,
            found: None,
            left: None,
            came_back: false,
            amplitude: None,
            change: None,
            without: None,
        }
    }

    fn stands(&self) -> bool {
        self.left.is_none()
    }
}

/// Gives what stands the part of its fitted amplitude that is written, and what left none.
fn give_amplitudes(ways: &mut [PendingEffect], part: impl Fn(&PendingEffect) -> f64) {
    for way in ways {
        let found = way.found.as_ref().filter(|_| way.stands());
        let amplitude = found.map(|found| {
            let part = part(way);
            found.effect.linear.iter().map(|x| part * x).collect()
        });
        way.amplitude = amplitude;
    }
}

/// Settles the set, then asks held-out data.
pub fn judge(prepared: &PreparedCase, searched: &SearchedCase) -> StepResult<JudgedEffects> {
    let fitted = prepared.blocks.list.len();
    let mut work = EffectJudge {
        prepared,
        field: prepared.field(&searched.candidates, &searched.summed),
        noisier: searched.noisier.as_ref().map(|sums| sums.over(0..fitted)),
        other_numbers: true,
    };
    let mut ways = work.ways(searched);
    work.settle(&mut ways)?;
    let mut estimates = work.readmit(&mut ways)?;
    work.other_numbers = work.wants_other_numbers(&ways)?;
    let mut written = work.written(&ways, &estimates)?;
    loop {
        let harm = match work.harm(&ways, &written.1)? {
            HeldOutVerdict::Harmless => break,
            HeldOutVerdict::ByEffect(harm) => harm,
            HeldOutVerdict::ByRefit(harm) => {
                let given = work.beside_given(&ways, &estimates)?;
                if work.is_harmless(&given.1)? {
                    written = given;
                    break;
                }
                let Some(harm) = harm else { break };
                harm
            }
        };
        ways[harm].left = Some(NotWritten::HeldOut);
        work.settle(&mut ways)?;
        estimates = work.readmit(&mut ways)?;
        written = work.written(&ways, &estimates)?;
    }
    work.ask_those_that_left(&mut ways)?;
    work.held_out(&mut ways, &written.1)?;
    Ok(work.described(&ways, &estimates, written))
}

/// What judges the effects that were chosen: the prepared case and its field.
struct EffectJudge<'a> {
    prepared: &'a PreparedCase<'a>,
    field: Field<'a>,
    /// Sums of all blocks with as much noise again in the positions.
    noisier: Option<Vec<DMatrix<f64>>>,
    /// Whether these data want other declared numbers than those that were given.
    other_numbers: bool,
}

impl EffectJudge<'_> {
    /// The effects that were chosen, and those that the user wants.
    fn ways(&self, searched: &SearchedCase) -> Vec<PendingEffect> {
        let chosen = searched.chosen.iter().cloned();
        chosen.map(PendingEffect::of).collect()
    }

    /// Lets effects leave until all that stand pass beside one another, the least sure first.
    fn settle(&self, ways: &mut [PendingEffect]) -> StepResult<EffectEstimates> {
        loop {
            let set: Vec<usize> = (0..ways.len()).filter(|i| ways[*i].stands()).collect();
            let estimates = self.ask(ways, &set)?;
            let leaves = set
                .iter()
                .filter_map(|i| Some((*i, self.leaves(&ways[*i])?)));
            let certainty = |i: usize| {
                let found = ways[i].found.as_ref();
                found.map_or(0.0, |f| f.verified.amplitude.certainty())
            };
            match leaves.min_by(|a, b| certainty(a.0).total_cmp(&certainty(b.0))) {
                Some((i, why)) => ways[i].left = Some(why),
                None => {
                    give_amplitudes(ways, |way| self.factor(way));
                    return Ok(estimates);
                }
            }
        }
    }

    /// Lets those that left come back where they pass beside all that stand, the surest first: of effects that explain
    /// the same, one that left beside another is surer when that has left too. One stays where blocks left out are
    /// better explained by the set that settles with it.
    fn readmit(&self, ways: &mut [PendingEffect]) -> StepResult<EffectEstimates> {
        loop {
            self.ask_those_that_left(ways)?;
            let certainty = |i: &usize| {
                let found = ways[*i].found.as_ref();
                found.map_or(0.0, |f| f.verified.amplitude.certainty())
            };
            let passes = |i: &usize| {
                let way = &ways[*i];
                let out = !matches!(way.left, None | Some(NotWritten::HeldOut));
                out && !way.came_back && self.leaves(way).is_none()
            };
            let surest = (0..ways.len()).filter(passes);
            let Some(i) = surest.max_by(|a, b| certainty(a).total_cmp(&certainty(b))) else {
                return self.settle(ways);
            };
            let before = (
                self.error_left_out(ways)?,
                Vec::from_iter(ways.iter().map(|w| w.left)),
            );
            (ways[i].left, ways[i].came_back) = (None, true);
            self.settle(ways)?;
            if self.error_left_out(ways)? >= before.0 {
                for (way, left) in ways.iter_mut().zip(before.1) {
                    way.left = left;
                }
            }
        }
    }

    /// Weighted squared error of blocks left out by all that stand.
    fn error_left_out(&self, ways: &[PendingEffect]) -> StepResult<f64> {
        let set = ways.iter().filter(|w| w.stands());
        let set: Vec<ChosenCandidate> = set.map(|w| w.chosen.clone()).collect();
        Ok(self.field.left_out(&self.field.terms(&set))?.error())
    }

    /// Asks the blocks for effects in one joint fit.
    fn ask(&self, ways: &mut [PendingEffect], set: &[usize]) -> StepResult<EffectEstimates> {
        let chosen: Vec<ChosenCandidate> = set.iter().map(|i| ways[*i].chosen.clone()).collect();
        let estimates = EffectEstimates::of(&self.field, &chosen)?;
        for (at, i) in set.iter().enumerate() {
            ways[*i].found = Some(self.found(&estimates, &chosen, at)?);
        }
        Ok(estimates)
    }

    /// What a joint fit makes of one of its effects.
    fn found(
        &self,
        estimates: &EffectEstimates,
        chosen: &[ChosenCandidate],
        at: usize,
    ) -> StepResult<FittedEffect> {
        let mut effect = estimates.effect(&self.field, &chosen[at], at);
        let verified = estimates.verified(&self.field, chosen, at, self.noisier.as_deref())?;
        let judged = verified.amplitude.over_covariance;
        let covariance = estimates.covariance_of(&effect, at);
        let covariance: Vec<f64> = covariance.iter().map(|x| judged * x).collect();
        let told = self.field.numbers_of(&effect).deviations;
        let with_shape = effect.hold_shape_beside_untold_sizes(&covariance, told);
        Ok(FittedEffect {
            verified,
            covariance: with_shape.unwrap_or(covariance),
            effect,
        })
    }

    /// Each of those that left beside all that stand: what it would be.
    fn ask_those_that_left(&self, ways: &mut [PendingEffect]) -> StepResult<()> {
        let set = ways.iter().filter(|w| w.stands());
        let set: Vec<ChosenCandidate> = set.map(|w| w.chosen.clone()).collect();
        for way in ways.iter_mut().filter(|w| !w.stands()) {
            let mut asked = set.clone();
            asked.push(way.chosen.clone());
            let estimates = EffectEstimates::of(&self.field, &asked)?;
            way.found = Some(self.found(&estimates, &asked, set.len())?);
        }
        Ok(())
    }

    /// Why an effect leaves the set, where it does.
    fn leaves(&self, way: &PendingEffect) -> Option<NotWritten> {
        let FittedEffect {
            verified, effect, ..
        } = way.found.as_ref()?;
        let Self { prepared, .. } = self;
        let (about, case) = (&prepared.fitted.model, prepared.case);
        let there = no_finding(about, case, &prepared.cover, effect).is_none();
        let keeps = case.kept.is_some();
        match way.accepted {
            true => None,
            false if !there => Some(NotWritten::Bound),
            false if self.factor(way) <= 0.0 => Some(NotWritten::Unsure),
            // with the model held all of an effect is in question, and none of it is small
            false if !keeps && !verified.beside.noticeable => Some(NotWritten::Small),
            false => None,
        }
    }

    /// Part of an effect's amplitude that predicts. What a person can measure is whole or is not there.
    fn factor(&self, way: &PendingEffect) -> f64 {
        let Some(FittedEffect {
            verified, effect, ..
        }) = &way.found
        else {
            return 0.0;
        };
        let s = verified.amplitude.s;
        let sure =
            s > self.field.numbers().confirmed || self.prepared.case.kept.is_some() && s > 0.0;
        match (way.accepted, effect.law.entry.measurable) {
            (true, _) => 1.0,
            (false, false) => s,
            (false, true) => f64::from(u8::from(sure)),
        }
    }

    /// The model with the effects that stand: by the judge's sums, and as torques would be computed.
    fn written(
        &self,
        ways: &[PendingEffect],
        estimates: &EffectEstimates,
    ) -> StepResult<(AugmentedModel, AugmentedModel)> {
        let case = self.prepared.case;
        let effects: Vec<_> = ways.iter().filter(|w| w.amplitude.is_some()).collect();
        if effects.is_empty() {
            return Ok((case.given.clone(), case.in_use.clone()));
        }
        let model = self.based(self.prepared.refitted(&self.fitted(&effects))?);
        let in_use = self.in_use((&model, None), estimates)?;
        Ok((model, in_use))
    }

    /// The same effects beside the declared numbers as they were given.
    fn beside_given(
        &self,
        ways: &[PendingEffect],
        estimates: &EffectEstimates,
    ) -> StepResult<(AugmentedModel, AugmentedModel)> {
        let effects: Vec<_> = ways.iter().filter(|w| w.amplitude.is_some()).collect();
        let mut model = self.prepared.case.given.clone();
        model.effects = self.fitted(&effects).effects;
        let given = &self.prepared.case.given.effects;
        let in_use = self.in_use((&model, Some(given)), estimates)?;
        Ok((model, in_use))
    }

    /// A model as torques are computed with it.
    fn in_use(
        &self,
        (model, numbers_of): (&AugmentedModel, Option<&[ModelEffect]>),
        estimates: &EffectEstimates,
    ) -> StepResult<AugmentedModel> {
        (self.prepared.refit)(&ModelProposal {
            model,
            information: &estimates.information(&self.field),
            numbers_of,
        })
    }

    /// A model with effects, its declared numbers as given but for what the effects change, unless these data want others.
    fn based(&self, model: AugmentedModel) -> AugmentedModel {
        match self.other_numbers {
            true => model,
            false => self.as_given(model),
        }
    }

    /// Whether these data ask for declared numbers other than the given ones with what the effects change.
    fn wants_other_numbers(&self, ways: &[PendingEffect]) -> StepResult<bool> {
        let effects: Vec<_> = ways.iter().filter(|w| w.amplitude.is_some()).collect();
        let fitted = self.prepared.refitted(&self.fitted(&effects))?;
        let kept = self.as_given(fitted.clone());
        Ok(self.prepared.is_better(&fitted, &kept)?)
    }

    /// A fitted model with its declared numbers moved by as much as the given ones are from those fitted alone.
    fn as_given(&self, mut model: AugmentedModel) -> AugmentedModel {
        let unknowns = &self.prepared.unknowns;
        let (given, fitted) = (&self.prepared.case.given, &self.prepared.fitted.model);
        step(&mut model, unknowns, &unknowns.moved(fitted, given));
        model
    }

    fn fitted(&self, ways: &[&PendingEffect]) -> AugmentedModel {
        let own = ways.iter();
        let own = own.filter_map(|w| Some((&w.chosen, w.amplitude.clone()?)));
        tables::model(&self.field, &own.collect::<Vec<_>>())
    }

    /// Rows that may take an effect out, and whether they were given for it: blocks that are set aside are as the rest of
    /// their log, and of single joints they measure.
    fn judging_rows(&self) -> (HeldOutRows<'_>, bool) {
        let role = LogRole::Holdout;
        let given = self.prepared.case.roles.contains(&role);
        (self.prepared.held_out(role), given)
    }

    /// What each effect that stands changes on held-out data, the others refitted by the judge's sums.
    fn held_out(&self, ways: &mut [PendingEffect], written: &AugmentedModel) -> StepResult<()> {
        let rows = self.prepared.held_out(LogRole::Holdout);
        let set: Vec<usize> = (0..ways.len())
            .filter(|i| ways[*i].amplitude.is_some())
            .collect();
        let all: Vec<&PendingEffect> = set.iter().map(|i| &ways[*i]).collect();
        let with = self.based(self.fitted(&all));
        let unknowns = &self.prepared.unknowns;
        let before = self.prepared.case.given.effects.len();
        for (at, i) in set.iter().enumerate() {
            let others = set.iter().filter(|k| *k != i);
            let others: Vec<&PendingEffect> = others.map(|k| &ways[*k]).collect();
            let without = self.based(self.fitted(&others));
            ways[*i].change = rows.change([&without, &with])?;
            // the written model moved by as much as the judge's sums move without the effect
            let mut alone = written.clone();
            step(&mut alone, unknowns, &unknowns.moved(&with, &without));
            alone.effects.remove(before + at);
            ways[*i].without = Some(alone);
        }
        Ok(())
    }

    fn described(
        &self,
        ways: &[PendingEffect],
        estimates: &EffectEstimates,
        (proposed, written): (AugmentedModel, AugmentedModel),
    ) -> JudgedEffects {
        let mut place = self.prepared.case.given.effects.len();
        let mut steps = Vec::new();
        for way in ways {
            let Some(mut found) = self.step(way) else {
                continue;
            };
            if way.stands() {
                (found.written, place) = (Some(place), place + 1);
            }
            steps.push(found);
        }
        let (by_effects, to_estimate) = self.by_effects(ways, estimates);
        JudgedEffects {
            estimates: estimates.model(&self.field),
            covariance: estimates.covariance.clone(),
            by_effects,
            to_estimate,
            steps,
            proposed,
            named: written.clone(),
            written,
            predicting: Vec::new(),
            too_few_stretches: None,
        }
    }

    /// What the amplitudes of the effects that stand do to the unknowns beside them.
    fn by_effects(
        &self,
        ways: &[PendingEffect],
        estimates: &EffectEstimates,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let declared = self.field.summed.declared.len();
        let (mut spread, mut shift) =
            (DMatrix::zeros(declared, declared), DVector::zeros(declared));
        let places = estimates.places.iter();
        let places: Vec<usize> = places.flat_map(|p| p.terms.coefficients.clone()).collect();
        let Some(slopes) = estimates.fit.declared_by(declared, &places) else {
            return (spread, shift);
        };
        let own = estimates
            .covariance
            .select_rows(&places)
            .select_columns(&places);
        spread += &slopes * own * slopes.transpose();
        let kept = ways.iter().filter_map(|w| w.amplitude.as_ref());
        let predicting = DVector::from_iterator(places.len(), kept.flatten().copied());
        shift += slopes * (estimates.fit.values.select_rows(&places) - predicting);
        (spread, shift)
    }

    fn step(&self, way: &PendingEffect) -> Option<FoundEffect> {
        let numbers = self.field.numbers();
        let FittedEffect {
            verified,
            effect,
            covariance,
        } = way.found.as_ref()?;
        let amplitude = &verified.amplitude;
        let s = amplitude.s;
        let [torque, std] = amplitude.torque;
        // what one would not notice is not named, whatever else speaks against it
        let small = !verified.beside.noticeable && self.prepared.case.kept.is_none();
        let left = way.left.map(|left| match left {
            NotWritten::Unsure | NotWritten::Bound if small => NotWritten::Small,
            left => left,
        });
        let others = way.chosen.alternatives.iter();
        let status = match way.stands() {
            true if s > numbers.confirmed && torque > 2.0 * std => StepStatus::Confirmed,
            true => StepStatus::Indicated,
            false => StepStatus::Seen,
        };
        Some(FoundEffect {
            alternatives: others
                .map(|i| self.field.candidates[*i].effect.clone())
                .collect(),
            covariance: covariance.clone(),
            estimate: effect.clone(),
            written: None,
            status,
            left,
            shrinkage: s,
            deviations: amplitude.deviations(&self.field.numbers_of(effect)),
            torque: amplitude.torque,
            blocks: amplitude.blocks,
            parts: verified.blocks.clone(),
            gain: verified.beside.gain.clone(),
            share: verified.beside.gain.value / verified.beside.error.max(f64::MIN_POSITIVE),
            holdout: way.change.as_ref().map(|c| c.mean),
            joints: way.change.as_ref().map_or(Vec::new(), |c| c.joints.clone()),
            accepted_by_user: way.accepted,
            without: way.without.clone(),
        })
    }
}
