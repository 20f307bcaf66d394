//! The references of a log beside its positions, row by row.

use cft_ident_logs::log::{Block, LogError, Reader};

/// A second reading of a log, of the positions that the controller was asked for.
pub struct LoggedReference {
    reader: Reader,
    block: Block,
    row: usize,
    /// The row that holds at the time asked for.
    latest: Vec<f64>,
    wide: Block,
}

impl LoggedReference {
    pub fn new(reader: Reader) -> Self {
        LoggedReference {
            reader,
            block: Block::default(),
            row: 0,
            latest: Vec::new(),
            wide: Block::default(),
        }
    }

    /// Puts the reference beside the positions of a block, and torques of 0 beside the torques.
    pub fn widen(&mut self, block: &mut Block) -> Result<(), LogError> {
        let n = block.joints();
        self.wide.clear();
        for k in 0..block.len() {
            self.advance(block.t[k])?;
            let here = k * n..(k + 1) * n;
            self.wide.q.extend_from_slice(&block.q[here.clone()]);
            self.wide.q.extend_from_slice(&self.latest);
            self.wide.tau.extend_from_slice(&block.tau[here]);
            self.wide.tau.extend(std::iter::repeat_n(0.0, n));
        }
        std::mem::swap(&mut block.q, &mut self.wide.q);
        std::mem::swap(&mut block.tau, &mut self.wide.tau);
        block.dq.clear();
        Ok(())
    }

    /// Goes on to the last row that is not after t; the first row before that.
    fn advance(&mut self, t: f64) -> Result<(), LogError> {
        loop {
            if self.row == self.block.len() {
                self.block.clear();
                self.row = 0;
                if !self.reader.read(&mut self.block)? && self.block.is_empty() {
                    return Ok(());
                }
                continue;
            }
            if self.block.t[self.row] > t && !self.latest.is_empty() {
                return Ok(());
            }
            let n = self.block.joints();
            self.latest.clear();
            let here = self.row * n..(self.row + 1) * n;
            self.latest.extend_from_slice(&self.block.q[here]);
            self.row += 1;
        }
    }
}
