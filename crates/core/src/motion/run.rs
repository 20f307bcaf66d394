//! The windows of a streamed log.

use std::sync::Arc;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;
use thiserror::Error;

use super::cutter::{SkippedStretches, WindowCutter};
use super::settings::{FilterDesign, FilterSettings};
use super::time_base::TimeBase;
use super::window::FilterWindow;
use super::{FilteredRow, MotionError, MotionSample};
use crate::block::Block;

/// Why a log could not be run through: its source failed, or it cannot be turned into rows.
#[derive(Debug, Error)]
pub enum RunError<E> {
    #[error("{0}")]
    Source(E),
    /// The log cannot be turned into rows.
    #[error(transparent)]
    Motion(#[from] MotionError),
}

/// What was done to a log. A document names its filters.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// Rows of the log.
    #[serde(skip)]
    pub samples: u64,
    /// Rows handed to the sink.
    #[serde(skip)]
    pub rows: u64,
    /// Sampling step (s).
    #[serde(skip)]
    pub dt: f64,
    /// Time from the first to the last row of the log (s).
    #[serde(skip)]
    pub duration_s: f64,
    /// Stretches without a gap that were used.
    #[serde(skip)]
    pub segments: usize,
    /// Stretches too short to filter.
    #[serde(skip)]
    pub skipped: SkippedStretches,
    /// Samples interpolated because no row lay within 2 % of a step from their time.
    #[serde(skip)]
    pub interpolated: u64,
    /// Cut-off of the parallel filter (Hz).
    pub cutoff_hz: f64,
    /// Every how many samples a row was kept.
    pub decimation: usize,
    /// Cut-off of the position filter (Hz), the lowest where each joint has its own; none where raw positions were
    /// differentiated.
    #[serde(rename = "position_cutoff_hz")]
    pub q_cutoff_hz: Option<f64>,
}

/// Runs a log through: reads blocks from `source` until it returns false, computes `channels`
/// numbers per sample with `fill` at full rate, filters them, and hands the rows that are kept to
/// `sink` in order of time.
///
/// `fill` runs on several threads; what it computes must depend on the sample alone. Memory is a
/// few windows of some thousand samples. `rate_hz` replaces the sampling rate found in the log.
///
/// # Errors
/// The source's error; [`MotionError`] for time that does not increase, blocks of another width,
/// filters that the sampling rate does not carry, no stretch long enough, or a computed channel
/// that is not finite. Rows may have been handed out before an error.
pub fn run<E>(
    source: &mut dyn FnMut(&mut Block) -> Result<bool, E>,
    joints: usize,
    settings: &FilterSettings,
    rate_hz: Option<f64>,
    channels: usize,
    fill: &(dyn Fn(&MotionSample<'_>, &mut [f64]) + Sync),
    sink: &mut dyn FnMut(&FilteredRow<'_>),
) -> Result<Summary, RunError<E>> {
    let mut intake = RowIntake::new(joints, settings, rate_hz)?;
    let mut batch: Vec<FilterWindow> = Vec::new();
    let (mut waiting, mut rows, mut more) = (0, 0, true);
    while more || waiting > 0 {
        // The next windows are read while those of the batch are computed.
        let mut outcomes = Vec::new();
        let mut read = Ok(false);
        rayon::in_place_scope(|scope| {
            if let (Some(cutter), 1..) = (&intake.cutter, waiting) {
                let chain = Arc::clone(&cutter.chain);
                let (windows, outcomes) = (&mut batch[..waiting], &mut outcomes);
                scope.spawn(move |_| {
                    windows
                        .par_iter_mut()
                        .map(|window| window.process(&chain, joints, channels, fill))
                        .collect_into_vec(outcomes);
                });
            }
            if more {
                read = intake.read(source);
            }
        });
        for (window, outcome) in batch.iter().zip(outcomes) {
            outcome?;
            for row in window.rows(joints, channels) {
                sink(&row);
                rows += 1;
            }
        }
        more = read?;
        waiting = intake.swap(&mut batch);
    }
    Ok(intake.summary(rows)?)
}

/// What is between the source and the windows.
struct RowIntake<'a> {
    settings: &'a FilterSettings,
    joints: usize,
    block: Block,
    time_base: TimeBase,
    /// There once the sampling step is known.
    cutter: Option<WindowCutter>,
    samples: u64,
    span: Option<[f64; 2]>,
}

impl<'a> RowIntake<'a> {
    fn new(
        joints: usize,
        settings: &'a FilterSettings,
        rate_hz: Option<f64>,
    ) -> Result<Self, MotionError> {
        if joints == 0 {
            return Err(MotionError::Setting {
                name: "joints",
                value: 0.0,
                remedy: "a robot has one joint or more",
            });
        }
        Ok(Self {
            settings,
            joints,
            block: Block::default(),
            time_base: TimeBase::new(joints, settings, rate_hz)?,
            cutter: None,
            samples: 0,
            span: None,
        })
    }

    /// Reads until there is a window for every thread; false when the log is at its end.
    fn read<E>(
        &mut self,
        source: &mut dyn FnMut(&mut Block) -> Result<bool, E>,
    ) -> Result<bool, RunError<E>> {
        loop {
            let block = &mut self.block;
            block.clear();
            let more = source(block).map_err(RunError::Source)?;
            self.samples += block.t.len() as u64;
            if let (Some(&first), Some(&last)) = (block.t.first(), block.t.last()) {
                self.span = Some([self.span.map_or(first, |[from, _]| from), last]);
            }
            self.time_base.push(block)?;
            let clock = if more {
                self.time_base.clock()
            } else {
                Some(self.time_base.settle_clock()?)
            };
            let Some(clock) = clock else { continue };
            let cutter = match &mut self.cutter {
                Some(cutter) => cutter,
                none => none.insert(WindowCutter::new(
                    FilterDesign::design(self.settings, clock.dt)?,
                    self.joints,
                )),
            };
            self.time_base
                .drain(!more, &mut |event| cutter.take(event))?;
            if !more || cutter.ready >= rayon::current_num_threads() {
                return Ok(more);
            }
        }
    }

    /// Gives away the windows that are cut, and takes others to cut into; returns how many.
    fn swap(&mut self, batch: &mut Vec<FilterWindow>) -> usize {
        match &mut self.cutter {
            Some(cutter) => {
                std::mem::swap(&mut cutter.windows, batch);
                std::mem::take(&mut cutter.ready)
            }
            None => 0,
        }
    }

    fn summary(self, rows: u64) -> Result<Summary, MotionError> {
        let Some(cutter) = self.cutter else {
            return Err(MotionError::TooFewSamples {
                samples: self.samples,
            });
        };
        let chain = &cutter.chain;
        if cutter.segments == 0 {
            return Err(MotionError::NoSegment {
                segments: cutter.skipped.segments,
                longest: cutter.longest,
                needed: chain.shortest,
            });
        }
        let [from, to] = self.span.unwrap_or_default();
        Ok(Summary {
            samples: self.samples,
            rows,
            dt: chain.dt,
            duration_s: to - from,
            segments: cutter.segments,
            interpolated: self.time_base.interpolated(),
            cutoff_hz: self.settings.cutoff_hz,
            decimation: chain.decimation,
            q_cutoff_hz: chain.position.as_ref().map(|f| f.lowest_cutoff_hz()),
            skipped: cutter.skipped,
        })
    }
}
