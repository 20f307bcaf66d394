//! Scores of short blocks of a log: what deviations need of it beside the R factor of all its rows.
//!
//! The long-run covariance of a fit takes the score X'(t - X theta) of every short block. An R factor for each gives it
//! at any theta, and takes far more room than the score does. A log that is kept or sent keeps one R factor,
//! and the scores of its blocks at theta_0, the weighted fit of that log alone; at the theta of another fit
//!
//!   g_k(theta) = s (g_k(theta_0) - (n_k / n) g(theta_0)) + (n_k / n) g(theta),
//!
//! where g is the score of the whole log and s the ratio of the log's residual at theta to that at theta_0, joint by
//! joint. It is exact in the sum over the log and at theta_0: what another fit moves is taken as spread evenly over the
//! log's rows, and what it leaves as correlated like the rest. Scores are whole numbers of steps, 32767 to
//! the largest of each unknown: far finer than a covariance can determine, and a quarter of the room.

use nalgebra::{DMatrix, DVector};

/// Score of one block of time.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockScore {
    /// Uninterrupted stretch that the block belongs to.
    pub stretch: usize,
    /// Instants.
    pub rows: u64,
    /// X'(t - X theta_0) of each joint, its own unknowns.
    pub of_joint: Vec<DVector<f64>>,
}

/// Scores of the blocks of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockScores {
    /// theta_0: each joint's own unknowns.
    pub at: Vec<DVector<f64>>,
    /// Step of the scores of each; 0 where all of them are.
    pub step: Vec<DVector<f64>>,
    /// In order of time.
    pub blocks: Vec<BlockScore>,
}

impl BlockScores {
    /// Scores of joint j at theta, its own unknowns; `x` and `t` are the columns of its R factor and the target.
    pub fn at_theta(
        &self,
        j: usize,
        (x, t): (&DMatrix<f64>, &DVector<f64>),
        theta: &DVector<f64>,
    ) -> impl Iterator<Item = DVector<f64>> + '_ {
        let all = self.blocks.iter().map(|b| b.rows as f64).sum::<f64>();
        let [left, left_alone] = [theta, &self.at[j]].map(|theta| t - x * theta);
        let grown = match left_alone.norm() {
            0.0 => 1.0,
            alone => left.norm() / alone,
        };
        let own = self.blocks.iter().map(|b| &b.of_joint[j]);
        let sum = own.fold(DVector::zeros(theta.len()), |sum, g| sum + g);
        let evenly = x.tr_mul(&left) - sum * grown;
        self.blocks
            .iter()
            .map(move |b| &b.of_joint[j] * grown + &evenly * (b.rows as f64 / all.max(1.0)))
    }

    /// Merges neighbours, as few as leave at most `most` blocks, and returns how many became one. Those of two stretches
    /// merge only where there are more stretches than that.
    pub fn in_groups(&mut self, most: usize) -> usize {
        let stretches: Vec<usize> = self
            .blocks
            .chunk_by(|a, b| a.stretch == b.stretch)
            .map(<[BlockScore]>::len)
            .collect();
        let least = self.blocks.len().div_ceil(most.max(1)).max(1);
        let left = |many: usize| stretches.iter().map(|n| n.div_ceil(many)).sum::<usize>();
        let longest = stretches.iter().copied().max().unwrap_or(1);
        let within = (least..=longest.max(least)).find(|many| left(*many) <= most);
        let many = within.unwrap_or(least);
        let mut merged: Vec<BlockScore> = Vec::new();
        let mut open = 0;
        for block in std::mem::take(&mut self.blocks) {
            match merged.last_mut() {
                Some(last)
                    if open < many && (within.is_none() || last.stretch == block.stretch) =>
                {
                    for (a, b) in last.of_joint.iter_mut().zip(&block.of_joint) {
                        *a += b;
                    }
                    last.rows += block.rows;
                    open += 1;
                }
                _ => {
                    merged.push(block);
                    open = 1;
                }
            }
        }
        self.blocks = merged;
        many
    }

    /// The same as whole numbers of steps.
    pub fn rounded(mut self) -> Self {
        self.step = self.at.iter().map(|at| DVector::zeros(at.len())).collect();
        for block in &self.blocks {
            for (step, scores) in self.step.iter_mut().zip(&block.of_joint) {
                let sizes = scores.map(|x| x.abs() / f64::from(i16::MAX));
                *step = step.sup(&sizes);
            }
        }
        for block in &mut self.blocks {
            for (scores, step) in block.of_joint.iter_mut().zip(&self.step) {
                scores.zip_apply(step, |x, step| *x = steps(*x, step) * step);
            }
        }
        self
    }

    /// Numbers that are kept of each block.
    pub fn kept(&self) -> u64 {
        let held = |j: usize, c: usize| self.blocks.iter().any(|b| b.of_joint[j][c] != 0.0);
        let of = |(j, at): (usize, &DVector<f64>)| (0..at.len()).filter(|c| held(j, *c)).count();
        self.at.iter().enumerate().map(of).sum::<usize>() as u64
    }
}

/// A score in steps.
pub fn steps(score: f64, step: f64) -> f64 {
    match step > 0.0 {
        true => (score / step).round(),
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(stretches: &[usize]) -> BlockScores {
        let block = |(k, stretch): (usize, &usize)| BlockScore {
            stretch: *stretch,
            rows: 3,
            of_joint: vec![DVector::from_element(1, k as f64)],
        };
        BlockScores {
            at: vec![DVector::zeros(1)],
            step: vec![DVector::zeros(1)],
            blocks: stretches.iter().enumerate().map(block).collect(),
        }
    }

    #[test]
    fn as_few_neighbours_merge_as_must_and_of_one_stretch_where_they_can() {
        let mut one = scores(&[0; 10]);
        assert_eq!(one.in_groups(4), 3);
        let sums: Vec<f64> = one.blocks.iter().map(|b| b.of_joint[0][0]).collect();
        assert_eq!(sums, [3.0, 12.0, 21.0, 9.0]);
        assert_eq!(one.blocks[3].rows, 3);
        let mut two = scores(&[0, 0, 0, 0, 0, 1, 1, 1]);
        assert_eq!(two.in_groups(3), 3);
        let of: Vec<(usize, u64)> = two.blocks.iter().map(|b| (b.stretch, b.rows)).collect();
        assert_eq!(of, [(0, 9), (0, 6), (1, 9)]);
        let mut many = scores(&[0, 1, 2, 3, 4, 5]);
        assert_eq!(many.in_groups(2), 3);
        assert_eq!(many.blocks.len(), 2);
        let mut few = scores(&[0, 1]);
        assert_eq!(few.in_groups(32), 1);
        assert_eq!(few.blocks.len(), 2);
    }

    #[test]
    fn scores_at_another_theta_sum_up_to_those_of_all_rows() {
        let x = DMatrix::from_row_slice(3, 2, &[2.0, 0.5, 0.0, 1.5, 1.0, -1.0]);
        let t = DVector::from_vec(vec![1.0, 2.0, -0.5]);
        let block = |row: usize| BlockScore {
            stretch: 0,
            rows: 1,
            of_joint: vec![x.row(row).transpose() * t[row]],
        };
        let scores = BlockScores {
            at: vec![DVector::zeros(2)],
            step: vec![DVector::zeros(2)],
            blocks: (0..3).map(block).collect(),
        };
        let theta = DVector::from_vec(vec![0.3, -0.7]);
        let sum = scores
            .at_theta(0, (&x, &t), &theta)
            .fold(DVector::zeros(2), |a, b| a + b);
        let whole = x.tr_mul(&(&t - &x * &theta));
        assert!((sum - whole).norm() < 1e-14);
        let again = scores.at_theta(0, (&x, &t), &scores.at[0]);
        for (g, block) in again.zip(&scores.blocks) {
            assert!((g - &block.of_joint[0]).norm() < 1e-14);
        }
    }

    #[test]
    fn rounding_keeps_a_score_to_half_a_step_and_again_changes_nothing() {
        let rough = scores(&[0; 7]);
        let fine = rough.clone().rounded();
        let step = 6.0 / 32767.0;
        assert_eq!(fine.step[0][0], step);
        for (a, b) in rough.blocks.iter().zip(&fine.blocks) {
            assert!((a.of_joint[0][0] - b.of_joint[0][0]).abs() <= 0.5 * step);
        }
        assert_eq!(fine.clone().rounded(), fine);
        assert_eq!(fine.kept(), 1);
    }
}
