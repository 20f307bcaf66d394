//! What the filter says of one joint: parameters with verdicts, curve, plateaus, consistency.

use schemars::JsonSchema;
use serde::Serialize;

use super::excitation::SpeedCoverage;
use super::passes::ONE_TERM;
use super::plateau::{MissedPlateau, TorquePlateau, missed};
use super::problem::FRICTION;
use crate::math::descent::IterationEnding;
use crate::robot::friction::DoubleTanh;
use crate::verdict::Verdict;

/// One friction parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EstimatedValue {
    pub value: f64,
    pub std: f64,
    pub verdict: Verdict,
}

/// One point of the friction curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct FrictionCurvePoint {
    /// Velocity [m/s or rad/s].
    pub v: f64,
    /// Friction torque [N or Nm].
    pub torque: f64,
    /// Its standard deviation [N or Nm].
    pub std: f64,
}

/// A nuisance quantity.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Nuisance")]
pub struct NuisanceQuantity {
    pub name: String,
    pub value: f64,
    pub std: f64,
    pub unit: String,
}

/// Normalised innovations squared with their 95 % bounds.
///
/// The noise levels are estimated, so that single innovations have about their own variance under
/// any model. What shows a wrong one is that its innovations are alike: so the mean is over windows
/// of 50 samples, each the square of the window's summed normalised innovations over their number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Nis")]
pub struct NisStatistic {
    /// Mean over windows; 1 where the filter's covariance is true and the innovations are white.
    pub mean: f64,
    /// 95 % bounds of that mean.
    pub lower_95: f64,
    pub upper_95: f64,
    /// Number of windows.
    pub windows: usize,
    /// Mean over single innovations.
    pub per_sample: f64,
    /// Share of single innovations inside their own 95 % bound.
    pub share_inside: f64,
}

impl NisStatistic {
    /// Whether the mean is inside its bounds.
    pub fn consistent(&self) -> bool {
        (self.lower_95..=self.upper_95).contains(&self.mean)
    }
}

/// Friction of one joint with all that belongs to it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct JointEstimate {
    /// How the search ended.
    pub ending: IterationEnding,
    /// Starting points of the search.
    pub starts: usize,
    /// The law at the maximum of the likelihood.
    #[serde(skip)]
    pub law: DoubleTanh,
    /// Bv, Bf1, Bf2, w1, w2 with verdicts; a slope with a bound holds the bound.
    #[serde(skip)]
    pub values: [EstimatedValue; FRICTION],
    /// Covariance of the five parameters in SI units.
    #[serde(skip)]
    pub covariance: [[f64; FRICTION]; FRICTION],
    /// What was estimated along, and is no friction.
    pub nuisance: Vec<NuisanceQuantity>,
    #[serde(flatten)]
    pub speeds: SpeedCoverage,
    /// The law over the speeds covered: 50 equal steps in each direction.
    pub curve: Vec<FrictionCurvePoint>,
    /// The law at speeds that the log does not cover, up to twice the largest of those: a forecast.
    pub curve_beyond: Vec<FrictionCurvePoint>,
    /// Mean torques at constant speed, which took no part in the fit.
    pub plateaus: Vec<TorquePlateau>,
    pub nis: NisStatistic,
    pub noise: FilterNoise,
    /// Factor by which coloured innovations widened the covariance.
    pub widening: f64,
    /// Coulomb terms that the law was given: one where a second makes the log no likelier.
    pub coulomb_terms: usize,
    /// Torque residual along the measured motion [N or Nm].
    pub rmse: f64,
    /// The same relative to the torque.
    pub relative_error: f64,
    /// The same with no friction at all.
    #[serde(skip)]
    pub without_law: f64,
    pub samples: usize,
    /// Cut-offs of the other joints' accelerations [Hz], one per joint; infinite where only the position filter acts.
    #[serde(skip)]
    pub cutoffs: Vec<f64>,
}

/// Sizes of the two Coulomb terms over that of their sum from which they cancel.
const CANCEL: f64 = 4.0;

/// Part of the torque beyond the noise from which on something is said to act. Half: clean logs are told of it at a few
/// thousandths; twice: a ripple of a twentieth is passed over.
const NOTICEABLE: f64 = 0.02;

impl JointEstimate {
    /// Whether the two Coulomb terms are each several times what they leave together.
    pub fn cancels(&self) -> bool {
        let (one, two) = (self.law.coulomb_1, self.law.coulomb_2);
        one.abs() + two.abs() > CANCEL * (one + two).abs()
    }

    /// Part of the torque that the innovations hold beyond the noise, where that is more than chance and what one would
    /// notice.
    pub fn lacking(&self) -> Option<f64> {
        let beyond = (1.0 - 1.0 / self.nis.mean).max(0.0).sqrt() * self.relative_error;
        (self.nis.mean > self.nis.upper_95 && beyond > NOTICEABLE).then_some(beyond)
    }

    /// Power that the friction takes from the joint, in the mean over the curve [W].
    pub fn power(&self) -> f64 {
        let power = self.curve.iter().map(|p| p.v * p.torque);
        power.sum::<f64>() / self.curve.len().max(1) as f64
    }

    /// The slowest speed covered at which the friction drives the joint, beyond its 95 % band.
    pub fn drives_at(&self) -> Option<f64> {
        let below = |p: &&FrictionCurvePoint| p.torque * p.v.signum() < -1.96 * p.std;
        let speeds = self.curve.iter().filter(below).map(|p| p.v);
        speeds.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    }

    /// Half the 95 % band of the curve over its torque, the largest over the speeds covered.
    pub fn curve_uncertainty(&self) -> f64 {
        let share = |p: &FrictionCurvePoint| 1.96 * p.std / p.torque.abs();
        self.curve.iter().map(share).fold(0.0, f64::max)
    }

    /// Whether parameter `k` belongs to a second Coulomb term that the law was not given.
    pub fn one_term_lacks(&self, k: usize) -> bool {
        self.coulomb_terms == 1 && ONE_TERM.contains(&k)
    }

    /// Speeds at which the curve misses the plateaus' mean torque.
    pub fn missed_plateaus(&self) -> Vec<MissedPlateau> {
        missed(&self.plateaus, &|v| self.law.torque(v))
    }
}

/// Noise levels that the filter settled on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct FilterNoise {
    /// Standard deviation of the torque noise [N or Nm].
    pub torque_std: f64,
    /// Factor on the encoder's variance.
    pub position_variance_factor: f64,
}
