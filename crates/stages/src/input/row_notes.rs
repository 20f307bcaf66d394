//! What a walk along the rows of a log left out, mended or chosen, as notes.

use super::error::IdentifyError;
use super::log_data::LogData;
use crate::note::{LogNote, RowLoss, StageNote};
use cft_ident_core::motion::{MotionError, RunError, Summary};
use cft_ident_logs::log::{Instant, LogError, escape};
use cft_ident_logs::recording::RowBlocks;

/// A velocity column is off by more than filters and steps make of it.
const VELOCITY_SCALE_TOLERANCE: f64 = 0.1;

impl LogData {
    /// What was left out, mended or chosen, once the last block is read: how many rows each cause costs,
    /// the most first, then what and where.
    pub(crate) fn notes(&self, blocks: &RowBlocks) -> Vec<StageNote> {
        self.costs_and_places(blocks, 0)
    }

    /// The same with what the processing left out.
    pub fn notes_with(&self, blocks: &RowBlocks, summary: &Summary) -> Vec<StageNote> {
        let mut out = self.costs_and_places(blocks, summary.skipped.samples);
        let processing = of_summary(&escape(&self.name()), self.recording().origin(), summary);
        out.extend(
            self.velocities(&blocks.reader().layout().joints)
                .into_iter()
                .chain(processing)
                .map(StageNote::Log),
        );
        out
    }

    /// Velocity columns that are no derivatives of the positions: by one factor where it is the clock.
    fn velocities(&self, names: &[String]) -> Option<LogNote> {
        let off = |(j, factor): (usize, &Option<f64>)| {
            let factor = factor.filter(|x| (x - 1.0).abs() > VELOCITY_SCALE_TOLERANCE)?;
            Some((names.get(j)?.clone(), factor))
        };
        let off: Vec<(String, f64)> = self
            .recording()
            .velocities
            .iter()
            .enumerate()
            .filter_map(off)
            .collect();
        let known = self.recording().velocities.iter().flatten().count();
        let (first, others) = off.split_first()?;
        let alike = |(_, x): &(String, f64)| (x / first.1 - 1.0).abs() < VELOCITY_SCALE_TOLERANCE;
        Some(LogNote::VelocityScale {
            log: escape(&self.name()),
            alike: off.len() == known && known > 1 && others.iter().all(alike),
            joints: off,
        })
    }

    fn costs_and_places(&self, blocks: &RowBlocks, too_short: u64) -> Vec<StageNote> {
        let lost = self.rows_lost(blocks, too_short).map(StageNote::Log);
        let of_reader = blocks
            .reader()
            .warnings()
            .into_iter()
            .map(StageNote::OfReader);
        let marked = self
            .recording()
            .inspection
            .warnings()
            .into_iter()
            .map(|sentence| {
                StageNote::Log(LogNote::Marked {
                    log: escape(&self.name()),
                    sentence,
                })
            });
        lost.into_iter().chain(of_reader).chain(marked).collect()
    }

    /// How many rows each cause costs, the most first; `None` where none is left out or mended.
    fn rows_lost(&self, blocks: &RowBlocks, too_short: u64) -> Option<LogNote> {
        let by_reader = blocks.reader().left_out();
        let mut losses: Vec<RowLoss> = (self.recording().inspection.costs().iter())
            .map(|cost| RowLoss::Marked(*cost))
            .chain(by_reader.map(|(rows, kind)| RowLoss::Dropped(rows, kind)))
            .chain([RowLoss::TooShort(too_short)])
            .filter(|loss| loss.rows() > 0)
            .collect();
        losses.sort_by_key(|loss| std::cmp::Reverse(loss.rows()));
        if losses.is_empty() {
            return None;
        }
        let dropped: u64 = by_reader.iter().map(|(rows, _)| rows).sum();
        let dropped = dropped + blocks.reader().not_read();
        Some(LogNote::RowsLost {
            log: escape(&self.name()),
            rows: blocks.reader().samples() + dropped,
            left_out: blocks.removed() + dropped + too_short,
            losses,
        })
    }

    /// Converts what ended a run through its rows; if no stretch is long enough, it names the rows that were left out.
    pub(crate) fn to_stage_error(
        &self,
        blocks: &RowBlocks,
        error: RunError<LogError>,
    ) -> IdentifyError {
        match error {
            RunError::Source(error) => error.into(),
            RunError::Motion(error) => IdentifyError::Motion {
                of: escape(&self.name()),
                left_out: matches!(error, MotionError::NoSegment { .. })
                    .then(|| {
                        let lost = self.rows_lost(blocks, 0).map(|lost| lost.to_string());
                        lost.or_else(|| blocks.reader().warnings().pop())
                    })
                    .flatten()
                    .map(String::into_boxed_str),
                error,
            },
        }
    }
}

/// What the processing left out of a log.
fn of_summary(name: &str, origin: Instant, summary: &Summary) -> Vec<LogNote> {
    let (zero, log) = (origin.seconds(), || name.to_owned());
    let skipped = &summary.skipped;
    let spans = skipped.spans_s.iter();
    let too_short = (skipped.segments > 0).then(|| LogNote::TooShort {
        log: log(),
        stretches: skipped.segments,
        samples: skipped.samples,
        spans: spans.map(|span| span.map(|t| zero + t)).collect(),
    });
    let gaps = (summary.segments > 1).then(|| LogNote::Gaps {
        log: log(),
        stretches: summary.segments,
    });
    let uneven = (summary.interpolated > 0).then(|| LogNote::UnevenClock {
        log: log(),
        samples: summary.samples,
        interpolated: summary.interpolated,
    });
    [too_short, gaps, uneven].into_iter().flatten().collect()
}
