//! The known inputs of the filter again, from motions that were smoothed otherwise.
//!
//! The other joints are commanded to hold, and move by a few encoder steps when the friction of the
//! moving one turns. Their acceleration reacts on the moving joint, but at the bandwidth of the
//! position filter it is mostly differentiated rounding: an error in a regressor pulls its
//! coefficient to zero (Fuller 1987, Measurement Error Models, section 1.1), and what is missing
//! then leans on the friction. How far each of these accelerations can be narrowed before it loses
//! more than it gains, the innovation likelihood of the moving joint says (`bands`).

use super::prepare::{PreparedProblem, SensorModel, SmoothedMotion, prepare_again};
use super::problem::FrictionProblem;
use crate::math::sos::SosFilter;
use crate::math::zero_phase::ZeroPhase;
use crate::robot::Robot;

/// Order of the Butterworth low-pass, run forward and backward.
const ORDER: usize = 4;

/// All that the one-joint problem was made from.
pub struct FrictionInputs<'a> {
    pub robot: &'a Robot,
    pub joint: usize,
    pub motions: &'a [SmoothedMotion],
    /// The same with a narrower position filter.
    pub narrower: &'a [SmoothedMotion],
    pub sensors: &'a SensorModel<'a>,
}

impl FrictionInputs<'_> {
    /// The problem `like`, the accelerations of the other joints kept below `cutoffs` [Hz], one per
    /// joint; as they are where it is infinite or beyond what the sampling rate allows.
    pub fn problem(&self, like: &PreparedProblem, cutoffs: &[f64]) -> Option<FrictionProblem> {
        self.build(self.motions, like, cutoffs)
    }

    /// The same from the narrower smoothing, its cut-offs lowered by the same `factor`.
    pub fn narrower(
        &self,
        like: &PreparedProblem,
        cutoffs: &[f64],
        factor: f64,
    ) -> Option<FrictionProblem> {
        let lowered: Vec<f64> = cutoffs.iter().map(|c| factor * c).collect();
        self.build(self.narrower, like, &lowered)
    }

    fn build(
        &self,
        motions: &[SmoothedMotion],
        like: &PreparedProblem,
        cutoffs: &[f64],
    ) -> Option<FrictionProblem> {
        if cutoffs.iter().all(|c| c.is_infinite()) {
            return prepare_again(self.robot, self.joint, motions, self.sensors, like);
        }
        let banded: Vec<SmoothedMotion> = motions.iter().map(|m| self.banded(m, cutoffs)).collect();
        prepare_again(self.robot, self.joint, &banded, self.sensors, like)
    }

    fn banded(&self, motion: &SmoothedMotion, cutoffs: &[f64]) -> SmoothedMotion {
        let n = self.robot.joints();
        let mut out = motion.clone();
        let samples = motion.t.len();
        let (Some(first), Some(last)) = (motion.t.first(), motion.t.last()) else {
            return out;
        };
        // the clock's unevenness is far below a period of these cut-offs
        let rate = (samples - 1) as f64 / (last - first);
        for (i, &cutoff) in cutoffs.iter().enumerate() {
            if i == self.joint || !cutoff.is_finite() {
                continue;
            }
            let Ok(sos) = SosFilter::butterworth(ORDER, cutoff, rate) else {
                continue;
            };
            let mut channel: Vec<f64> = motion.a.iter().skip(i).step_by(n).copied().collect();
            if ZeroPhase::new(sos).run(&mut channel, 1).is_ok() {
                for (a, x) in out.a.iter_mut().skip(i).step_by(n).zip(&channel) {
                    *a = *x;
                }
            }
        }
        out
    }
}
