//! The search: the greatest gain on blocks left out, again and again.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidates::{EffectCandidate, exclude, is_friction_law};
use super::error::DiagnoseError;
use super::prepared::{PreparedCase, SummedProducts};
use super::watch::DiagnosisWatch;
use crate::effect::{EffectPlace, Family, ModelEffect};
use crate::judge::{BlocksLeftOut, ErrorGain, Numbers, Term, Terms};

/// Candidates by their sums of products.
#[derive(Clone, Copy)]
pub struct Field<'a> {
    pub prepared: &'a PreparedCase<'a>,
    pub candidates: &'a [EffectCandidate],
    pub summed: &'a SummedProducts,
}

/// A candidate that gained most in its turn.
#[derive(Debug, Clone)]
pub struct ChosenCandidate {
    pub candidate: usize,
    /// Gain beside those before it.
    pub gain: ErrorGain,
    /// Squared error before it, in the weights of the joints.
    pub error: f64,
    /// Candidates of another name that gain as much, best first.
    pub alternatives: Vec<usize>,
    /// The user wants it whatever the judge says.
    pub accepted: bool,
}

/// The last look at a candidate that was not chosen.
#[derive(Debug, Clone)]
pub struct RejectedCandidate {
    pub candidate: usize,
    pub gain: ErrorGain,
}

/// Candidates that are looked at before the best of them is asked for.
const LOOKED_TOGETHER: usize = 16;

/// Most alternatives that are reported.
const ALTERNATIVES: usize = 3;

impl<'a> Field<'a> {
    pub fn numbers(&self) -> &'a Numbers {
        &self.prepared.case.numbers
    }

    /// The numbers by which an effect is judged.
    pub fn numbers_of(&self, effect: &ModelEffect) -> Numbers {
        let numbers = self.numbers();
        match effect.law.entry.expected {
            true => numbers.of_expected(),
            false => *numbers,
        }
    }

    pub fn effect(&self, chosen: &ChosenCandidate) -> &'a ModelEffect {
        &self.candidates[chosen.candidate].effect
    }

    /// Terms of a candidate's coefficients.
    pub fn terms_of(&self, candidate: usize) -> &'a [Term] {
        &self.summed.layout.candidates[candidate]
    }

    /// Chooses beside what is `chosen` what gains, the greatest first, and says what the others would gain in the end. No law
    /// that goes by time alone is chosen for a joint that is `stepped`.
    pub fn search(
        &self,
        mut chosen: Vec<ChosenCandidate>,
        stepped: &[usize],
        watch: DiagnosisWatch,
    ) -> Result<(Vec<ChosenCandidate>, Vec<RejectedCandidate>), DiagnoseError> {
        loop {
            let terms = self.terms(&chosen);
            let left_out = self.left_out(&terms)?;
            let taken: Vec<&ModelEffect> = chosen.iter().map(|c| self.effect(c)).collect();
            let excluded = |i: usize| {
                let effect = &self.candidates[i].effect;
                let by_time = effect.family() == Family::Slow;
                let is_step = |j: usize| by_time && stepped.contains(&j);
                own_joint(effect.place).is_some_and(is_step)
                    || taken.iter().any(|t| exclude(t, effect))
            };
            let open = (0..self.candidates.len()).filter(|i| !excluded(*i));
            // at most a friction law for each joint, and so many effects besides
            let laws = taken.iter().filter(|e| is_friction_law(e)).count();
            let room = |effect: &ModelEffect| match is_friction_law(effect) {
                true => laws < terms.weights.len(),
                false => taken.len() - laws < self.numbers().effects,
            };
            let (next, looked) = self.round(open.collect(), &left_out, &room, watch);
            let Some(mut next) = next else {
                return Ok((chosen, looked));
            };
            next.error = left_out.error();
            chosen.push(next);
        }
    }

    /// Looks at the open candidates, those first that gain most in the fit to all blocks, until no other can be the best
    /// or say the same as it; at all where none is admissible, or the search is to end.
    fn round(
        &self,
        open: Vec<usize>,
        left_out: &BlocksLeftOut,
        room: &dyn Fn(&ModelEffect) -> bool,
        watch: DiagnosisWatch,
    ) -> (Option<ChosenCandidate>, Vec<RejectedCandidate>) {
        let part = watch.part("candidates", open.len());
        let whole = left_out.whole_fit();
        let gain_of_fit = |candidate: usize| {
            part.step();
            let terms = self.terms_of(candidate);
            let gain = whole.as_ref().map(|w| left_out.gain_of_fit(terms, w));
            (gain.unwrap_or(f64::INFINITY), candidate)
        };
        let look = |&(_, candidate): &(f64, usize)| {
            let gain = left_out.gain(self.terms_of(candidate));
            RejectedCandidate { candidate, gain }
        };
        let mut order: Vec<(f64, usize)> = open.into_par_iter().map(gain_of_fit).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut next: Option<ChosenCandidate> = None;
        let mut looked: Vec<RejectedCandidate> = Vec::new();
        for group in order.chunks(LOOKED_TOGETHER) {
            let least = next.as_ref().map(|n| self.numbers().looked * n.gain.value);
            if least.is_some_and(|least| group[0].0 < least) || (watch.stop)() {
                break;
            }
            looked.extend(group.par_iter().map(look).collect::<Vec<_>>());
            next = self.best(&looked, room);
        }
        looked.sort_by_key(|l| l.candidate);
        (next.filter(|_| !(watch.stop)()), looked)
    }

    /// Declared terms and those of candidates that were chosen, one behind the other.
    pub fn terms(&self, chosen: &[ChosenCandidate]) -> Terms {
        let own = chosen.iter().flat_map(|c| self.terms_of(c.candidate));
        let own: Vec<Term> = own.cloned().collect();
        self.summed.declared.with(&own)
    }

    /// Fits of terms with each block left out.
    pub fn left_out<'t>(&self, terms: &'t Terms) -> Result<BlocksLeftOut<'t>, DiagnoseError>
    where
        'a: 't,
    {
        let found = BlocksLeftOut::new(&self.summed.sums, 0, terms);
        found.ok_or_else(|| self.prepared.nothing_determined())
    }

    /// Sums of all fitted blocks.
    pub fn total(&self) -> Vec<DMatrix<f64>> {
        let sums = &self.summed.sums;
        sums.over(0..sums.blocks.len())
    }

    /// The greatest admissible gain, or what says the same with fewer numbers.
    fn best(
        &self,
        looked: &[RejectedCandidate],
        room: &dyn Fn(&ModelEffect) -> bool,
    ) -> Option<ChosenCandidate> {
        let effect = |l: &RejectedCandidate| &self.candidates[l.candidate].effect;
        let Numbers { screen, same, .. } = *self.numbers();
        let beyond = |l: &&RejectedCandidate| l.gain.is_beyond(screen, own_joint(effect(l).place));
        let admissible = looked.iter().filter(|l| room(effect(l)));
        let admissible: Vec<&RejectedCandidate> = admissible.filter(beyond).collect();
        let value =
            |a: &&RejectedCandidate, b: &&RejectedCandidate| a.gain.value.total_cmp(&b.gain.value);
        let best = admissible.iter().copied().max_by(value)?;
        let near = |l: &&RejectedCandidate| {
            let [own, place] = [effect(l).place, effect(best).place];
            let mut joints = 0..self.prepared.cover.joints.len();
            joints.any(|j| own.touches(j) && place.touches(j)) && l.gain.is_near(&best.gain, same)
        };
        let mut alike: Vec<&RejectedCandidate> = admissible.iter().copied().filter(near).collect();
        alike.push(best);
        alike.sort_by(|a, b| value(b, a));
        // the first of those with the fewest
        let taken = alike.iter().min_by_key(|l| effect(l).parameters())?;
        let mut names = vec![effect(taken).name()];
        let mut alternatives = Vec::new();
        for other in &alike {
            if !names.contains(&effect(other).name()) && alternatives.len() < ALTERNATIVES {
                names.push(effect(other).name());
                alternatives.push(other.candidate);
            }
        }
        Some(ChosenCandidate {
            candidate: taken.candidate,
            gain: taken.gain.clone(),
            error: 0.0,
            alternatives,
            accepted: false,
        })
    }
}

/// The joint that an effect must explain by itself; none of one on several.
pub fn own_joint(place: EffectPlace) -> Option<usize> {
    match place {
        EffectPlace::Joint(j) | EffectPlace::Pair { on: j, .. } => Some(j),
        EffectPlace::Actuator(_)
        | EffectPlace::Actuators
        | EffectPlace::Geared { .. }
        | EffectPlace::All => None,
    }
}
