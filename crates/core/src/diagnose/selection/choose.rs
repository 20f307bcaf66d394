//! Which of the accepted candidates is added.

use crate::diagnose::candidates::candidate::Candidate;
use crate::diagnose::candidates::score::spread;
use crate::effect::{Added, LAWS};

/// Of accepted candidates the one to add, and those that the data do not separate from it: within
/// one standard error over the folds. Among these the one with the fewest parameters is taken, then
/// the first in the order of [`LAWS`].
pub fn choose(found: &[Candidate], skip: &[usize]) -> Option<(usize, Vec<usize>)> {
    let scored = |i: usize| found[i].score.as_ref();
    let open: Vec<usize> = (0..found.len())
        .filter(|i| found[*i].accepted && !skip.contains(i) && scored(*i).is_some())
        .collect();
    let gain = |i: usize| scored(i).map_or(f64::NEG_INFINITY, |s| s.cv_gain);
    let best = open
        .iter()
        .copied()
        .max_by(|a, b| gain(*a).total_cmp(&gain(*b)))?;
    let top = &scored(best)?.folds;
    let near: Vec<usize> = open
        .iter()
        .copied()
        .filter(|&i| {
            scored(i).is_some_and(|s| {
                let worse: f64 = s.folds.iter().sum::<f64>() - top.iter().sum::<f64>();
                i == best || worse <= spread(&s.folds, top)
            })
        })
        .collect();
    let order = |i: usize| {
        LAWS.iter()
            .position(|k| k.entry.name == found[i].effect.name())
    };
    let chosen = near
        .iter()
        .copied()
        .min_by_key(|&i| (found[i].effect.parameters(), order(i), i))?;
    let mut others: Vec<usize> = near.into_iter().filter(|i| *i != chosen).collect();
    others.sort_by(|a, b| gain(*b).total_cmp(&gain(*a)));
    Some((chosen, others))
}

/// Most alternatives that are told beside an effect.
const ALTERNATIVES: usize = 3;

/// Of candidates that the data do not separate from the chosen one, the best of each other kind that moves a joint
/// of its: what moves other joints explains another residual.
pub fn alternatives(
    found: &[Candidate],
    chosen: usize,
    others: &[usize],
    joints: usize,
) -> Vec<Candidate> {
    let chosen = &found[chosen].effect;
    let mut alternatives: Vec<Candidate> = Vec::new();
    for other in others.iter().map(|i| &found[*i]) {
        let same = |effect: &Added| effect.name() == other.effect.name();
        let together = |j| chosen.place.touches(j) && other.effect.place.touches(j);
        let told = same(chosen) || alternatives.iter().any(|a| same(&a.effect));
        if (0..joints).any(together) && !told && alternatives.len() < ALTERNATIVES {
            alternatives.push(other.clone());
        }
    }
    alternatives
}
