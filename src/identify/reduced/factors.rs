//! Block factors as they lie in a file: numbers apart from the columns, which the robot gives.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::error::ReducedError;
use super::matrix;
use crate::inertia::accumulate::{BlockFactor, BlockFactors, JointRows};
use crate::inertia::columns::RegressorColumns;

/// What a reading of a log holds besides its matrices.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Head {
    block_seconds: f64,
    rows: u64,
    moving: Vec<JointRows>,
    resting: Vec<JointRows>,
    /// Stretch and rows of each block.
    blocks: Vec<(usize, u64)>,
    /// Whether the rows at rest are there.
    at_rest: bool,
}

/// A reading of a log.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Factors {
    head: Head,
    /// Per block and joint, then those at rest.
    matrices: Vec<DMatrix<f64>>,
}

impl Factors {
    pub(super) fn of(factors: BlockFactors, at_rest: bool) -> Self {
        let blocks = factors.blocks.iter();
        let head = Head {
            block_seconds: factors.block_seconds,
            rows: factors.rows,
            blocks: blocks.map(|b| (b.stretch, b.rows)).collect(),
            moving: factors.moving,
            resting: factors.resting,
            at_rest,
        };
        let rest = factors.at_rest.into_iter().filter(|_| at_rest);
        let matrices = factors.blocks.into_iter().flat_map(|b| b.r).chain(rest);
        Factors {
            head,
            matrices: matrices.collect(),
        }
    }

    pub(super) fn blocks(&self) -> usize {
        self.head.blocks.len()
    }

    /// The rows of `columns`, of the log of this name.
    pub(super) fn rows(
        &self,
        log: &str,
        columns: RegressorColumns,
    ) -> Result<BlockFactors, ReducedError> {
        let n = columns.joints;
        let width = |k: usize| columns.row_width(k % n);
        let fits = |(k, m): (usize, &DMatrix<f64>)| m.ncols() == width(k) && m.nrows() <= width(k);
        let expected = n * (self.head.blocks.len() + usize::from(self.head.at_rest));
        let whole = self.matrices.len() == expected
            && self.head.moving.len() == n
            && self.head.resting.len() == n
            && self.head.block_seconds > 0.0
            && self.matrices.iter().enumerate().all(fits);
        if !whole {
            return Err(ReducedError::Content {
                file: log.to_owned(),
                problem: "the reduced log does not have the columns of this robot".to_owned(),
            });
        }
        let mut joints = self.matrices.chunks(n);
        let blocks = self.head.blocks.iter().zip(&mut joints);
        let blocks = blocks.map(|((stretch, rows), r)| BlockFactor {
            stretch: *stretch,
            rows: *rows,
            r: r.to_vec(),
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
            block_seconds: self.head.block_seconds,
            moving: self.head.moving.clone(),
            resting: self.head.resting.clone(),
            at_rest,
            rows: self.head.rows,
        })
    }

    pub(super) fn head(&self) -> &Head {
        &self.head
    }

    pub(super) fn write(&self, out: &mut Vec<u8>) {
        self.matrices.iter().for_each(|m| matrix::write(out, m));
    }

    /// Takes the matrices of a reading of `joints` joints from the front of `bytes`.
    pub(super) fn read(head: Head, joints: usize, bytes: &mut &[u8]) -> Option<Self> {
        let blocks = head.blocks.len() + usize::from(head.at_rest);
        // a matrix takes four bytes at least
        let count = blocks.checked_mul(joints)?;
        if count > bytes.len() / 4 {
            return None;
        }
        let matrices = (0..count).map(|_| matrix::read(bytes));
        let matrices = matrices.collect::<Option<Vec<_>>>()?;
        Some(Factors { head, matrices })
    }
}
