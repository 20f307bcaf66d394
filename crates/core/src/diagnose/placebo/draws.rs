//! The best of each draw over all candidates, and the place of a candidate among them.

use rayon::prelude::*;

use super::blocks::{Blocks, DRAWS};
use super::scores::BlockScores;

/// The shapes of one candidate that the search began from.
#[derive(Debug, Clone, Default)]
pub struct Tried {
    pub starts: Vec<BlockScores>,
    /// Which of them removes most of the log itself.
    pub best: usize,
    /// How many were looked at before these were picked, where that is more.
    pub picked_from: usize,
}

impl Tried {
    /// How surely the best of the shapes of the log itself is no chance: -ln p, less what looking at so many makes.
    fn of_log(&self) -> f64 {
        let best = self.starts.get(self.best);
        best.map_or(0.0, |s| self.surely(s.p_value()))
    }

    fn surely(&self, alone: f64) -> f64 {
        let picked = self.picked_from.max(self.starts.len()) as f64 / self.starts.len() as f64;
        -alone.max(f64::MIN_POSITIVE).ln() - picked.ln()
    }

    /// -ln p of the best of these shapes in a draw.
    fn of_draw(&self, draw: usize, signs: &[f64]) -> f64 {
        let gains = self.starts.iter().map(|s| s.gain_of_draw(draw)).enumerate();
        let best = gains.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i);
        let p = best.map_or(1.0, |i| self.starts[i].p_value_of_draw(draw, signs));
        -p.max(f64::MIN_POSITIVE).ln()
    }
}

/// What draws make of a candidate by itself: above its median -ln p falls off as an exponential whose mean is 1
/// where p is right, so that candidates with few blocks do not crowd out the others.
#[derive(Debug, Clone, Copy)]
struct Tail {
    median: f64,
    mean: f64,
}

/// Least mean of a tail: with less, the draws say next to nothing of the candidate.
const LEAST_MEAN: f64 = 0.25;

impl Tail {
    /// Of -ln p of the draws.
    fn of(draws: &[f64]) -> Self {
        let mut sorted = draws.to_vec();
        sorted.sort_by(f64::total_cmp);
        let above = &sorted[sorted.len() / 2..];
        let median = above[0];
        let mean = above.iter().map(|x| x - median).sum::<f64>() / above.len() as f64;
        Tail {
            median,
            mean: mean.max(LEAST_MEAN),
        }
    }

    fn place(self, x: f64) -> f64 {
        (x - self.median) / self.mean
    }
}

/// The best of all candidates in each draw, in order, and the tail of each candidate.
pub struct Placebos {
    best: Vec<f64>,
    tails: Vec<Option<Tail>>,
}

impl Placebos {
    /// Tries all candidates on all draws.
    pub fn of(blocks: &Blocks, tried: &[Tried]) -> Self {
        let of_candidate = |tried: &Tried| -> Option<(Tail, Vec<f64>)> {
            if tried.starts.is_empty() {
                return None;
            }
            let draws = blocks.signs.of_draws.iter().enumerate();
            let draws: Vec<f64> = draws.map(|(d, signs)| tried.of_draw(d, signs)).collect();
            let tail = Tail::of(&draws);
            Some((tail, draws.into_iter().map(|x| tail.place(x)).collect()))
        };
        let all: Vec<Option<(Tail, Vec<f64>)>> = tried.par_iter().map(of_candidate).collect();
        let mut best = vec![f64::NEG_INFINITY; DRAWS];
        for (_, draws) in all.iter().flatten() {
            for (best, x) in best.iter_mut().zip(draws) {
                *best = best.max(*x);
            }
        }
        best.sort_by(f64::total_cmp);
        let tails = all.into_iter().map(|found| found.map(|(tail, _)| tail));
        Placebos {
            best,
            tails: tails.collect(),
        }
    }

    /// Chance of a candidate as good as the one of this index among all candidates where nothing is missing.
    pub fn p_value(&self, index: usize, tried: &Tried) -> f64 {
        self.chance(index, tried.of_log())
    }

    /// The same of a candidate that by itself would come of chance with `alone`.
    pub fn p_value_of(&self, index: usize, tried: &Tried, alone: f64) -> f64 {
        self.chance(index, tried.surely(alone))
    }

    fn chance(&self, index: usize, surely: f64) -> f64 {
        let Some(tail) = self.tails[index] else {
            return 1.0;
        };
        let own = tail.place(surely);
        let as_good = self.best.len() - self.best.partition_point(|draw| *draw < own);
        (1 + as_good) as f64 / (1 + self.best.len()) as f64
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::diagnose::placebo::blocks::Signs;
    use crate::diagnose::problem::cross_products::CrossProducts;
    use crate::diagnose::problem::data_split::{Piece, RowRole};
    use crate::diagnose::problem::normal_equations::NormalEquations;

    const BLOCKS: usize = 40;
    const ROWS: usize = 12;
    const CANDIDATES: usize = 5;

    /// Chances of candidates beside one declared column, the first of which is in the data with `size`.
    fn chances(seed: u64, size: f64) -> Vec<f64> {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
        let rows = BLOCKS * ROWS;
        let mut draw = || DVector::from_iterator(rows, (0..rows).map(|_| normal()));
        let declared = draw();
        let columns: Vec<DVector<f64>> =
            (0..CANDIDATES).map(|_| draw() + 0.5 * &declared).collect();
        let measured = draw() + 0.7 * &declared + size * &columns[0];
        let residual = &measured - &declared * (declared.dot(&measured) / declared.norm_squared());
        let pieces: Vec<Piece> = (0..BLOCKS)
            .map(|b| Piece {
                stretch: 0,
                rows: b * ROWS..(b + 1) * ROWS,
                role: RowRole::Fold(b % 10),
            })
            .collect();
        let signs = Signs::of(&pieces);
        assert_eq!(signs.blocks, BLOCKS);
        let in_block = |a: &DVector<f64>, b: &DVector<f64>, block: usize| {
            a.rows(block * ROWS, ROWS).dot(&b.rows(block * ROWS, ROWS))
        };
        let one = |x: f64| DMatrix::from_element(1, 1, x);
        let sums: Vec<NormalEquations> = (0..BLOCKS)
            .map(|b| NormalEquations {
                normal: one(in_block(&declared, &declared, b)),
                score: DVector::from_element(1, in_block(&declared, &residual, b)),
                square: in_block(&residual, &residual, b),
            })
            .collect();
        let mut pulls = DMatrix::zeros(1, DRAWS);
        for (d, signs) in signs.of_draws.iter().enumerate() {
            pulls[(0, d)] = signs
                .iter()
                .zip(&sums)
                .map(|(s, sums)| s * sums.score[0])
                .sum();
        }
        let blocks = Blocks {
            signs,
            sums,
            pulls,
            prior: one(0.0),
        };
        let of_candidate = |c: &DVector<f64>| {
            let projection = one(declared.dot(c) / declared.norm_squared());
            let own = c - &declared * projection[(0, 0)];
            let sums: Vec<CrossProducts> = (0..BLOCKS)
                .map(|b| CrossProducts {
                    with_base: one(in_block(&declared, c, b)),
                    own: one(in_block(c, c, b)),
                    score: DVector::from_element(1, in_block(c, &residual, b)),
                })
                .collect();
            let right = DVector::from_element(1, own.dot(&residual));
            let own = one(own.norm_squared());
            Tried {
                starts: vec![BlockScores::of(
                    &blocks,
                    &sums,
                    &projection,
                    (&own, &right),
                    &[0],
                )],
                ..Tried::default()
            }
        };
        let tried: Vec<Tried> = columns.iter().map(of_candidate).collect();
        let placebos = Placebos::of(&blocks, &tried);
        (0..CANDIDATES)
            .map(|i| placebos.p_value(i, &tried[i]))
            .collect()
    }

    #[test]
    fn where_nothing_is_missing_the_best_candidate_is_as_good_as_one_placebo_in_ten_in_a_tenth() {
        let campaigns = 200;
        let lowest = |seed| chances(seed, 0.0).into_iter().fold(1.0, f64::min);
        let found = (0..campaigns).filter(|seed| lowest(*seed) <= 0.1).count();
        // 20 +- 4.2
        assert!((8..=33).contains(&found), "{found} of {campaigns}");
    }

    #[test]
    fn what_is_there_in_every_block_is_told_from_chance_and_what_is_not_is_not() {
        let found = chances(1, 0.5);
        assert!(found[0] <= 0.01, "{found:?}");
        assert!(found[1..].iter().all(|p| *p > 0.01), "{found:?}");
    }
}
