//! Block factors as they lie in a file: numbers apart from the columns, which the robot gives.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::error::ReducedError;
use super::matrix;
use cft_ident_core::inertia::accumulate::{BlockFactor, BlockFactors, JointRows};
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::inertia::scores::{self, BlockScore, BlockScores};

/// What a reading of a log holds besides its matrices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReducedHead {
    block_seconds: f64,
    rows: u64,
    moving: Vec<JointRows>,
    resting: Vec<JointRows>,
    /// Stretch and rows of each block.
    blocks: Vec<(usize, u64)>,
    /// Whether the rows at rest are there.
    at_rest: bool,
    /// Stretch and rows of each block whose scores are there.
    scores: Vec<(usize, u64)>,
}

/// Most rows and stretches that a log can have: their sums over logs stay whole numbers.
const MOST_ROWS: u64 = 1 << 40;

impl ReducedHead {
    fn counts_are_possible(&self) -> bool {
        let mut blocks = self.blocks.iter().chain(&self.scores);
        let mut joints = self.moving.iter().chain(&self.resting);
        self.rows <= MOST_ROWS
            && blocks.all(|(stretch, rows)| *stretch as u64 <= MOST_ROWS && *rows <= MOST_ROWS)
            && joints.all(|rows| rows.count <= MOST_ROWS)
    }

    /// Scores from theta_0 and the steps of each joint, and the scores in these.
    fn scores_of(&self, joints: &[DMatrix<f64>], steps: &[i16]) -> BlockScores {
        let row = |k: usize| joints.iter().map(|m| m.row(k).transpose()).collect();
        let step: Vec<DVector<f64>> = row(1);
        let mut steps = steps.iter();
        let mut of_joint = |step: &DVector<f64>| {
            step.map(|step| match step > 0.0 {
                true => f64::from(*steps.next().unwrap_or(&0)) * step,
                false => 0.0,
            })
        };
        let blocks = self.scores.iter();
        let blocks = blocks.map(|(stretch, rows)| BlockScore {
            stretch: *stretch,
            rows: *rows,
            of_joint: step.iter().map(&mut of_joint).collect(),
        });
        BlockScores {
            blocks: blocks.collect(),
            at: row(0),
            step,
        }
    }
}

/// A reading of a log.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReducedFactors {
    head: ReducedHead,
    /// Per block and joint, then those at rest, then of each joint theta_0 and the steps of its scores as rows.
    matrices: Vec<DMatrix<f64>>,
    /// Scores in steps: by block, joint and unknown, but for those whose step is 0.
    steps: Vec<i16>,
}

impl ReducedFactors {
    pub(super) fn of(factors: BlockFactors, at_rest: bool) -> Self {
        let scores = factors.blocks.iter().find_map(|b| b.scores.clone());
        let shown = scores.iter().flat_map(|s| &s.blocks);
        let blocks = factors.blocks.iter();
        let head = ReducedHead {
            block_seconds: factors.block_seconds,
            rows: factors.rows,
            blocks: blocks.map(|b| (b.stretch, b.rows)).collect(),
            moving: factors.moving,
            resting: factors.resting,
            at_rest,
            scores: shown.map(|b| (b.stretch, b.rows)).collect(),
        };
        let rest = factors.at_rest.into_iter().filter(|_| at_rest);
        let matrices = factors.blocks.into_iter().flat_map(|b| b.r).chain(rest);
        let about = scores.iter().flat_map(|s| {
            let joints = s.at.iter().zip(&s.step);
            joints.map(|(at, step)| DMatrix::from_rows(&[at.transpose(), step.transpose()]))
        });
        let of_block = |s: &BlockScores, b: &BlockScore| -> Vec<i16> {
            let joints = b.of_joint.iter().zip(&s.step);
            let pairs = joints.flat_map(|(scores, step)| scores.iter().zip(step.iter()));
            let kept = pairs.filter(|(_, step)| **step > 0.0);
            kept.map(|(score, step)| scores::steps(*score, *step) as i16)
                .collect()
        };
        ReducedFactors {
            head,
            matrices: matrices.chain(about).collect(),
            steps: (scores.iter())
                .flat_map(|s| s.blocks.iter().flat_map(|b| of_block(s, b)))
                .collect(),
        }
    }

    /// Blocks of time from which deviations come.
    pub(super) fn blocks(&self) -> usize {
        self.head.scores.len().max(self.head.blocks.len())
    }

    /// Columns of the first joint's rows.
    pub(super) fn width(&self) -> usize {
        self.matrices.first().map_or(0, DMatrix::ncols)
    }

    /// The rows of `columns`, of the log of this name.
    pub(super) fn rows(
        &self,
        log: &str,
        columns: RegressorColumns,
    ) -> Result<BlockFactors, ReducedError> {
        let n = columns.joints;
        let head = &self.head;
        let factors = n * (head.blocks.len() + usize::from(head.at_rest));
        let of_scores = if head.scores.is_empty() { 0 } else { n };
        let fits = |(k, m): (usize, &DMatrix<f64>)| match k < factors {
            true => m.ncols() == columns.row_width(k % n) && m.nrows() <= m.ncols(),
            false => m.ncols() == columns.unknowns_of(k % n) && m.nrows() == 2,
        };
        let whole = self.matrices.len() == factors + of_scores
            && (of_scores == 0 || head.blocks.len() == 1)
            && head.moving.len() == n
            && head.resting.len() == n
            && head.block_seconds > 0.0
            && head.counts_are_possible()
            && self.matrices.iter().enumerate().all(fits);
        if !whole {
            return Err(ReducedError::Content {
                file: log.to_owned(),
                problem: "the reduced log does not have the columns of this robot".to_owned(),
            });
        }
        let (factors, scores) = self.matrices.split_at(factors);
        let scores = (of_scores > 0).then(|| head.scores_of(scores, &self.steps));
        let mut joints = factors.chunks(n);
        let blocks = head.blocks.iter().zip(&mut joints);
        let blocks = blocks.map(|((stretch, rows), r)| BlockFactor {
            stretch: *stretch,
            rows: *rows,
            r: r.to_vec(),
            scores: scores.clone(),
            ..BlockFactor::default()
        });
        let blocks = blocks.collect();
        let at_rest = match joints.next() {
            Some(rest) => rest.to_vec(),
            None => (0..n)
                .map(|j| DMatrix::zeros(columns.row_width(j), columns.row_width(j)))
                .collect(),
        };
        Ok(BlockFactors {
            columns,
            blocks,
            block_seconds: head.block_seconds,
            moving: head.moving.clone(),
            resting: head.resting.clone(),
            at_rest,
            by_speed: Vec::new(),
            rows: head.rows,
        })
    }

    pub(super) fn head(&self) -> &ReducedHead {
        &self.head
    }

    pub(super) fn write(&self, out: &mut Vec<u8>) {
        self.matrices.iter().for_each(|m| matrix::write(out, m));
        out.extend(self.steps.iter().flat_map(|x| x.to_le_bytes()));
    }

    /// Takes the matrices of a reading of `joints` joints from the front of `bytes`.
    pub(super) fn read(head: ReducedHead, joints: usize, bytes: &mut &[u8]) -> Option<Self> {
        let scores = usize::from(!head.scores.is_empty());
        let blocks = head.blocks.len() + usize::from(head.at_rest) + scores;
        // a matrix takes four bytes at least
        let count = blocks.checked_mul(joints)?;
        if count > bytes.len() / 4 {
            return None;
        }
        let matrices = (0..count).map(|_| matrix::read(bytes));
        let matrices = matrices.collect::<Option<Vec<_>>>()?;
        let of_scores = matrices.len() - joints * scores;
        let about = matrices[of_scores..].iter().filter(|m| m.nrows() == 2);
        let kept: usize = about
            .map(|m| m.row(1).iter().filter(|step| **step > 0.0).count())
            .sum();
        let many = kept.checked_mul(2)?.checked_mul(head.scores.len())?;
        let (steps, rest) = bytes.split_at_checked(many)?;
        *bytes = rest;
        let steps = steps
            .chunks_exact(2)
            .map(|x| i16::from_le_bytes([x[0], x[1]]));
        Some(ReducedFactors {
            steps: steps.collect(),
            head,
            matrices,
        })
    }
}
