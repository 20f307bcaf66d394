//! A log in as little room as a fit and its deviations need, by a rule that sees this log alone.

use nalgebra::{DMatrix, DVector};

use super::accumulate::{BlockFactor, BlockFactors};
use super::scores::{BlockScore, BlockScores};
use super::solve::{RowWeighting, fit};

/// Bytes of a value in a text log, with what parts it from the next: six digits, a sign, a point and a comma.
const TEXT_BYTES: u64 = 10;
/// Bytes that a file takes besides, and for each joint.
const HEAD_BYTES: u64 = 2048;

impl BlockFactors {
    /// The factors of one log of `samples` rows as one R factor and the scores of its blocks at its own weighted fit: of
    /// so few blocks that they and its factors by `others` more processings take less than half of what the log takes
    /// as text. As many neighbours merge as must, of one stretch or, where stretches are too many, of several. A
    /// log that is too short for a fit of its own is one block.
    pub fn condensed(mut self, samples: u64, others: u64) -> BlockFactors {
        let Ok(own) = fit(&self, RowWeighting::Wls) else {
            return self.in_one_block();
        };
        let n = self.columns.joints;
        let at: Vec<DVector<f64>> = (0..n).map(|j| self.own_unknowns(&own.theta, j)).collect();
        let score = |b: &BlockFactor| BlockScore {
            stretch: b.stretch,
            rows: b.rows,
            of_joint: (0..n)
                .map(|j| self.parts(&b.r[j], j).score(&at[j]))
                .collect(),
        };
        let blocks = self.blocks.iter().map(score).collect();
        let step = Vec::new();
        let mut scores = BlockScores { at, step, blocks };
        let r: Vec<DMatrix<f64>> = (0..n).map(|j| self.joint(j)).collect();
        let bytes = |factors: &[DMatrix<f64>]| -> u64 {
            let numbers = factors.iter().flat_map(DMatrix::iter);
            8 * numbers.filter(|x| **x != 0.0).count() as u64
        };
        let of_text = samples * (1 + 2 * n as u64) * TEXT_BYTES;
        let head = HEAD_BYTES * (1 + n as u64) + bytes(&self.at_rest);
        let room = (of_text / 2).saturating_sub((1 + others) * bytes(&r) + head);
        // theta_0 and the steps beside the scores
        let kept = scores.kept();
        let fit_in = room.saturating_sub(16 * kept) / (2 * kept).max(1);
        let most = usize::try_from(fit_in.max(1)).unwrap_or(usize::MAX);
        let many = scores.in_groups(most);
        self.block_seconds *= many as f64;
        self.blocks = vec![BlockFactor {
            stretch: self.blocks.last().map_or(0, |b| b.stretch),
            rows: self.blocks.iter().map(|b| b.rows).sum(),
            r,
            scores: Some(scores.rounded()),
            ..BlockFactor::default()
        }];
        self
    }
}
