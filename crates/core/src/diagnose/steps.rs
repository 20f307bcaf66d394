//! From what was chosen to what is written: the parts' verdict, held-out data, and the user's own word.

use nalgebra::DMatrix;

use super::error::DiagnoseError;
use super::held_out::EffectChange;
use super::outcome::{FoundEffect, StepStatus};
use super::prepared::{PreparedCase, SearchedCase, moved};
use super::problem::data_split::LogRole;
use super::problem::unknowns::{Unknown, value};
use super::search::{Chosen, Field};
use super::tables::{self, Estimates, Verified};
use super::watch::UNWATCHED;
use crate::effect::{Added, AugmentedModel};
use crate::judge::{Numbers, Terms};

/// What is made of the effects that were chosen.
pub struct Judged {
    pub steps: Vec<FoundEffect>,
    /// With every effect whose parts agree.
    pub judge: AugmentedModel,
    /// Without those that held-out data took out; the given model where nothing is left.
    pub written: AugmentedModel,
    pub estimates: AugmentedModel,
    pub covariance: DMatrix<f64>,
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
///
/// # Errors
/// [`DiagnoseError`].
pub fn judge(prepared: &PreparedCase, searched: &SearchedCase) -> Result<Judged, DiagnoseError> {
    let declared = prepared.terms(&searched.layout);
    let parts = (&searched.candidates[..], &searched.layout);
    let field = prepared.field(parts, &searched.sums, UNWATCHED);
    let work = Judging {
        prepared,
        field,
        declared,
    };
    let mut ways = work.ways(searched)?;
    work.settle(&mut ways)?;
    let judge = work.written(&ways, true)?;
    work.look(&mut ways)?;
    let written = match ways.iter().any(|w| w.vetoed) {
        true => work.written(&ways, false)?,
        false => judge.clone(),
    };
    let written = work.halfway(written);
    work.told(&ways, judge, written)
}

struct Judging<'a> {
    prepared: &'a PreparedCase<'a>,
    field: Field<'a>,
    declared: Terms,
}

impl Judging<'_> {
    fn numbers(&self) -> &Numbers {
        self.field.numbers
    }

    /// The effects that were chosen, and those that the user wants.
    fn ways(&self, searched: &SearchedCase) -> Result<Vec<Way>, DiagnoseError> {
        let case = self.prepared.case;
        let mut chosen = searched.chosen.clone();
        let robot = &case.given.model.robot;
        let is = |effect: &Added, (name, joint): &(String, Option<String>)| {
            effect.name() == name && effect.place.name(robot) == *joint
        };
        for wanted in &case.wishes.accepted {
            let of = |c: &usize| is(&searched.candidates[*c].0, wanted);
            if chosen.iter().any(|c| of(&c.candidate)) {
                continue;
            }
            let looked = searched.looked.iter().filter(|l| of(&l.candidate));
            let best = looked.max_by(|a, b| a.gain.value.total_cmp(&b.gain.value));
            let Some(best) = best else {
                return Err(not_there(wanted));
            };
            chosen.push(Chosen {
                candidate: best.candidate,
                gain: best.gain.clone(),
                error: searched.error,
                alternatives: Vec::new(),
            });
        }
        let verified =
            tables::verified(&self.field, &self.declared, &chosen, &self.prepared.blocks);
        let way = |verified: Verified| {
            let effect = &searched.candidates[verified.chosen.candidate].0;
            Way {
                accepted: case.wishes.accepted.iter().any(|wanted| is(effect, wanted)),
                verified,
                amplitude: None,
                change: None,
                vetoed: false,
            }
        };
        Ok(verified.into_iter().map(way).collect())
    }

    /// Amplitudes of the predicting model: those of the joint fit with all effects whose parts agree, as much of each as
    /// they agree.
    fn settle(&self, ways: &mut [Way]) -> Result<(), DiagnoseError> {
        let factors: Vec<f64> = ways.iter().map(|w| self.factor(w)).collect();
        let kept = ways.iter().zip(&factors).filter(|(_, f)| **f > 0.0);
        let kept: Vec<Chosen> = kept.map(|(w, _)| w.verified.chosen.clone()).collect();
        let estimates = self.estimates(&kept)?;
        let mut at = self.declared.len();
        for (way, factor) in ways.iter_mut().zip(factors).filter(|(_, f)| *f > 0.0) {
            let count = way.verified.amplitude.len();
            let own = estimates.values.rows(at, count);
            way.verified.amplitude = own.iter().copied().collect();
            way.amplitude = Some(own.iter().map(|x| factor * x).collect());
            at += count;
        }
        Ok(())
    }

    fn estimates(&self, effects: &[Chosen]) -> Result<Estimates, DiagnoseError> {
        let nothing = DiagnoseError::NothingDetermined {
            unknowns: self.prepared.unknowns.len(),
        };
        Estimates::of(&self.field, &self.declared, effects).ok_or(nothing)
    }

    /// Part of an effect's amplitude that predicts. What a person can measure is whole or is not there.
    fn factor(&self, way: &Way) -> f64 {
        let s = way.verified.agreement.s;
        let effect = &self.field.candidates[way.verified.chosen.candidate].0;
        match (way.accepted, effect.law.entry.measurable) {
            (true, _) => 1.0,
            (false, false) => s,
            (false, true) if s > self.numbers().confirmed => 1.0,
            (false, true) => 0.0,
        }
    }

    /// The model with the effects that are in it, without those that held-out data took out unless `all` are asked for.
    fn written(&self, ways: &[Way], all: bool) -> Result<AugmentedModel, DiagnoseError> {
        let effects: Vec<_> = ways.iter().filter(|w| all || !w.vetoed).collect();
        match effects.iter().any(|w| w.amplitude.is_some()) {
            true => Ok(self.prepared.refit(&self.with(&effects))?),
            false => Ok(self.prepared.case.given.clone()),
        }
    }

    /// The model with some effects, by the sums of products.
    fn with(&self, ways: &[&Way]) -> AugmentedModel {
        let own = ways
            .iter()
            .filter_map(|w| Some((&w.verified.chosen, w.amplitude.clone()?)));
        let own: Vec<_> = own.collect();
        let values = tables::beside(&self.field, &self.declared, &own);
        let fitted = (&self.prepared.fitted.model, &self.prepared.unknowns);
        tables::model(&self.field, fitted, &values, &own)
    }

    /// Compares held-out errors with and without every effect, the others kept and refitted, and takes out what makes a
    /// joint worse: the worst first.
    fn look(&self, ways: &mut [Way]) -> Result<(), DiagnoseError> {
        let roles = &self.prepared.case.roles;
        let vetoing = match roles.contains(&LogRole::Veto) {
            true => LogRole::Veto,
            false => LogRole::Holdout,
        };
        // blocks that are set aside are as the rest of their log: they measure
        let given = roles.contains(&vetoing);
        loop {
            let in_it = |w: &Way| w.amplitude.is_some() && !w.vetoed;
            let kept: Vec<usize> = (0..ways.len()).filter(|i| in_it(&ways[*i])).collect();
            let all: Vec<&Way> = kept.iter().map(|i| &ways[*i]).collect();
            let with = self.with(&all);
            let mut found = Vec::new();
            for i in &kept {
                let others: Vec<&Way> =
                    kept.iter().filter(|k| *k != i).map(|k| &ways[*k]).collect();
                let without = self.with(&others);
                let change = |role| self.prepared.held_out(role).change([&without, &with]);
                found.push((*i, change(LogRole::Holdout)?, change(vetoing)?));
            }
            let worst = |c: &Option<EffectChange>| c.as_ref().and_then(EffectChange::worst);
            let mut worse: Vec<(usize, f64)> = Vec::new();
            for (i, holdout, veto) in found {
                if let Some(by) = worst(&veto).filter(|_| given && !ways[i].accepted) {
                    worse.push((i, by));
                }
                ways[i].change = holdout;
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
        let half: Vec<f64> = (self.prepared.unknowns.list.iter())
            .map(|u: &Unknown| 0.5 * (value(given, *u) - value(&model, *u)))
            .collect();
        super::problem::unknowns::step(&mut model, &self.prepared.unknowns, &half);
        for effect in &mut model.effects[given.effects.len()..] {
            effect.linear.iter_mut().for_each(|x| *x *= 0.5);
        }
        model
    }

    fn told(
        &self,
        ways: &[Way],
        judge: AugmentedModel,
        written: AugmentedModel,
    ) -> Result<Judged, DiagnoseError> {
        let kept = ways.iter().filter(|w| w.amplitude.is_some());
        let kept: Vec<Chosen> = kept.map(|w| w.verified.chosen.clone()).collect();
        let estimates = self.estimates(&kept)?;
        let (fitted, unknowns) = (&self.prepared.fitted.model, &self.prepared.unknowns);
        let before = self.prepared.case.given.effects.len();
        let (mut judged, mut in_file, mut at) = (before, before, self.declared.len());
        let mut steps = Vec::new();
        for way in ways {
            let count = way.verified.amplitude.len();
            let place = |there: bool, next: &mut usize| {
                let place = there.then_some(*next);
                *next += usize::from(there);
                place
            };
            let in_it = way.amplitude.is_some();
            let mut step = self.step(way);
            step.judged = place(in_it, &mut judged);
            step.written = place(in_it && !way.vetoed, &mut in_file);
            if in_it {
                step.covariance = covariance(&step.estimate, &estimates.covariance, at);
                at += count;
            }
            steps.push(step);
        }
        Ok(Judged {
            estimates: moved(fitted, unknowns, &estimates.values),
            covariance: estimates.covariance,
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
            s if s > self.numbers().confirmed && (confirms || !held_out) && !way.vetoed => {
                StepStatus::Confirmed
            }
            s if s > 0.0 => StepStatus::Indicated,
            _ => StepStatus::Seen,
        };
        FoundEffect {
            alternatives: others
                .map(|i| self.field.candidates[*i].0.clone())
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

/// Covariance of (shape, linear) of an effect whose coefficients stand from `at` on; shapes are not fitted.
fn covariance(effect: &Added, all: &DMatrix<f64>, at: usize) -> Vec<f64> {
    let (shapes, size) = (effect.shape.len(), effect.parameters());
    let of = |k: usize| {
        let (row, column) = (k / size, k % size);
        match row >= shapes && column >= shapes {
            true => all[(at + row - shapes, at + column - shapes)],
            false => 0.0,
        }
    };
    (0..size * size).map(of).collect()
}

fn not_there((name, joint): &(String, Option<String>)) -> DiagnoseError {
    let place = joint.as_ref().map_or(String::new(), |j| format!(" of {j}"));
    DiagnoseError::Accept {
        name: format!("{name}{place}"),
        why: "it was not among the candidates: see `candidates` in the JSON document for those that there are"
            .to_owned(),
    }
}
