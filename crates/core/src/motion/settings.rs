//! What the user chooses about filtering, and the filters that follow for one sampling step.

use super::MotionError;
use super::position_filter::{HIGHEST_SHARE, PositionFilter};
use super::rest::response;
use super::thinning::{self, TorqueThinner};
use crate::math::kept::KeptEvery;
use crate::math::sos::SosFilter;
use crate::math::zero_phase::ZeroPhase;

/// Time constants of the position filter by which windows overlap: derivatives take up to 1 / step^2 of what is left.
const POSITION_OVERLAP: f64 = 45.0;
/// Time constants of the parallel filter by which windows overlap.
const PARALLEL_OVERLAP: f64 = 28.0;
/// Samples of a window besides its overlaps, at least.
const WINDOW_CORE: usize = 8192;

/// How a log is filtered.
#[derive(Debug, Clone, PartialEq)]
pub struct FilterSettings {
    /// Cut-off of the parallel filter (Hz): the band of motion and torque that is kept.
    pub cutoff_hz: f64,
    /// Kind of the parallel filter.
    pub filter: ParallelFilter,
    /// Every how many samples a row is kept; left out, about ten rows per period of the cut-off.
    pub decimation: Option<usize>,
    /// Cut-off of the position filter (Hz); left out, six times `cutoff_hz` but at most 0.4 of the
    /// sampling rate.
    pub q_cutoff_hz: Option<f64>,
    /// Cut-off of each joint's position filter (Hz), in its place; empty where all joints have one.
    pub joint_q_cutoffs_hz: Vec<f64>,
    /// Order of the (Butterworth) position filter; 0 differentiates raw positions.
    pub q_order: usize,
    /// How positions are differentiated.
    pub differences: DifferenceFormula,
    /// At which time a logged torque acts.
    pub torque: TorqueTiming,
    /// A step longer than this many sampling steps splits the log ..
    pub gap_factor: f64,
    /// .. unless rows of a steady clock are missing for no longer than this (s): what lasts an eighth of a period of the
    /// highest frequency that is kept follows from its neighbours. 0: only steps count.
    pub bridge_s: f64,
    /// Dropped at each end of a segment before the parallel filter (s), where the position filter
    /// has nothing to look ahead to; left out, ten of that filter's time constants.
    pub q_trim_s: Option<f64>,
    /// Dropped at each end of a segment after the parallel filter (s); left out, three of that
    /// filter's time constants.
    pub trim_s: Option<f64>,
    /// Speed up to which each joint rests [m/s or rad/s], below 0 of one that never does; empty where none does.
    pub rest_speed: Vec<f64>,
    /// Whether samples of a joint that stands or turns weigh nothing; plain least squares weighs all alike.
    pub weighs_rests: bool,
    /// Whether channels are computed at fewer samples where the log is much faster than its positions' filter lets
    /// through: not what jumps or remembers, nor what takes single samples.
    pub thin: bool,
}

impl Default for FilterSettings {
    fn default() -> Self {
        Self {
            cutoff_hz: 10.0,
            filter: ParallelFilter::Butterworth { order: 4 },
            decimation: None,
            q_cutoff_hz: None,
            joint_q_cutoffs_hz: Vec::new(),
            q_order: 4,
            differences: DifferenceFormula::HighOrder,
            torque: TorqueTiming::Sampled,
            gap_factor: 2.5,
            bridge_s: 0.0,
            q_trim_s: None,
            trim_s: None,
            rest_speed: Vec::new(),
            weighs_rests: true,
            thin: false,
        }
    }
}

impl FilterSettings {
    /// The longest step of a log of sampling step `dt` that may not split it (s).
    pub fn longest_step(&self, dt: f64) -> f64 {
        (self.gap_factor * dt).max(self.bridge_s)
    }
}

/// The filter that runs, forward and backward, over torque and computed columns alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParallelFilter {
    /// Flat in the pass band.
    Butterworth {
        /// Order of one pass.
        order: usize,
    },
    /// Steep, with ripple: order 8, 0.05 dB at 0.8 of the new Nyquist frequency is the customary
    /// decimating filter.
    Chebyshev {
        /// Order of one pass.
        order: usize,
        /// Ripple in the pass band (dB).
        ripple_db: f64,
    },
}

/// Difference formula for velocity and acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DifferenceFormula {
    /// Three points, once for the velocity and once for the acceleration.
    Central,
    /// Nine points, exact for polynomials of degree 8 (velocity) and 9 (acceleration).
    HighOrder,
}

/// Time at which a logged torque acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TorqueTiming {
    /// The value at the instant of the row.
    Sampled,
    /// The row's value acts from its instant to the next row (a command of a sampled controller): its mean about the
    /// instant is formed from the values before and after.
    ZeroOrderHold,
}

/// The declared filters, the parallel one among them, and lengths for one sampling step.
#[derive(Debug, Clone)]
pub struct FilterDesign {
    /// Sampling step (s).
    pub(super) dt: f64,
    pub(super) differences: DifferenceFormula,
    pub(super) position: Option<PositionFilter>,
    pub(super) parallel: ZeroPhase,
    /// The same for the samples that are left, of which the rows are kept.
    pub(super) kept: KeptEvery,
    /// Every how many samples channels are computed, and torques there where that is more than one.
    pub(super) thinned: usize,
    pub(super) thinner: Option<TorqueThinner>,
    /// Every how many samples a row is kept.
    pub decimation: usize,
    /// Samples dropped at a segment's end before the parallel filter.
    pub(super) edge: usize,
    /// Samples dropped at each end of a segment, or of a stretch, after the parallel filter.
    pub trim: usize,
    /// Samples at a window's artificial end that the position filter has not settled in.
    pub(super) position_overlap: usize,
    /// Samples of overlap in all.
    pub(super) overlap: usize,
    /// Samples of a window besides its overlaps.
    pub(super) core: usize,
    /// Samples of the shortest segment that is used.
    pub(super) shortest: usize,
    /// Speed up to which each joint rests, and the response of its position filter in samples.
    pub(super) rests: Vec<(f64, usize)>,
    /// Samples over which a row takes most of what it holds.
    pub(super) row_samples: usize,
}

impl FilterSettings {
    /// Cut-offs of the position filter at a sampling rate \[Hz\]: one for all joints, or one for each.
    pub(super) fn position_cutoffs_hz(&self, rate_hz: f64) -> Vec<f64> {
        match self.joint_q_cutoffs_hz.as_slice() {
            [] => vec![self.plain_q_cutoff_hz(rate_hz)],
            each => each.to_vec(),
        }
    }

    /// The position cut-off of all joints at a sampling rate \[Hz\]: the declared one, else six times that of the
    /// parallel filter.
    pub fn plain_q_cutoff_hz(&self, rate_hz: f64) -> f64 {
        let plain = || (6.0 * self.cutoff_hz).min(HIGHEST_SHARE * rate_hz);
        self.q_cutoff_hz.unwrap_or_else(plain)
    }

    /// The same with one position filter for all joints, of this cut-off \[Hz\].
    pub fn with_one_position_filter(&self, cutoff_hz: f64) -> Self {
        FilterSettings {
            q_cutoff_hz: Some(cutoff_hz),
            joint_q_cutoffs_hz: Vec::new(),
            ..self.clone()
        }
    }

    /// The same with position cut-offs so many times as high, as far as a sampling rate \[Hz\] carries them.
    pub fn widened(&self, times: f64, rate_hz: f64) -> Self {
        let highest = HIGHEST_SHARE * rate_hz;
        let wider = |cutoff: f64| (times * cutoff).min(highest.max(cutoff));
        FilterSettings {
            q_cutoff_hz: Some(wider(self.plain_q_cutoff_hz(rate_hz))),
            joint_q_cutoffs_hz: self.joint_q_cutoffs_hz.iter().map(|c| wider(*c)).collect(),
            ..self.clone()
        }
    }

    /// Every how many samples of step `dt` [s] a row is kept: the declared decimation, else ten rows
    /// a period of the cut-off.
    pub fn decimation_at(&self, dt: f64) -> usize {
        // a step that is rounded must not cost a row
        let ten_a_period = 1.0 / (10.0 * self.cutoff_hz * dt) + 1e-6;
        self.decimation.unwrap_or((ten_a_period as usize).max(1))
    }
}

impl FilterDesign {
    /// The filters for one sampling step [s].
    ///
    /// # Errors
    /// [`MotionError`] for settings that the sampling rate does not carry.
    pub fn design(settings: &FilterSettings, dt: f64) -> Result<Self, MotionError> {
        let rate = 1.0 / dt;
        if settings.decimation == Some(0) {
            return Err(MotionError::Setting {
                name: "decimation",
                value: 0.0,
                remedy: "1 keeps every row",
            });
        }
        let decimation = settings.decimation_at(dt);
        let parallel_at = |rate: f64| match settings.filter {
            ParallelFilter::Butterworth { order } => {
                SosFilter::butterworth(order, settings.cutoff_hz, rate)
            }
            ParallelFilter::Chebyshev { order, ripple_db } => {
                SosFilter::chebyshev(order, ripple_db, settings.cutoff_hz, rate)
            }
        };
        let parallel = parallel_at(rate)?;
        let cutoffs = settings.position_cutoffs_hz(rate);
        let highest = cutoffs.iter().copied().fold(0.0, f64::max);
        let position = PositionFilter::design(settings.q_order, cutoffs, rate)?;
        let thinned = match position {
            Some(_) => thinning::factor(settings.thin, highest, decimation, dt),
            None => 1,
        };
        let edge = edge(settings, position.as_ref(), dt)?;
        let trim = samples_of("trim_s", settings.trim_s, dt)?
            .unwrap_or_else(|| parallel.settle_samples(3.0));
        let pad = |sos: &SosFilter| sos.pad_samples() + 1;
        let position_pad = position.as_ref().map_or(0, |f| pad(f.narrowest().sos()));
        // An artificial end must cost at least what a segment's end does, or a middle window
        // would keep samples that the whole segment drops.
        let position_overlap = settled(settings, position.as_ref(), POSITION_OVERLAP)
            .max(edge)
            .max(position_pad);
        let parallel_overlap = parallel.settle_samples(PARALLEL_OVERLAP);
        let overlap = position_overlap + parallel_overlap.max(trim).max(pad(&parallel));
        let core = WINDOW_CORE.max(2 * overlap);
        let parallel = ZeroPhase::new(parallel);
        let kept = match thinned {
            1 => KeptEvery::new(parallel.clone(), decimation),
            _ => {
                let filter = ZeroPhase::new(parallel_at(rate / thinned as f64)?);
                KeptEvery::new(filter, decimation / thinned)
            }
        };
        let shortest = 2 * (edge + trim) + 3 * position_pad.max(thinned * pad(parallel.sos()));
        let reach = settings.differences.reach();
        let of_joint = |(j, speed): (usize, &f64)| {
            let cutoff = position.as_ref().map(|f| f.cutoff_hz(j));
            (*speed, response(cutoff, dt, reach))
        };
        let joints = settings.rest_speed.iter().enumerate();
        Ok(Self {
            dt,
            rests: joints.map(of_joint).collect(),
            row_samples: (0.5 / (settings.cutoff_hz * dt)) as usize + 1,
            differences: settings.differences,
            position,
            kept,
            thinned,
            thinner: (thinned > 1).then(|| TorqueThinner::new(thinned)),
            parallel,
            decimation,
            edge,
            trim,
            position_overlap,
            overlap,
            core,
            shortest,
        })
    }
}

/// Samples at a segment's end where the position filter lacks what it would look ahead to.
pub(super) fn edge(
    settings: &FilterSettings,
    position: Option<&PositionFilter>,
    dt: f64,
) -> Result<usize, MotionError> {
    let asked = samples_of("q_trim_s", settings.q_trim_s, dt)?;
    Ok(asked.unwrap_or_else(|| settled(settings, position, 10.0)))
}

/// Samples after which `factor` time constants of the position filter and the reach of the differences have passed.
fn settled(settings: &FilterSettings, position: Option<&PositionFilter>, factor: f64) -> usize {
    position.map_or(0, |f| f.narrowest().sos().settle_samples(factor))
        + settings.differences.reach()
}

fn samples_of(
    name: &'static str,
    seconds: Option<f64>,
    dt: f64,
) -> Result<Option<usize>, MotionError> {
    match seconds {
        None => Ok(None),
        Some(value) if (0.0..1e6).contains(&value) => Ok(Some((value / dt).round() as usize)),
        Some(value) => Err(MotionError::Setting {
            name,
            value,
            remedy: "a time in seconds, 0 or more",
        }),
    }
}
