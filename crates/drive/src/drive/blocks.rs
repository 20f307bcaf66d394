//! How logs are cut into blocks that the jackknife leaves out.

use std::collections::BTreeSet;

use super::fit::LogPiece;
use super::judge::NUMBERS;
use super::track::DriveLog;

/// What the jackknife leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BlocksAre {
    MotionsAndGains,
    /// Too few of those: equal times of the logs.
    Time,
}

/// Time blocks where motions and gains are too few.
const TIME_BLOCKS: usize = 24;

/// How logs are cut into blocks.
pub(super) fn pieces(logs: &[&DriveLog]) -> (Vec<LogPiece>, usize, BlocksAre) {
    let names: Vec<_> = logs.iter().map(|log| log.block()).collect();
    let each: BTreeSet<_> = names.iter().cloned().collect();
    if each.len() >= NUMBERS.blocks {
        let whole = logs.iter().enumerate().map(|(l, log)| LogPiece {
            log: l,
            from: 0,
            to: log.t.len(),
            block: each.iter().position(|name| *name == names[l]).unwrap_or(0),
        });
        return (whole.collect(), each.len(), BlocksAre::MotionsAndGains);
    }
    let total: usize = logs.iter().map(|log| log.t.len()).sum();
    let long = total.div_ceil(TIME_BLOCKS);
    let (mut out, mut block, mut room) = (Vec::new(), 0, long);
    for (l, log) in logs.iter().enumerate() {
        let mut from = 0;
        while from < log.t.len() {
            let to = (from + room).min(log.t.len());
            out.push(LogPiece {
                log: l,
                from,
                to,
                block,
            });
            room -= to - from;
            if room == 0 {
                (block, room) = (block + 1, long);
            }
            from = to;
        }
    }
    let blocks = if room == long { block } else { block + 1 };
    (out, blocks, BlocksAre::Time)
}
