//! What a candidate's coefficients are pulled by, block by block, and how sure that is.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::blocks::Blocks;
use super::processing::taken;
use crate::diagnose::problem::cross_products::CrossProducts;
use crate::math::rank_revealing::RankRevealingInverse;

/// Least part of the evidence for a candidate that must be the other blocks'.
const LEAST_OTHERS: f64 = 0.1;
/// Least degrees of freedom of the scores' covariance.
const LEAST_FREEDOM: f64 = 2.0;

/// A candidate of one shape beside everything that is declared, projected off it: with S its own normal matrix, its
/// coefficients are S^-1 times the sum of the blocks' scores.
#[derive(Debug, Clone)]
pub struct BlockScores {
    /// Columns with a part of their own, of all that it has.
    kept: Vec<usize>,
    /// Score of each block.
    scores: Vec<DVector<f64>>,
    /// Each block's part of S.
    own: Vec<DMatrix<f64>>,
    /// What a block's score is larger by than what the fit leaves of it, for the fit takes part of its noise for
    /// itself (CR3; Bell and McCaffrey 2002).
    enlarged: Vec<f64>,
    /// Blocks that count, those in which little happens for less: what the scores' covariance is known from.
    counted: f64,
    /// S^-1.
    inverse: DMatrix<f64>,
    /// What the prior adds to the scores' covariance.
    prior: DMatrix<f64>,
    /// Sum of the scores of the log itself.
    right: DVector<f64>,
    /// Those of each draw, one column each.
    draws: DMatrix<f64>,
}

impl BlockScores {
    /// Of a candidate's sums over each block. `projection` is A^-1 X'WC; only the columns in `kept`, those with a part of their own,
    /// are tested.
    pub(crate) fn of(
        blocks: &Blocks,
        sums: &[CrossProducts],
        projection: &DMatrix<f64>,
        (own, right): (&DMatrix<f64>, &DVector<f64>),
        kept: &[usize],
    ) -> Self {
        let projection = projection.select_columns(kept);
        let mut scores = Vec::with_capacity(sums.len());
        let mut of_blocks = Vec::with_capacity(sums.len());
        for (of_candidate, declared) in sums.iter().zip(&blocks.sums) {
            let with_base = of_candidate.with_base.select_columns(kept);
            let score = of_candidate.score.select_rows(kept);
            scores.push(score - projection.tr_mul(&declared.score));
            let crossed = projection.tr_mul(&with_base);
            let taken = projection.tr_mul(&(&declared.normal * &projection));
            let own = of_candidate.own.select_rows(kept).select_columns(kept);
            of_blocks.push(own - &crossed - crossed.transpose() + taken);
        }
        // the draws' own pull on the declared parameters holds that of the prior
        let mut draws = -projection.tr_mul(&blocks.pulls);
        for (signs, mut draw) in blocks.signs.of_draws.iter().zip(draws.column_iter_mut()) {
            for (sign, of_candidate) in signs.iter().zip(sums) {
                for (x, i) in draw.iter_mut().zip(kept) {
                    *x += sign * of_candidate.score[*i];
                }
            }
        }
        let own = own.select_rows(kept).select_columns(kept);
        let inverse = RankRevealingInverse::of(&own).matrix().clone();
        let share = |own: &DMatrix<f64>| own.component_mul(&inverse).sum().clamp(0.0, 1.0);
        let shares: Vec<f64> = of_blocks.iter().map(share).collect();
        let squares: f64 = shares.iter().map(|s| s * s).sum();
        BlockScores {
            kept: kept.to_vec(),
            scores,
            own: of_blocks,
            enlarged: shares
                .iter()
                .map(|s| 1.0 / (1.0 - s).max(LEAST_OTHERS))
                .collect(),
            counted: shares.iter().sum::<f64>().powi(2) / squares.max(f64::MIN_POSITIVE),
            inverse,
            prior: projection.tr_mul(&(&blocks.prior * &projection)),
            right: right.select_rows(kept),
            draws,
        }
    }

    /// Chance of a test value as large as that of the log itself, by the F distribution with what the blocks tell of
    /// the scores' covariance.
    pub fn p_value(&self) -> f64 {
        self.p_value_of(&self.right, &self.right, None)
    }

    /// The same of what is left of it where processing alone pulls the candidate by `artefact`, all its columns.
    pub fn p_value_beyond(&self, artefact: &DVector<f64>) -> f64 {
        let own = artefact.select_rows(&self.kept);
        let like = |a: &DVector<f64>, b: &DVector<f64>| a.dot(&(&self.inverse * b));
        self.p_value_of(&taken(&self.right, &own, like), &self.right, None)
    }

    /// The same of a draw.
    pub fn p_value_of_draw(&self, draw: usize, signs: &[f64]) -> f64 {
        {
            let right = self.draws.column(draw).into_owned();
            self.p_value_of(&right, &right, Some(signs))
        }
    }

    /// What a draw removes of the weighted squares.
    pub fn gain_of_draw(&self, draw: usize) -> f64 {
        let right = self.draws.column(draw);
        (right.transpose() * &self.inverse * right)[(0, 0)]
    }

    /// Chance of `tested`, a part of what pulls the candidate in the log or in a draw.
    fn p_value_of(&self, tested: &DVector<f64>, all: &DVector<f64>, signs: Option<&[f64]>) -> f64 {
        let found = &self.inverse * all;
        let mut covariance = self.prior.clone();
        for (block, (score, own)) in self.scores.iter().zip(&self.own).enumerate() {
            let sign = signs.map_or(1.0, |s| s[block]);
            let left = (score * sign - own * &found) * self.enlarged[block];
            covariance.ger(1.0, &left, &left, 1.0);
        }
        let count = tested.len() as f64;
        let wald = tested.dot(&RankRevealingInverse::of(&covariance).solve(tested)) / count;
        let freedom = (self.counted - count).max(LEAST_FREEDOM);
        match FisherSnedecor::new(count, freedom) {
            Ok(f) if wald.is_finite() && wald > 0.0 => f.sf(wald),
            _ => 1.0,
        }
    }
}
