//! The one-joint problem of eq. (29) as the filter sees it: known inputs, parameters, scales.
//!
//! `m(t) a + h(t) + F(v) = tau` with `m = m_k . eta`, `h = h_k . eta`: inertia and gravity of the
//! joint, and the reaction of the stationary joints, enter as known functions of the measured
//! motion with unknown coefficients `eta` (the nuisance). Only `q` and `v` of the moving joint are
//! filter states; the friction law is eq. (18).

use crate::robot::friction::DoubleTanh;

/// Number of friction parameters per joint: Bv, Bf1, Bf2, w1, w2 of eq. (18).
pub const FRICTION: usize = 5;

/// One uninterrupted record of one joint. All slices have one entry per sample, except those of
/// the intervals `[t_k, t_k+1)`, which have one less (`tau`, `m`, `h`).
#[derive(Debug, Clone, Default)]
pub struct JointRecord {
    /// Time of each sample [s], strictly increasing.
    pub t: Vec<f64>,
    /// Measured position [m or rad].
    pub y: Vec<f64>,
    /// Variance of each measured position [m^2 or rad^2], before `NoiseLevels::position_factor`.
    pub r: Vec<f64>,
    /// Torque that acts during each interval [N or Nm].
    pub tau: Vec<f64>,
    /// Coefficients of the joint's own acceleration, intervals x nuisance, row-major.
    pub m: Vec<f64>,
    /// Coefficients of what acts beside it, intervals x nuisance, row-major.
    pub h: Vec<f64>,
    /// A first guess of the velocity at the first sample [1/s].
    pub v0: f64,
}

/// All records of one joint and the scales of its parameters.
#[derive(Debug, Clone)]
pub struct FrictionProblem {
    pub records: Vec<JointRecord>,
    /// Number of nuisance parameters.
    pub nuisance: usize,
    /// Scale of the torque [N or Nm] and of the velocity [1/s]: parameters are relative to
    /// them, since Bv, Bf and w differ by orders of magnitude.
    pub torque_scale: f64,
    pub velocity_scale: f64,
    /// Smallest and largest slope that the filter may try [1/velocity].
    pub slope_range: (f64, f64),
    /// Smallest mean inertia that the filter may try [kg or kg m^2].
    pub least_inertia: f64,
}

/// Friction and nuisance in the filter's coordinates: `[Bv, Bf1, Bf2]` relative to the scales, the
/// logarithms of `w1, w2` times the velocity scale, then `eta` as it is.
pub type FilterParameters = Vec<f64>;

/// Levels of the two noises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseLevels {
    /// Standard deviation of the torque that acts but is not in the log [N or Nm], white from
    /// interval to interval: the process noise `W` of (30).
    pub torque: f64,
    /// Factor on the measurement variance `r` of each sample (31); never below one.
    pub position_factor: f64,
}

impl FrictionProblem {
    /// Total number of parameters beside the two states.
    pub fn parameters(&self) -> usize {
        FRICTION + self.nuisance
    }

    /// Number of samples over all records.
    pub fn samples(&self) -> usize {
        self.records.iter().map(|r| r.t.len()).sum()
    }

    /// Friction law of a parameter vector, in SI units.
    pub fn friction(&self, p: &[f64]) -> DoubleTanh {
        let (fs, vs) = (self.torque_scale, self.velocity_scale);
        DoubleTanh {
            viscous: p[0] * fs / vs,
            coulomb_1: p[1] * fs,
            coulomb_2: p[2] * fs,
            slope_1: p[3].exp() / vs,
            slope_2: p[4].exp() / vs,
        }
    }

    /// Filter coordinates of a friction law; slopes are clamped into the range.
    pub fn coordinates(&self, law: &DoubleTanh, p: &mut [f64]) {
        let (fs, vs) = (self.torque_scale, self.velocity_scale);
        let (lo, hi) = self.slope_range;
        p[0] = law.viscous * vs / fs;
        p[1] = law.coulomb_1 / fs;
        p[2] = law.coulomb_2 / fs;
        p[3] = (law.slope_1.clamp(lo, hi) * vs).ln();
        p[4] = (law.slope_2.clamp(lo, hi) * vs).ln();
    }

    /// d(SI parameter)/d(filter coordinate) for the five friction parameters.
    pub fn jacobian(&self, p: &[f64]) -> [f64; FRICTION] {
        let (fs, vs) = (self.torque_scale, self.velocity_scale);
        [fs / vs, fs, fs, p[3].exp() / vs, p[4].exp() / vs]
    }

    /// Brings slopes back into their range; true where one was outside.
    pub fn clamp(&self, p: &mut [f64]) -> bool {
        let lo = (self.slope_range.0 * self.velocity_scale).ln();
        let hi = (self.slope_range.1 * self.velocity_scale).ln();
        let before = (p[3], p[4]);
        p[3] = p[3].clamp(lo, hi);
        p[4] = p[4].clamp(lo, hi);
        before != (p[3], p[4])
    }
}
