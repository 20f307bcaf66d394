//! Torques that are equal to the last digit in logs of other motions: a program played them, and nothing measured them.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use crate::input::control::Control;
use crate::input::error::IdentifyError;
use crate::input::log_data::LogData;
use crate::note::{FitNote, StageNote};
use cft_ident_logs::log::{Block, escape};

/// Rows in a row whose torques are compared: by chance no so many are equal whose torques change.
const IN_A_ROW: usize = 16;
/// Steps among them in which torques change, at least: a held torque is equal in any two logs.
const CHANGES: usize = 12;
/// Rows of a log that are looked at.
const ROWS: usize = 20_000;

/// Torques of a log by the rows in a row, and its positions.
struct PlayedTorques {
    /// Hash of the torques of each row.
    rows: Vec<u64>,
    q: Vec<Vec<u64>>,
}

impl PlayedTorques {
    fn read(log: &LogData, control: &Control) -> Result<Self, IdentifyError> {
        let (mut rows, mut q) = (Vec::new(), Vec::new());
        let mut blocks = log.held_blocks(control)?;
        let mut block = Block::default();
        while rows.len() < ROWS && blocks.read(&mut block)? {
            let n = block.joints();
            for (tau, position) in block.tau.chunks_exact(n).zip(block.q.chunks_exact(n)) {
                let mut hash = DefaultHasher::new();
                tau.iter().for_each(|x| x.to_bits().hash(&mut hash));
                rows.push(hash.finish());
                q.push(position.iter().map(|x| x.to_bits()).collect());
            }
        }
        Ok(Self { rows, q })
    }

    /// Each stretch of rows whose torques change, with its first row.
    fn stretches(&self) -> impl Iterator<Item = (usize, &[u64])> {
        let changing =
            |rows: &&[u64]| rows.windows(2).filter(|pair| pair[0] != pair[1]).count() >= CHANGES;
        let all = self.rows.windows(IN_A_ROW).enumerate();
        all.filter(move |(_, rows)| changing(rows))
    }
}

/// Logs of other motions whose torques are equal for the most part, one note each pair.
pub(crate) fn replayed(
    logs: &[LogData],
    control: &Control,
) -> Result<Vec<StageNote>, IdentifyError> {
    if logs.len() < 2 {
        return Ok(Vec::new());
    }
    let mut read: Vec<PlayedTorques> = Vec::with_capacity(logs.len());
    let mut out = Vec::new();
    for (k, log) in logs.iter().enumerate() {
        let own = PlayedTorques::read(log, control)?;
        let known: HashMap<&[u64], usize> = own.stretches().map(|(row, of)| (of, row)).collect();
        let same = |other: &PlayedTorques| {
            let all = other.stretches();
            let (mut count, mut equal, mut elsewhere) = (0_usize, 0_usize, 0_usize);
            for (row, of) in all {
                count += 1;
                if let Some(at) = known.get(of) {
                    equal += 1;
                    elsewhere += usize::from(own.q[*at] != other.q[row]);
                }
            }
            2 * equal > count && 2 * elsewhere > equal
        };
        if let Some(first) = read.iter().position(same) {
            out.push(StageNote::Fit(FitNote::ReplayedTorque {
                logs: [first, k].map(|log| escape(&logs[log].name())),
            }));
        }
        read.push(own);
    }
    Ok(out)
}
