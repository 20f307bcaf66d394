//! Blocks of time that are left out one after the other, and parts of the data that are asked for an amplitude each.

use std::ops::Range;

/// Rows of one log that are fitted.
#[derive(Debug, Clone)]
pub struct LogRows {
    /// Index of the log.
    pub log: usize,
    /// Uninterrupted rows: index of the stretch, and its rows.
    pub pieces: Vec<(usize, Range<usize>)>,
    /// Time from row to row \[s\].
    pub step_s: f64,
    /// Whether each joint moves in it.
    pub moves: Vec<bool>,
    /// Whether each row counts in the length of a block, in order: something moves there.
    pub counts: Vec<bool>,
}

/// Neighbouring rows of one log.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeBlock {
    pub log: usize,
    /// Stretches and their rows.
    pub pieces: Vec<(usize, Range<usize>)>,
    /// The part of the data that it belongs to.
    pub part: usize,
}

/// All blocks, in order of time.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Blocks {
    pub list: Vec<TimeBlock>,
    pub parts: usize,
    /// Least length of a block \[s\].
    pub least_s: f64,
}

impl LogRows {
    /// Rows that count.
    fn rows(&self) -> usize {
        self.counts.iter().filter(|counts| **counts).count()
    }

    fn seconds(&self) -> f64 {
        self.rows() as f64 * self.step_s
    }

    /// From the row that counts as number `from` until that of number `until`; what does not count goes with the row
    /// before it, and what stands before the first with that.
    fn cut(&self, from: usize, until: usize) -> Vec<(usize, Range<usize>)> {
        let mut counted = 0;
        let mut out: Vec<(usize, Range<usize>)> = Vec::new();
        let mut counts = self.counts.iter();
        for (stretch, rows) in &self.pieces {
            let own = rows.clone().filter(|_| {
                counted += usize::from(counts.next().is_some_and(|counts| *counts));
                // the row that counts as number k, and those behind it that do not
                (from..until).contains(&counted.saturating_sub(1))
            });
            let own: Vec<usize> = own.collect();
            if let (Some(first), Some(last)) = (own.first(), own.last()) {
                out.push((*stretch, *first..last + 1));
            }
        }
        out
    }
}

/// Divides logs into parts of equal length within a log, so many that every joint that moves does so in
/// `parts` of them, and each into `per_part` blocks, none of them shorter than `least_s` but where a whole log is.
pub fn divide(logs: &[LogRows], least_s: f64, (parts, per_part): (usize, usize)) -> Blocks {
    let joints = logs.first().map_or(0, |log| log.moves.len());
    let moved = |j: usize| -> f64 {
        let own = logs.iter().filter(|log| log.moves[j]);
        own.map(LogRows::seconds).sum()
    };
    let shortest = (0..joints).map(moved).filter(|s| *s > 0.0);
    let total: f64 = logs.iter().map(LogRows::seconds).sum();
    let length = shortest.fold(total, f64::min) / parts as f64;
    let mut blocks = Blocks {
        least_s,
        ..Blocks::default()
    };
    for log in logs.iter().filter(|log| log.rows() > 0) {
        let seconds = log.seconds();
        let most = (seconds / least_s).floor().max(1.0);
        let parts = (seconds / length - 1e-6).ceil().clamp(1.0, most);
        let within = (most / parts).floor() as usize;
        let within = within.clamp(1, per_part);
        let (rows, count) = (log.rows(), parts as usize * within);
        for k in 0..count {
            let at = |k: usize| k * rows / count;
            blocks.list.push(TimeBlock {
                log: log.log,
                pieces: log.cut(at(k), at(k + 1)),
                part: blocks.parts + k / within,
            });
        }
        blocks.parts += parts as usize;
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(log: usize, seconds: f64, moves: &[bool]) -> LogRows {
        LogRows {
            log,
            pieces: vec![(log, 0..(seconds * 100.0) as usize)],
            step_s: 0.01,
            moves: moves.to_vec(),
            counts: vec![true; (seconds * 100.0) as usize],
        }
    }

    #[test]
    fn two_logs_give_twelve_parts_of_two_blocks_and_no_row_twice() {
        let logs = [log(0, 30.0, &[true]), log(1, 60.0, &[true])];
        let blocks = divide(&logs, 0.5, (12, 2));
        assert_eq!((blocks.parts, blocks.list.len()), (12, 24));
        let rows = |b: &TimeBlock| b.pieces.iter().map(|p| p.1.len()).sum::<usize>();
        assert_eq!(blocks.list.iter().map(rows).sum::<usize>(), 9000);
        assert!(blocks.list.iter().all(|b| rows(b) == 375), "{blocks:?}");
    }

    #[test]
    fn a_joint_that_moves_in_one_log_alone_has_its_parts_there() {
        let logs = [
            log(0, 40.0, &[true, false]),
            log(1, 40.0, &[false, true]),
            log(2, 20.0, &[true, true]),
        ];
        let blocks = divide(&logs, 0.5, (12, 2));
        for j in 0..2 {
            let own = blocks.list.iter().filter(|b| logs[b.log].moves[j]);
            let mut parts: Vec<usize> = own.map(|b| b.part).collect();
            parts.dedup();
            assert!(parts.len() >= 12, "{j}: {parts:?}");
        }
    }

    #[test]
    fn blocks_are_not_shorter_than_asked_where_the_log_is_not() {
        let blocks = divide(&[log(0, 10.0, &[true])], 3.0, (12, 2));
        assert_eq!((blocks.parts, blocks.list.len()), (3, 3));
    }

    #[test]
    fn a_block_may_reach_over_a_gap_of_its_log() {
        let rows = LogRows {
            log: 0,
            pieces: vec![(0, 10..60), (1, 0..50)],
            step_s: 1.0,
            moves: vec![true],
            counts: vec![true; 100],
        };
        assert_eq!(rows.cut(40, 70), [(0, 50..60), (1, 0..20)]);
    }

    #[test]
    fn rows_at_rest_are_no_block_of_their_own() {
        let mut rows = log(0, 60.0, &[true]);
        for k in (0..6000).filter(|k| *k < 500 || *k >= 3000) {
            rows.counts[k] = false;
        }
        let blocks = divide(&[rows], 0.5, (24, 1));
        assert_eq!(blocks.list.len(), 24);
        let first = &blocks.list[0].pieces[0].1;
        let last = &blocks.list[23].pieces[0].1;
        assert_eq!((first.start, last.end), (0, 6000));
        assert_eq!(first.end, 604);
        let all: usize = blocks.list.iter().map(|b| b.pieces[0].1.len()).sum();
        assert_eq!(all, 6000);
    }
}
