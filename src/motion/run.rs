//! The windows of a streamed log.

use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

use super::settings::{Chain, Settings};
use super::time_base::{Event, TimeBase};
use super::window::Window;
use super::{MotionError, Row, Sample};
use crate::log::Block;

/// Spans of skipped stretches that are listed; more are only counted.
const LISTED: usize = 20;

/// Why a log could not be run through: its source failed, or it cannot be turned into rows.
#[derive(Debug, Error)]
pub enum RunError<E> {
    /// The source's own error.
    #[error("{0}")]
    Source(E),
    /// The log cannot be turned into rows.
    #[error(transparent)]
    Motion(#[from] MotionError),
}

/// What was done to a log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// Rows of the log.
    pub samples: u64,
    /// Rows handed to the sink.
    pub rows: u64,
    /// Sampling step [s].
    pub dt: f64,
    /// Time from the first to the last row of the log [s].
    pub duration_s: f64,
    /// Stretches without a gap that were used.
    pub segments: usize,
    /// Stretches too short to filter.
    pub skipped: Skipped,
    /// Samples interpolated because no row lay within 2 % of a step from their time.
    pub interpolated: u64,
    /// Cut-off of the parallel filter [Hz].
    pub cutoff_hz: f64,
    /// Every how many samples a row was kept.
    pub decimation: usize,
    /// Cut-off of the position filter [Hz]; none where raw positions were differentiated.
    pub q_cutoff_hz: Option<f64>,
}

/// Stretches of a log that were too short to filter.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Skipped {
    /// How many.
    pub segments: usize,
    /// Their samples together.
    pub samples: u64,
    /// First and last time [s] of the first 20 of them.
    pub spans_s: Vec<[f64; 2]>,
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
    settings: &Settings,
    rate_hz: Option<f64>,
    channels: usize,
    fill: &(dyn Fn(&Sample<'_>, &mut [f64]) + Sync),
    sink: &mut dyn FnMut(&Row<'_>),
) -> Result<Summary, RunError<E>> {
    if joints == 0 {
        return Err(MotionError::Setting {
            name: "joints",
            value: 0.0,
            remedy: "a robot has one joint or more",
        }
        .into());
    }
    let mut time_base = TimeBase::new(joints, settings, rate_hz)?;
    let mut block = Block::default();
    let mut cutter: Option<Cutter> = None;
    let (mut samples, mut rows, mut span) = (0_u64, 0_u64, None::<[f64; 2]>);
    loop {
        block.clear();
        let more = source(&mut block).map_err(RunError::Source)?;
        samples += block.t.len() as u64;
        if let (Some(&first), Some(&last)) = (block.t.first(), block.t.last()) {
            span = Some([span.map_or(first, |[from, _]| from), last]);
        }
        time_base.push(&block)?;
        let clock = if more {
            time_base.clock()
        } else {
            Some(time_base.settle_clock()?)
        };
        let Some(clock) = clock else { continue };
        let cutter = match &mut cutter {
            Some(cutter) => cutter,
            none => none.insert(Cutter::new(Chain::design(settings, clock.dt)?, joints)),
        };
        time_base.drain(!more, &mut |event| cutter.take(event))?;
        if more && cutter.ready < rayon::current_num_threads() {
            continue;
        }
        rows += cutter.hand_out(channels, fill, sink)?;
        if more {
            continue;
        }
        let chain = &cutter.chain;
        if cutter.segments == 0 {
            return Err(MotionError::NoSegment {
                segments: cutter.skipped.segments,
                longest: cutter.longest,
                needed: chain.shortest,
            }
            .into());
        }
        let [from, to] = span.unwrap_or_default();
        return Ok(Summary {
            samples,
            rows,
            dt: chain.dt,
            duration_s: to - from,
            segments: cutter.segments,
            skipped: cutter.skipped.clone(),
            interpolated: time_base.interpolated(),
            cutoff_hz: settings.cutoff_hz,
            decimation: chain.decimation,
            q_cutoff_hz: chain.q_cutoff_hz,
        });
    }
}

/// Cuts segments into windows and runs them in batches.
struct Cutter {
    chain: Chain,
    joints: usize,
    /// Samples of the segment in work, from index `first` of the segment on.
    t: Vec<f64>,
    q: Vec<f64>,
    tau: Vec<f64>,
    first: usize,
    /// Index within the segment at which the next window's rows start.
    core: usize,
    /// Segments used so far, the one in work not counted.
    segments: usize,
    longest: usize,
    skipped: Skipped,
    /// Windows, the first `ready` of them cut and not yet run.
    windows: Vec<Window>,
    ready: usize,
}

impl Cutter {
    fn new(chain: Chain, joints: usize) -> Self {
        Self {
            chain,
            joints,
            t: Vec::new(),
            q: Vec::new(),
            tau: Vec::new(),
            first: 0,
            core: 0,
            segments: 0,
            longest: 0,
            skipped: Skipped::default(),
            windows: Vec::new(),
            ready: 0,
        }
    }

    fn take(&mut self, event: Event<'_>) {
        match event {
            Event::Sample { t, q, tau } => {
                self.t.push(t);
                self.q.extend_from_slice(q);
                self.tau.extend_from_slice(tau);
                let core_end = self.core + self.chain.core;
                if self.first + self.t.len() == core_end + self.chain.overlap {
                    self.cut(core_end, false);
                    let keep_from = core_end.saturating_sub(self.chain.overlap);
                    let gone = keep_from - self.first;
                    self.t.drain(..gone);
                    self.q.drain(..gone * self.joints);
                    self.tau.drain(..gone * self.joints);
                    self.first = keep_from;
                    self.core = core_end;
                }
            }
            Event::End => {
                let samples = self.first + self.t.len();
                self.longest = self.longest.max(samples);
                if samples >= self.chain.shortest {
                    self.cut(samples, true);
                    self.segments += 1;
                } else if let (Some(&from), Some(&to)) = (self.t.first(), self.t.last()) {
                    self.skipped.segments += 1;
                    self.skipped.samples += samples as u64;
                    if self.skipped.spans_s.len() < LISTED {
                        self.skipped.spans_s.push([from, to]);
                    }
                }
                self.t.clear();
                self.q.clear();
                self.tau.clear();
                self.first = 0;
                self.core = 0;
            }
        }
    }

    /// Makes a window of what is held, for the rows from `self.core` to `core_end`.
    fn cut(&mut self, core_end: usize, ends: bool) {
        if self.ready == self.windows.len() {
            self.windows.push(Window::default());
        }
        let window = &mut self.windows[self.ready];
        self.ready += 1;
        window.segment = self.segments;
        window.first = self.first;
        window.core = self.core..core_end;
        window.ends = ends;
        window.t.clone_from(&self.t);
        window.q.clone_from(&self.q);
        window.tau.clone_from(&self.tau);
    }

    /// Runs the windows that wait, side by side, and hands out their rows in order; returns how
    /// many rows.
    fn hand_out(
        &mut self,
        channels: usize,
        fill: &(dyn Fn(&Sample<'_>, &mut [f64]) + Sync),
        sink: &mut dyn FnMut(&Row<'_>),
    ) -> Result<u64, MotionError> {
        let (chain, joints) = (&self.chain, self.joints);
        let windows = &mut self.windows[..self.ready];
        let outcomes: Vec<Result<(), MotionError>> = windows
            .par_iter_mut()
            .map(|window| window.process(chain, joints, channels, fill))
            .collect();
        self.ready = 0;
        let mut rows = 0;
        for (window, outcome) in windows.iter().zip(outcomes) {
            outcome?;
            for row in window.rows(joints, channels) {
                sink(&row);
                rows += 1;
            }
        }
        Ok(rows)
    }
}
