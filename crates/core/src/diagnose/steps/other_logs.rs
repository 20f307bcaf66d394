//! Whole logs left out: of several logs each is predicted by the others, with an effect and without it. Blocks of a log that
//! is fitted share its motion; another log does not.

use rayon::prelude::*;

use super::{EffectJudge, PendingEffect};
use crate::diagnose::search::{ChosenCandidate, own_joint};
use crate::judge::{BlockSums, compare};

impl EffectJudge<'_> {
    /// The effect that harms a log which was left out most: its own joint, or any where it has none, beyond the standard
    /// errors that a gain must have and by what one would notice. None with one log. `part` is what of an amplitude is
    /// written.
    pub(super) fn harm_to_other_logs(
        &self,
        ways: &[PendingEffect],
        part: &(dyn Fn(&PendingEffect) -> f64 + Sync),
    ) -> Option<usize> {
        let logs = self.field.summed.sums.by_log(&self.logs);
        if logs.len() < 2 {
            return None;
        }
        let set: Vec<usize> = (0..ways.len()).filter(|i| ways[*i].stands()).collect();
        let asked = set.par_iter().copied().filter(|i| !ways[*i].accepted);
        let harm = |i: usize| {
            let others: Vec<&PendingEffect> =
                set.iter().filter(|k| **k != i).map(|k| &ways[*k]).collect();
            let all: Vec<&PendingEffect> = set.iter().map(|k| &ways[*k]).collect();
            let own = own_joint(self.field.effect(&ways[i].chosen).place);
            let of_log = |(other, log): &(BlockSums, BlockSums)| {
                let [with, without] =
                    [&all, &others].map(|terms| self.squares_of(terms, part, (other, log)));
                self.harm_beyond_doubt([&without, &with], own)
            };
            let most = logs.iter().filter_map(of_log).fold(0.0, f64::max);
            (most > 0.0).then_some((i, most))
        };
        let most = asked.filter_map(harm).max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(most.0)
    }

    /// Squared errors of a log's blocks by the effects that the others show, `[block][joint]`.
    fn squares_of(
        &self,
        effects: &[&PendingEffect],
        part: &dyn Fn(&PendingEffect) -> f64,
        (others, log): (&BlockSums, &BlockSums),
    ) -> Vec<Vec<f64>> {
        let chosen: Vec<ChosenCandidate> = effects.iter().map(|way| way.chosen.clone()).collect();
        let terms = self.field.terms(&chosen);
        let total = others.over(0..others.blocks.len());
        let whole = terms.fit(&total, &[]).values;
        let mut at = self.field.summed.declared.len();
        let mut fixed: Vec<(usize, f64)> = Vec::new();
        for way in effects {
            let count = self.field.terms_of(way.chosen.candidate).len();
            let part = part(way);
            fixed.extend((at..at + count).map(|i| (i, part * whole[i])));
            at += count;
        }
        let values = terms.fit(&total, &fixed).values;
        let blocks = log.blocks.iter();
        blocks.map(|block| terms.squares(block, &values)).collect()
    }

    /// The part of a joint's squared error that a change adds, where that is sure and one would notice it.
    fn harm_beyond_doubt(
        &self,
        [before, after]: [&[Vec<f64>]; 2],
        own: Option<usize>,
    ) -> Option<f64> {
        let numbers = self.field.numbers();
        let weights = &self.field.summed.declared.weights;
        let gain = compare(before, after, weights);
        let part = |j: usize| {
            let total = weights[j] * before.iter().map(|e| e[j]).sum::<f64>();
            let [value, error] = gain.joints[j];
            let part = -value / total.max(f64::MIN_POSITIVE);
            let noticed = (1.0 + numbers.noticeable).powi(2) - 1.0;
            (value < -numbers.screen * error && part > noticed).then_some(part)
        };
        let asked = (0..weights.len()).filter(|j| own.is_none_or(|own| own == *j));
        asked.filter_map(part).max_by(f64::total_cmp)
    }
}
