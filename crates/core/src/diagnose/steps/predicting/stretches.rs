//! Blocks that are independent of one another: where a motion repeats, the same part of all its periods, and of all logs of
//! it, is one. Left out one period at a time, what a residual repeats would be told by the other periods.

use std::ops::Range;

use crate::diagnose::prepared::PreparedCase;
use crate::diagnose::problem::data_split::LogRole;
use crate::diagnose::unexplained::period::period;
use crate::judge::{LogRows, TimeBlock};

/// Rows of fitted logs that repeat a motion.
struct RepeatedMotion {
    /// Rows of one period.
    rows: usize,
    /// Row of the motion with which each stretch begins, by its index; none of a stretch that is not of it.
    begins: Vec<Option<usize>>,
}

impl PreparedCase<'_> {
    /// The blocks that are fitted, those of repeated motion by its phase.
    pub(super) fn independent_blocks(&self) -> Vec<TimeBlock> {
        let logs = self.data.split.logs(self.case.rows(), LogRole::Train);
        let repeated = self.repeated_motions(&logs);
        if repeated.is_empty() {
            return self.blocks.list.clone();
        }
        let is_repeated = |stretch: usize| {
            let mut all = repeated.iter();
            all.any(|motion| motion.begins[stretch].is_some())
        };
        let own = self.blocks.list.iter();
        let own = own.filter(|block| block.pieces.iter().all(|(s, _)| !is_repeated(*s)));
        let mut out: Vec<TimeBlock> = own.cloned().collect();
        for motion in &repeated {
            out.extend(self.by_phase(motion, &logs));
        }
        out
    }

    /// Motions that the fitted logs repeat: one of all of them, or those of each by itself.
    fn repeated_motions(&self, logs: &[LogRows]) -> Vec<RepeatedMotion> {
        let stretches = |log: &LogRows| {
            let mut own: Vec<usize> = log.pieces.iter().map(|(stretch, _)| *stretch).collect();
            own.dedup();
            own
        };
        let all: Vec<usize> = logs.iter().flat_map(stretches).collect();
        if let Some(motion) = self.repeated_motion(&all) {
            return vec![motion];
        }
        let each = logs.iter().map(stretches);
        each.filter_map(|own| self.repeated_motion(&own)).collect()
    }

    /// The motion that some stretches, one behind the other, repeat.
    fn repeated_motion(&self, stretches: &[usize]) -> Option<RepeatedMotion> {
        let mut begins = vec![None; self.data.stretches.len()];
        let mut positions: Vec<Vec<f64>> = vec![Vec::new(); self.cover.joints.len()];
        for at in stretches {
            begins[*at] = Some(positions.first().map_or(0, Vec::len));
            let stretch = &self.data.stretches[*at];
            let parallel = self.data.filters.of(stretch);
            for (all, own) in positions.iter_mut().zip(&stretch.q) {
                let rows = 0..parallel.rows(stretch.len());
                all.extend(rows.filter_map(|row| own.get(parallel.sample_of(row))));
            }
        }
        let rows = period(&positions)?;
        Some(RepeatedMotion { rows, begins })
    }

    /// Blocks of the same phase of a motion, none of them shorter than a block may be.
    fn by_phase(&self, motion: &RepeatedMotion, logs: &[LogRows]) -> Vec<TimeBlock> {
        let step_s = logs.first().map_or(0.0, |log| log.step_s);
        let most = (motion.rows as f64 * step_s / self.blocks.least_s).floor();
        let count = (most as usize).clamp(1, self.case.numbers.blocks);
        let mut blocks: Vec<TimeBlock> = (0..count)
            .map(|part| TimeBlock {
                log: usize::MAX,
                pieces: Vec::new(),
                part,
            })
            .collect();
        for (stretch, rows) in logs.iter().flat_map(|log| &log.pieces) {
            let Some(begin) = motion.begins[*stretch] else {
                continue;
            };
            let phase = |row: usize| (begin + row) % motion.rows * count / motion.rows;
            for (phase, range) in runs(rows.clone(), &phase) {
                blocks[phase].pieces.push((*stretch, range));
            }
        }
        blocks.retain(|block| !block.pieces.is_empty());
        blocks
    }
}

/// Runs of rows of one phase.
fn runs(rows: Range<usize>, phase: &dyn Fn(usize) -> usize) -> Vec<(usize, Range<usize>)> {
    let mut out: Vec<(usize, Range<usize>)> = Vec::new();
    for row in rows {
        match out.last_mut().filter(|(last, _)| *last == phase(row)) {
            Some((_, range)) => range.end = row + 1,
            None => out.push((phase(row), row..row + 1)),
        }
    }
    out
}
