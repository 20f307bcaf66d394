//! A log that is being read for a fit: rows that are marked bad left out, torques at their rows' time.

use std::sync::Arc;

use super::control::Control;
use super::error::IdentifyError;
use crate::note::{LogNote, RowLoss, StageNote};
use cft_ident_core::motion::{MotionError, RunError, Stretch, Summary};
use cft_ident_logs::log::{Block, Instant, Layout, LogError, Provenance, Reader, escape};
use cft_ident_logs::recording::{Recording, RowBlocks};

/// A velocity column is off by more than filters and steps make of it.
const VELOCITY_SCALE_TOLERANCE: f64 = 0.1;

/// A log that is being read.
pub struct OpenLog<'a> {
    blocks: RowBlocks,
    control: &'a Control,
    name: String,
    recording: Arc<Recording>,
}

impl<'a> OpenLog<'a> {
    pub(crate) fn new(
        name: &str,
        recording: &Arc<Recording>,
        blocks: RowBlocks,
        control: &'a Control,
    ) -> Self {
        OpenLog {
            blocks,
            control,
            name: escape(name),
            recording: Arc::clone(recording),
        }
    }

    fn reader(&self) -> &Reader {
        self.blocks.reader()
    }

    /// The next block, without the rows that are marked bad; false at the end.
    pub fn read(&mut self, block: &mut Block) -> Result<bool, LogError> {
        loop {
            if self.control.stopped() {
                return Err(LogError::Interrupted);
            }
            let more = self.blocks.read(block)?;
            if !more || !block.is_empty() {
                return Ok(more);
            }
        }
    }

    /// Which columns are read.
    pub(crate) fn layout(&self) -> &Layout {
        self.reader().layout()
    }

    /// Counts stretches from where the machine began to run, as far as that is known: a part of a log begins later.
    pub(crate) fn count_run_time(&self, stretches: &mut [Stretch]) {
        for stretch in stretches {
            stretch.began += self.reader().started_s();
        }
    }

    /// The instant from which the times of the blocks are counted.
    pub fn origin(&self) -> Instant {
        self.recording.origin()
    }

    /// What was left out, mended or chosen, once the last block is read: how many rows each cause costs,
    /// the most first, then what and where.
    pub fn notes(&self) -> Vec<StageNote> {
        self.costs_and_places(0)
    }

    /// The same with what the processing left out.
    pub fn notes_with(&self, summary: &Summary) -> Vec<StageNote> {
        let mut out = self.costs_and_places(summary.skipped.samples);
        let processing = of_summary(&self.name, self.origin(), summary);
        out.extend(
            self.velocities()
                .into_iter()
                .chain(processing)
                .map(StageNote::Log),
        );
        out
    }

    /// Velocity columns that are no derivatives of the positions: by one factor where it is the clock.
    fn velocities(&self) -> Option<LogNote> {
        let names = &self.layout().joints;
        let off = |(j, factor): (usize, &Option<f64>)| {
            let factor = factor.filter(|x| (x - 1.0).abs() > VELOCITY_SCALE_TOLERANCE)?;
            Some((names.get(j)?.clone(), factor))
        };
        let off: Vec<(String, f64)> = self
            .recording
            .velocities
            .iter()
            .enumerate()
            .filter_map(off)
            .collect();
        let known = self.recording.velocities.iter().flatten().count();
        let (first, others) = off.split_first()?;
        let alike = |(_, x): &(String, f64)| (x / first.1 - 1.0).abs() < VELOCITY_SCALE_TOLERANCE;
        Some(LogNote::VelocityScale {
            log: self.name.clone(),
            alike: off.len() == known && known > 1 && others.iter().all(alike),
            joints: off,
        })
    }

    fn costs_and_places(&self, too_short: u64) -> Vec<StageNote> {
        let lost = self.rows_lost(too_short).map(StageNote::Log);
        let of_reader = self
            .reader()
            .warnings()
            .into_iter()
            .map(StageNote::OfReader);
        let marked = self
            .recording
            .inspection
            .warnings()
            .into_iter()
            .map(|sentence| {
                StageNote::Log(LogNote::Marked {
                    log: self.name.clone(),
                    sentence,
                })
            });
        lost.into_iter().chain(of_reader).chain(marked).collect()
    }

    /// How many rows each cause costs, the most first; `None` where none is left out or mended.
    fn rows_lost(&self, too_short: u64) -> Option<LogNote> {
        let by_reader = self.reader().left_out();
        let mut losses: Vec<RowLoss> = (self.recording.inspection.costs().iter())
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
        let dropped = dropped + self.reader().not_read();
        Some(LogNote::RowsLost {
            log: self.name.clone(),
            rows: self.reader().samples() + dropped,
            left_out: self.blocks.removed() + dropped + too_short,
            losses,
        })
    }

    /// What ended a run through it, with what was left out where too little remained.
    pub(crate) fn ended(&self, error: RunError<LogError>) -> IdentifyError {
        match error {
            RunError::Source(error) => error.into(),
            RunError::Motion(error) => IdentifyError::Motion {
                of: self.name.clone(),
                left_out: matches!(error, MotionError::NoSegment { .. })
                    .then(|| {
                        let lost = self.rows_lost(0).map(|lost| lost.to_string());
                        lost.or_else(|| self.reader().warnings().pop())
                    })
                    .flatten()
                    .map(String::into_boxed_str),
                error,
            },
        }
    }

    /// Whether torques come from a zero-order hold and so are means of two rows here.
    pub(crate) fn is_centred(&self) -> bool {
        self.blocks.is_centred()
    }

    /// Name, span, checksum and size of what was read.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn provenance(&self) -> Result<Provenance, IdentifyError> {
        Ok(self.reader().provenance()?)
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
