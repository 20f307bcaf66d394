//! From what was chosen to what is written: the parts' verdict, held-out data, and the user's own word.

use nalgebra::DMatrix;

use super::error::DiagnoseError;
use super::held_out::EffectChange;
use super::outcome::{FoundEffect, StepStatus};
use super::prepared::{PreparedCase, moved};
use super::problem::case::formula_name;
use super::problem::data_split::LogRole;
use super::problem::unknowns::{Unknown, step, value};
use super::search::{Chosen, Field};
use super::searched::SearchedCase;
use super::tables::{self, Estimates, TermPlaces, Verified};
use crate::effect::{Added, AugmentedModel};

/// What is made of the effects that were chosen.
#[derive(Clone)]
pub struct Judged {
    pub steps: Vec<FoundEffect>,
    /// With every effect whose parts agree.
    pub judge: AugmentedModel,
    /// Without those that held-out data took out; the given model where nothing is left.
    pub written: AugmentedModel,
    pub estimates: AugmentedModel,
    pub covariance: DMatrix<f64>,
    pub information: DMatrix<f64>,
}

/// One effect on its way.
struct Way {
    verified: Verified,
    accepted: bool,
    /// Amplitude in the predicting model; none where it is not in it.
    amplitude: Option<Vec<f64>>,
    change: Option<EffectChange>,
    vetoed: bool,
}

/// Asks the parts, then held-out data.
pub fn judge(prepared: &PreparedCase, searched: &SearchedCase) -> Result<Judged, DiagnoseError> {
    let mut work = Judging {
        prepared,
        field: prepared.field(&searched.candidates, &searched.summed),
        refit: true,
    };
    let mut ways = work.ways(searched);
    work.settle(&mut ways)?;
    work.refit = work.wants_other_numbers(&ways)?;
    let judge = work.written(&ways, true)?;
    work.look(&mut ways)?;
    let written = match ways.iter().any(|w| w.vetoed) {
        true => work.written(&ways, false)?,
        false => judge.clone(),
    };
    let written = work.halfway(written);
    work.described(&ways, judge, written)
}

struct Judging<'a> {
    prepared: &'a PreparedCase<'a>,
    field: Field<'a>,
    /// Whether these data want other declared numbers than those that were given.
    refit: bool,
}

impl Judging<'_> {
    /// The effects that were chosen, and those that the user wants.
    fn ways(&self, searched: &SearchedCase) -> Vec<Way> {
        let case = self.prepared.case;
        let named = |effect: &Added| {
            let mut wanted = case.wishes.accepted.iter();
            wanted.any(|w| case.is_named(effect, w))
        };
        let formula_wanted = |effect: &Added| {
            let joint = effect.place.name(&case.given.model.robot);
            let own = |name: &String| effect.name().starts_with(name);
            joint.is_some_and(|j| case.wishes.wants_formula(&j) && own(&formula_name(&j)))
        };
        let noisier = searched.noisier.as_ref();
        let verified = tables::verified(&self.field, &searched.chosen, noisier);
        let way = |verified: Verified| {
            let effect = self.field.effect(&verified.chosen);
            Way {
                accepted: named(effect) || effect.law.formula.is_some() && formula_wanted(effect),
                verified,
                amplitude: None,
                change: None,
                vetoed: false,
            }
        };
        verified.into_iter().map(way).collect()
    }

    /// Amplitudes of the predicting model: those of the joint fit with all effects whose parts agree, so far as they do.
    fn settle(&self, ways: &mut [Way]) -> Result<(), DiagnoseError> {
        let factors: Vec<f64> = ways.iter().map(|w| self.factor(w)).collect();
        let kept = ways.iter().zip(&factors).filter(|(_, f)| **f > 0.0);
        let kept: Vec<Chosen> = kept.map(|(w, _)| w.verified.chosen.clone()).collect();
        let estimates = Estimates::of(&self.field, &kept)?;
        let mut at = self.prepared.unknowns.len();
        for (way, factor) in ways.iter_mut().zip(factors).filter(|(_, f)| *f > 0.0) {
            let count = way.verified.amplitude.len();
            let own = estimates.values.rows(at, count);
            way.verified.amplitude = own.iter().copied().collect();
            // beside the others a bound may hold all of it, or what it cannot be without
            let effect = tables::effect(&self.field, &way.verified.chosen, own.as_slice());
            let there = own.iter().any(|x| *x != 0.0) && effect.can_be();
            way.amplitude = there.then(|| own.iter().map(|x| factor * x).collect());
            at += count;
        }
        Ok(())
    }

    /// Part of an effect's amplitude that predicts. What a person can measure is whole or is not there.
    fn factor(&self, way: &Way) -> f64 {
        let s = way.verified.agreement.s;
        let effect = self.field.effect(&way.verified.chosen);
        match (way.accepted, effect.law.entry.measurable) {
            (true, _) => 1.0,
            (false, false) => s,
            (false, true) if s > self.field.numbers().confirmed => 1.0,
            (false, true) => 0.0,
        }
    }

    /// The model with the effects that are in it, without those that held-out data took out unless `all` are asked for.
    fn written(&self, ways: &[Way], all: bool) -> Result<AugmentedModel, DiagnoseError> {
        let effects: Vec<_> = ways.iter().filter(|w| all || !w.vetoed).collect();
        match effects.iter().any(|w| w.amplitude.is_some()) {
            true => Ok(self.based(self.prepared.refit(&self.fitted(&effects))?)),
            false => Ok(self.prepared.case.given.clone()),
        }
    }

    /// A model with effects, its declared numbers as given but for what the effects change, unless these data want others.
    fn based(&self, model: AugmentedModel) -> AugmentedModel {
        match self.refit {
            true => model,
            false => self.as_given(model),
        }
    }

    /// Whether these data ask for declared numbers other than the given ones with what the effects change.
    fn wants_other_numbers(&self, ways: &[Way]) -> Result<bool, DiagnoseError> {
        let effects: Vec<_> = ways.iter().filter(|w| w.amplitude.is_some()).collect();
        let fitted = self.prepared.refit(&self.fitted(&effects))?;
        let kept = self.as_given(fitted.clone());
        Ok(self.prepared.is_better(&fitted, &kept)?)
    }

    /// A fitted model with its declared numbers moved by as much as the given ones are from those fitted alone.
    fn as_given(&self, mut model: AugmentedModel) -> AugmentedModel {
        let unknowns = &self.prepared.unknowns;
        let (given, fitted) = (&self.prepared.case.given, &self.prepared.fitted.model);
        let off = |u: &Unknown| value(given, *u) - value(fitted, *u);
        let off: Vec<f64> = unknowns.list.iter().map(off).collect();
        step(&mut model, unknowns, &off);
        model
    }

    /// The model with some effects as it would be written, by the sums of products.
    fn with(&self, ways: &[&Way]) -> AugmentedModel {
        self.based(self.fitted(ways))
    }

    fn fitted(&self, ways: &[&Way]) -> AugmentedModel {
        let own = ways.iter();
        let own = own.filter_map(|w| Some((&w.verified.chosen, w.amplitude.clone()?)));
        tables::model(&self.field, &own.collect::<Vec<_>>())
    }

    /// Takes out what makes a joint worse on held-out data, the worst first; then what gains least, while all are worse.
    fn look(&self, ways: &mut [Way]) -> Result<(), DiagnoseError> {
        let case = self.prepared.case;
        let vetoing = match case.roles.contains(&LogRole::Veto) {
            true => LogRole::Veto,
            false => LogRole::Holdout,
        };
        let rows = self.prepared.held_out(vetoing);
        let holdout = self.prepared.held_out(LogRole::Holdout);
        // blocks that are set aside are as the rest of their log: of single joints they measure
        let given = case.roles.contains(&vetoing);
        loop {
            let in_it = |w: &Way| w.amplitude.is_some() && !w.vetoed;
            let kept: Vec<usize> = (0..ways.len()).filter(|i| in_it(&ways[*i])).collect();
            let all: Vec<&Way> = kept.iter().map(|i| &ways[*i]).collect();
            let with = self.with(&all);
            let mut found = Vec::new();
            for i in &kept {
                let others = kept.iter().filter(|k| *k != i);
                let others: Vec<&Way> = others.map(|k| &ways[*k]).collect();
                let without = self.with(&others);
                let models = [&without, &with];
                found.push((*i, holdout.change(models)?, rows.change(models)?));
            }
            let mut worse: Vec<(usize, f64)> = Vec::new();
            let mut costs: Vec<(usize, f64)> = Vec::new();
            for (i, holdout, veto) in found {
                ways[i].change = holdout;
                let Some(veto) = veto.filter(|_| !ways[i].accepted) else {
                    continue;
                };
                worse.extend(veto.worst().filter(|_| given).map(|by| (i, by)));
                costs.push((i, veto.mean[1] - veto.mean[0]));
            }
            if worse.is_empty() && rows.mean_error(&with)? > rows.mean_error(&case.given)? {
                worse = costs;
            }
            match worse.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
                Some((i, _)) => ways[i].vetoed = true,
                None => return Ok(()),
            }
        }
    }

    /// The midpoint to the given model, where the user wants it.
    fn halfway(&self, mut model: AugmentedModel) -> AugmentedModel {
        let given = &self.prepared.case.given;
        if !self.prepared.case.wishes.cautious || model.effects.len() == given.effects.len() {
            return model;
        }
        let half = |u: &Unknown| 0.5 * (value(given, *u) - value(&model, *u));
        let half: Vec<f64> = self.prepared.unknowns.list.iter().map(half).collect();
        step(&mut model, &self.prepared.unknowns, &half);
        for effect in &mut model.effects[given.effects.len()..] {
            effect.linear.iter_mut().for_each(|x| *x *= 0.5);
        }
        model
    }

    fn described(
        &self,
        ways: &[Way],
        judge: AugmentedModel,
        written: AugmentedModel,
    ) -> Result<Judged, DiagnoseError> {
        let kept = ways.iter().filter(|w| w.amplitude.is_some());
        let kept: Vec<Chosen> = kept.map(|w| w.verified.chosen.clone()).collect();
        let estimates = Estimates::of(&self.field, &kept)?;
        let unknowns = &self.prepared.unknowns;
        let before = self.prepared.case.given.effects.len();
        let (mut judged, mut in_file) = (before, before);
        let mut places = estimates.places.iter();
        let mut steps = Vec::new();
        for way in ways {
            let place = |there: bool, next: &mut usize| {
                let place = there.then_some(*next);
                *next += usize::from(there);
                place
            };
            let in_it = way.amplitude.is_some();
            let mut step = self.step(way);
            step.judged = place(in_it, &mut judged);
            step.written = place(in_it && !way.vetoed, &mut in_file);
            if let Some(own) = in_it.then(|| places.next()).flatten() {
                step.covariance = covariance(&step.estimate, &estimates.covariance, own);
            }
            steps.push(step);
        }
        Ok(Judged {
            estimates: moved(&self.field.summed.about, unknowns, &estimates.values),
            covariance: estimates.covariance,
            information: estimates.information,
            steps,
            judge,
            written,
        })
    }

    fn step(&self, way: &Way) -> FoundEffect {
        let (chosen, agreement) = (&way.verified.chosen, &way.verified.agreement);
        let effect = tables::effect(&self.field, chosen, &way.verified.amplitude);
        let size = effect.parameters();
        let others = chosen.alternatives.iter();
        let held_out = self.prepared.case.roles.contains(&LogRole::Holdout);
        let confirms = way.change.as_ref().is_some_and(EffectChange::confirms);
        let status = match agreement.s {
            s if s > self.field.numbers().confirmed && (confirms || !held_out) && !way.vetoed => {
                StepStatus::Confirmed
            }
            s if s > 0.0 => StepStatus::Indicated,
            _ => StepStatus::Seen,
        };
        FoundEffect {
            alternatives: others
                .map(|i| self.field.candidates[*i].effect.clone())
                .collect(),
            covariance: vec![f64::INFINITY; size * size],
            estimate: effect,
            judged: None,
            written: None,
            status,
            shrinkage: agreement.s,
            agreement: agreement.z,
            parts: agreement.parts.clone(),
            gain: chosen.gain.clone(),
            share: chosen.gain.value / chosen.error.max(f64::MIN_POSITIVE),
            holdout: way.change.as_ref().map(|c| c.mean),
            joints: way.change.as_ref().map_or(Vec::new(), |c| c.joints.clone()),
            accepted_by_user: way.accepted,
        }
    }
}

/// Covariance of (shape, linear) of an effect that stands at some places; a shape that is not refined has none.
fn covariance(effect: &Added, all: &DMatrix<f64>, places: &TermPlaces) -> Vec<f64> {
    let (count, size) = (effect.shape.len(), effect.parameters());
    let place = |k: usize| match k.checked_sub(count) {
        Some(linear) => Some(places.first + linear),
        None => (places.shapes.iter().find(|(shape, _)| *shape == k)).map(|(_, place)| *place),
    };
    let of = |k: usize| {
        let (row, column) = (k / size, k % size);
        match (place(row), place(column)) {
            (Some(row), Some(column)) => all[(row, column)],
            (None, _) if row == column && !effect.held[row] => f64::INFINITY,
            _ => 0.0,
        }
    };
    (0..size * size).map(of).collect()
}
