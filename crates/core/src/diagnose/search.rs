//! The search: the greatest gain on blocks left out, again and again.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidates::{Candidate, exclude, is_friction_law};
use super::watch::Watch;
use crate::effect::{Added, Place};
use crate::judge::{BlockSums, BlocksLeftOut, ErrorGain, Numbers, Term, Terms};

/// What is searched.
#[derive(Clone, Copy)]
pub struct Field<'a> {
    pub candidates: &'a [Candidate],
    /// Terms of each candidate's coefficients, and of the slopes by its shape.
    pub terms: &'a [Vec<Term>],
    pub slopes: &'a [Vec<Term>],
    pub sums: &'a BlockSums,
    /// Blocks at the end that judge and are never fitted.
    pub judging: usize,
    pub numbers: &'a Numbers,
    pub watch: Watch<'a>,
}

/// A candidate that gained most in its turn.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// Its index.
    pub candidate: usize,
    /// Gain beside those before it.
    pub gain: ErrorGain,
    /// Squared error before it, in the weights of the joints.
    pub error: f64,
    /// Candidates of another name that gain as much, best first.
    pub alternatives: Vec<usize>,
}

/// The last look at a candidate that was not chosen.
#[derive(Debug, Clone)]
pub struct Looked {
    pub candidate: usize,
    pub gain: ErrorGain,
}

/// Most alternatives that are reported.
const ALTERNATIVES: usize = 3;

impl Field<'_> {
    /// Chooses what gains, the greatest first: at most a friction law for each joint, and `effects` besides, those that
    /// are `chosen` already among them. Returns also what the others would gain in the end. None where these data determine nothing.
    pub fn search(
        &self,
        declared: &Terms,
        mut chosen: Vec<Chosen>,
    ) -> Option<(Vec<Chosen>, Vec<Looked>)> {
        loop {
            let terms = declared.with(&self.terms_of(&chosen));
            let left_out = BlocksLeftOut::new(self.sums, self.judging, &terms)?;
            let taken: Vec<&Added> = self.taken(&chosen);
            let open: Vec<usize> = (0..self.candidates.len())
                .filter(|i| {
                    !taken
                        .iter()
                        .any(|t| exclude(t, &self.candidates[*i].effect))
                })
                .collect();
            let part = self.watch.part("candidates", open.len());
            let looked: Vec<Looked> = open
                .into_par_iter()
                .map(|candidate| {
                    part.step();
                    let gain = left_out.gain(&self.terms[candidate]);
                    Looked { candidate, gain }
                })
                .collect();
            drop(part);
            let laws = taken.iter().filter(|e| is_friction_law(e)).count();
            let room = |effect: &Added| match is_friction_law(effect) {
                true => laws < declared.weights.len(),
                false => taken.len() - laws < self.numbers.effects,
            };
            let next = match (self.watch.stop)() {
                true => None,
                false => self.best(&looked, &room),
            };
            let Some(mut next) = next else {
                return Some((chosen, looked));
            };
            next.error = left_out.error();
            chosen.push(next);
        }
    }

    /// Terms of candidates that were chosen, one behind the other.
    pub fn terms_of(&self, chosen: &[Chosen]) -> Vec<Term> {
        let all = chosen.iter().flat_map(|c| &self.terms[c.candidate]);
        all.cloned().collect()
    }

    /// Terms of their slopes.
    pub fn slopes_of(&self, chosen: &[Chosen]) -> Vec<Term> {
        let all = chosen.iter().flat_map(|c| &self.slopes[c.candidate]);
        all.cloned().collect()
    }

    /// Sums of all fitted blocks.
    pub fn total(&self) -> Vec<DMatrix<f64>> {
        self.sums.over(0..self.sums.blocks.len() - self.judging)
    }

    fn taken(&self, chosen: &[Chosen]) -> Vec<&Added> {
        let all = chosen.iter().map(|c| &self.candidates[c.candidate].effect);
        all.collect()
    }

    /// The greatest admissible gain, or what says the same with fewer numbers.
    fn best(&self, looked: &[Looked], room: &dyn Fn(&Added) -> bool) -> Option<Chosen> {
        let effect = |l: &Looked| &self.candidates[l.candidate].effect;
        let admissible: Vec<&Looked> = looked
            .iter()
            .filter(|l| room(effect(l)))
            .filter(|l| {
                l.gain
                    .is_beyond(self.numbers.screen, own_joint(effect(l).place))
            })
            .collect();
        let value = |a: &&Looked, b: &&Looked| a.gain.value.total_cmp(&b.gain.value);
        let best = admissible.iter().copied().max_by(value)?;
        let near = |l: &&Looked| {
            share_joints(effect(l).place, effect(best).place)
                && l.gain.is_near(&best.gain, self.numbers.same)
        };
        let mut alike: Vec<&Looked> = admissible.iter().copied().filter(near).collect();
        alike.push(best);
        alike.sort_by(|a, b| value(b, a));
        let fewest = alike.iter().map(|l| effect(l).parameters()).min()?;
        let simplest = |l: &&&Looked| effect(l).parameters() == fewest;
        let taken = alike.iter().find(simplest).copied().unwrap_or(best);
        let mut names = vec![effect(taken).name()];
        let mut alternatives = Vec::new();
        for other in alike {
            if !names.contains(&effect(other).name()) && alternatives.len() < ALTERNATIVES {
                names.push(effect(other).name());
                alternatives.push(other.candidate);
            }
        }
        Some(Chosen {
            candidate: taken.candidate,
            gain: taken.gain.clone(),
            error: 0.0,
            alternatives,
        })
    }
}

/// The joint that an effect must explain by itself; none of one on several.
pub fn own_joint(place: Place) -> Option<usize> {
    match place {
        Place::Joint(j) | Place::Pair { on: j, .. } => Some(j),
        Place::Actuator(_) | Place::Geared { .. } | Place::All => None,
    }
}

/// Whether two places act on a joint together.
fn share_joints(a: Place, b: Place) -> bool {
    let joints = |place: Place| match place {
        Place::Joint(j) | Place::Pair { on: j, .. } => vec![j],
        Place::Geared { motor, other } => vec![motor, other],
        Place::Actuator(_) => vec![2, 3],
        Place::All => Vec::new(),
    };
    let (a, b) = (joints(a), joints(b));
    a.is_empty() || b.is_empty() || a.iter().any(|j| b.contains(j))
}
