//! From samples of position and torque to filtered, decimated rows of position, velocity,
//! acceleration and whatever is computed from them.
//!
//! ```text
//! log blocks -> time base -> smooth q -> differences -> thin  -> fill -> one filter over all -> every m-th
//!               (segments)   (wide)      v, a           (fast logs)  tau, Y, F(v)  channels    row
//! ```
//!
//! The model `tau = Y(q, v, a) theta + F(v)` holds sample by sample, and it still holds after any
//! linear filter that runs over both of its sides alike. So positions are smoothed only as far as
//! differentiation needs (a pass band several times wider than the band that is kept), everything
//! is computed from them at full rate, and one zero-phase filter then runs over the torque and over
//! every computed column alike (Gautier 1997; Janot, Vandanjon and Gautier 2014).
//!
//! Nothing is differentiated or filtered across a gap. Logs of any length pass through in windows
//! that overlap by so many time constants that the result is that of filtering whole segments, to
//! 1e-9; the number of threads changes no bit.

mod added_noise;
mod causal;
mod cutter;
mod differences;
mod full_rate;
pub mod position_cutoff;
mod position_filter;
pub mod rest;
mod run;
mod settings;
mod stretch;
mod thinning;
mod time_base;
mod window;
mod zero_order_hold;

pub use causal::{CausalFilter, CausalMotion, CausalSample};
pub use cutter::SkippedStretches;
pub use full_rate::{FullRateMotion, full_rate, segments};
pub use run::{RunError, Summary, run};
pub use settings::{DifferenceFormula, FilterDesign, FilterSettings, ParallelFilter, TorqueTiming};
pub(crate) use stretch::alike;
pub use stretch::{ParallelFilters, Stretch, stretches};
pub use zero_order_hold::ZeroOrderHold;

use crate::explain::Explain;
use thiserror::Error;

use crate::math::MathError;

/// One sample at full rate, after smoothing and differentiation.
#[derive(Debug, Clone, Copy)]
pub struct MotionSample<'a> {
    /// Time (s).
    pub t: f64,
    /// Smoothed positions [m or rad].
    pub q: &'a [f64],
    /// Velocities [m/s or rad/s].
    pub v: &'a [f64],
    /// Accelerations [m/s2 or rad/s2].
    pub a: &'a [f64],
    /// The log's torque channels, unfiltered, brought to the time of q [N, Nm, or V if so logged].
    pub tau: &'a [f64],
    /// The same of the samples before and after it; at an end of the stretch, and where rows come one by one, its own.
    pub tau_beside: [&'a [f64]; 2],
    /// What each joint's row weighs: 0 where it stands or turns, 1 where it moves, and 1 where no speed of rest is given.
    pub weight: &'a [f64],
    /// Whether each joint rests for longer than a row lasts, somewhere in what is filtered with this sample.
    pub rests: &'a [bool],
}

/// One row that is kept.
#[derive(Debug, Clone, Copy)]
pub struct FilteredRow<'a> {
    /// Time (s).
    pub t: f64,
    /// Segment of the log, counted from 0 over the segments that are used.
    pub segment: usize,
    /// Time from one row that is kept to the next, the same for all of a log (s).
    pub step: f64,
    /// Positions after the position filter [m or rad].
    pub q: &'a [f64],
    /// Velocities [m/s or rad/s].
    pub v: &'a [f64],
    /// Accelerations [m/s2 or rad/s2].
    pub a: &'a [f64],
    /// The computed channels at this sample, before the parallel filter.
    pub raw: &'a [f64],
    /// The computed channels after the parallel filter.
    pub filtered: &'a [f64],
}

/// Why a log cannot be turned into rows.
#[derive(Debug, Clone, PartialEq, Explain, Error)]
pub enum MotionError {
    /// A filter cannot be designed or run.
    #[explain(_0.explanation())]
    Math(#[from] MathError),

    /// Fewer samples than a sampling step needs.
    #[explain("the log holds {samples} samples: two are the least that has a sampling step")]
    TooFewSamples { samples: u64 },

    /// A block of another width than the robot.
    #[explain(
        "{channel} has {values} values in {rows} rows, but the robot has {joints} joints: check the columns of the log"
    )]
    Shape {
        /// `q` or `tau`.
        channel: &'static str,
        values: usize,
        rows: usize,
        joints: usize,
    },

    /// Time stands still or runs backwards [s].
    #[explain("time goes from {before} s to {after} s: sort the log and remove repeated rows")]
    Time { before: f64, after: f64 },

    /// A setting out of its range.
    #[explain("{name} = {value} is not possible: {remedy}")]
    Setting {
        name: &'static str,
        value: f64,
        remedy: &'static str,
    },

    /// Every stretch without a gap is too short to filter.
    #[explain(
        "no stretch of the log is long enough to filter: {segments} stretches between gaps, the longest of {longest} samples, {needed} are needed",
        "bridge gaps that are short beside the motion by `gap_factor = 8` in [filter], raise `cutoff_hz`, or record longer"
    )]
    NoSegment {
        segments: usize,
        longest: usize,
        needed: usize,
    },

    /// A record that must be of one piece has a gap [s].
    #[explain("no row between {from} s and {to} s: smooth the stretches before and after it apart")]
    Gap { from: f64, to: f64 },

    /// A computed channel, counted from 0, is NaN or infinite at a time [s].
    #[explain(
        "channel {channel} is {value} at t = {t} s: the position there is outside of what the model covers"
    )]
    NotFinite { channel: usize, value: f64, t: f64 },
}
