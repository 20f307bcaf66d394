//! The filter that positions come through before they are differentiated: one for all joints, or one for each.

use super::MotionError;
use crate::math::sos::SosFilter;
use crate::math::zero_phase::{ZeroPhase, run_each};

/// A position cut-off that is not asked for stays below this share of the sampling rate.
pub(super) const HIGHEST_SHARE: f64 = 0.4;

/// The designed filters and their cut-offs.
#[derive(Debug, Clone)]
pub(super) struct PositionFilter {
    /// Of all joints, or of each in turn.
    filters: Vec<ZeroPhase>,
    /// \[Hz\]
    cutoffs: Vec<f64>,
    /// Which of them is the narrowest.
    narrowest: usize,
}

impl PositionFilter {
    /// Butterworth filters of that order, with the cut-off \[Hz\] of all joints or those of each, at a sampling
    /// rate \[Hz\]; none of order 0, where raw positions are differentiated.
    ///
    /// # Errors
    /// [`MotionError`] for a cut-off or an order that the rate does not carry.
    pub fn design(order: usize, cutoffs: Vec<f64>, rate: f64) -> Result<Option<Self>, MotionError> {
        if order == 0 {
            return Ok(None);
        }
        let design = |cutoff: &f64| SosFilter::butterworth(order, *cutoff, rate);
        let filters = cutoffs
            .iter()
            .map(|cutoff| Ok(ZeroPhase::new(design(cutoff)?)))
            .collect::<Result<Vec<_>, MotionError>>()?;
        let lower = |a: &usize, b: &usize| cutoffs[*a].total_cmp(&cutoffs[*b]);
        let narrowest = (0..cutoffs.len()).min_by(lower).unwrap_or(0);
        Ok(Some(PositionFilter {
            filters,
            cutoffs,
            narrowest,
        }))
    }

    /// Filters positions, `samples x joints` row-major, in place; of a joint that stands still exactly nothing
    /// changes, so that it has no speed of rounding.
    ///
    /// # Errors
    /// [`MotionError`] for too few samples.
    pub fn run(&self, q: &mut [f64], joints: usize) -> Result<(), MotionError> {
        let first = q[..joints.min(q.len())].to_vec();
        let each = |q: &mut [f64], add: f64| {
            for row in q.chunks_exact_mut(joints.max(1)) {
                row.iter_mut()
                    .zip(&first)
                    .for_each(|(q, first)| *q += add * first);
            }
        };
        each(q, -1.0);
        let filtered = run_each(|joint| self.of(joint), q, joints);
        each(q, 1.0);
        Ok(filtered?)
    }

    /// The filter of a joint.
    pub fn of(&self, joint: usize) -> &ZeroPhase {
        self.filters.get(joint).unwrap_or(self.narrowest())
    }

    /// Cut-off of a joint's filter \[Hz\].
    pub fn cutoff_hz(&self, joint: usize) -> f64 {
        let own = self.cutoffs.get(joint);
        own.copied().unwrap_or(self.lowest_cutoff_hz())
    }

    /// The filter that takes longest to settle.
    pub fn narrowest(&self) -> &ZeroPhase {
        &self.filters[self.narrowest]
    }

    /// Cut-off of the narrowest filter \[Hz\].
    pub fn lowest_cutoff_hz(&self) -> f64 {
        self.cutoffs[self.narrowest]
    }
}
