//! Segments of a log cut into windows that overlap.

use std::sync::Arc;

use super::settings::FilterDesign;
use super::time_base::Event;
use super::window::FilterWindow;

/// Spans of skipped stretches that are listed; more are only counted.
const LISTED: usize = 20;

/// Stretches of a log that were too short to filter.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SkippedStretches {
    pub segments: usize,
    /// Their samples together.
    pub samples: u64,
    /// First and last time (s) of the first 20 of them.
    pub spans_s: Vec<[f64; 2]>,
}

/// Cuts the segments of a log into windows.
pub(super) struct WindowCutter {
    pub chain: Arc<FilterDesign>,
    joints: usize,
    /// Samples of the segment in work, from index `first` of the segment on.
    t: Vec<f64>,
    q: Vec<f64>,
    tau: Vec<f64>,
    first: usize,
    /// Index within the segment at which the next window's rows start.
    core: usize,
    /// Segments used so far, the one in work not counted.
    pub segments: usize,
    /// Samples of the longest stretch, used or not.
    pub longest: usize,
    pub skipped: SkippedStretches,
    /// Windows, the first `ready` of them cut and not yet run.
    pub windows: Vec<FilterWindow>,
    pub ready: usize,
}

impl WindowCutter {
    pub fn new(chain: FilterDesign, joints: usize) -> Self {
        Self {
            chain: Arc::new(chain),
            joints,
            t: Vec::new(),
            q: Vec::new(),
            tau: Vec::new(),
            first: 0,
            core: 0,
            segments: 0,
            longest: 0,
            skipped: SkippedStretches::default(),
            windows: Vec::new(),
            ready: 0,
        }
    }

    pub fn take(&mut self, event: Event<'_>) {
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

    /// Makes a window of the samples in memory, for the rows from `self.core` to `core_end`.
    fn cut(&mut self, core_end: usize, ends: bool) {
        if self.ready == self.windows.len() {
            self.windows.push(FilterWindow::default());
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
}
