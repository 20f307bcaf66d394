//! Prediction bands of torques: noise, the parameters' deviations, and the model's own error as data show
//! it that were set aside.
//!
//! `without_each` moves a model's linear parameters to what the logs say without each of some blocks; what
//! those models leave in the block that they did not see is an error of prediction, and its quantiles are the
//! band (split conformal prediction: Papadopoulos et al. 2002; Lei et al. 2018; blocks, as errors of
//! neighbouring samples are alike: Chernozhukov, Wuthrich and Zhu 2018). They are kept by ranges of speed and
//! of the model's torque. Half the width at a sample is sqrt(h^2 + 1.96^2 g'Cg), g the torque's gradient by the
//! parameters, C their covariance: h is the quantile of sqrt(e^2 - 1.96^2 g'Cg), so that the band holds what
//! it is asked to where data were and widens where parameters are used that the data hardly determine.

mod directions;
mod folds;
mod quantiles;

pub(crate) use directions::{Direction, Directions};
pub(crate) use folds::{Folds, FreeColumns, without_each};
pub(crate) use quantiles::{Error, held_out, quantile};

pub use cft_ident_core::robot::deviation::{Deviation, NORMAL_95};
use cft_ident_core::robot::model::Model;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::held_out::HeldOut;

/// The band of a model that knows what it left of data set aside.
pub struct Band<'a> {
    deviation: Deviation<'a>,
    held: &'a [HeldOut],
}

impl<'a> Band<'a> {
    /// None where the file does not hold what it takes.
    pub fn new(file: &'a ModelFile, model: &'a Model) -> Option<Self> {
        (file.held_out.len() == model.robot.joints()).then(|| Self {
            deviation: Deviation::new(&file.model_covariance(model), model),
            held: &file.held_out,
        })
    }

    /// What was seen of each joint.
    pub fn held(&self) -> &'a [HeldOut] {
        self.held
    }

    /// Half the width of every joint's 95 % band at q, v, a, where the model's torque is `tau`.
    pub fn half_widths(&self, motion: [&[f64]; 3], tau: &[f64], out: &mut [f64]) {
        self.deviation.variances(motion, out);
        for (j, (out, held)) in out.iter_mut().zip(self.held).enumerate() {
            let own = held.half_width(motion[1][j], tau[j]);
            *out = (own * own + NORMAL_95 * NORMAL_95 * *out).sqrt();
        }
    }
}

/// A joint that leaves what its model was fitted on: what it takes up, then what was seen, where that is less.
#[derive(Debug, Clone, PartialEq)]
pub struct BeyondSeen {
    pub joint: String,
    /// Share of the samples.
    pub share: f64,
    /// Greatest speeds \[m/s or rad/s\].
    pub speed: Option<[f64; 2]>,
    /// Greatest torques \[N or Nm\].
    pub torque: Option<[f64; 2]>,
    /// Ends of the ranges of positions \[m or rad\].
    pub positions: Option<[[f64; 2]; 2]>,
}

/// Ranges that a motion takes up, beside those that a model was fitted and tried in.
pub struct Reach<'a> {
    held: &'a [HeldOut],
    /// Greatest speed and torque, least and greatest position of each joint.
    seen: Vec<[f64; 4]>,
    samples: u64,
    /// Samples beyond, of each joint.
    beyond: Vec<u64>,
}

/// Share by which a motion may go beyond what was seen before it is reported.
const BEYOND_SEEN_SHARE: f64 = 0.05;

impl<'a> Reach<'a> {
    pub fn new(held: &'a [HeldOut]) -> Self {
        Self {
            held,
            seen: vec![[0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY]; held.len()],
            samples: 0,
            beyond: vec![0; held.len()],
        }
    }

    /// Takes a sample with the model's torque.
    pub fn take(&mut self, q: &[f64], v: &[f64], tau: &[f64]) {
        self.samples += 1;
        for (j, held) in self.held.iter().enumerate() {
            let seen = &mut self.seen[j];
            seen[0] = seen[0].max(v[j].abs());
            seen[1] = seen[1].max(tau[j].abs());
            seen[2] = seen[2].min(q[j]);
            seen[3] = seen[3].max(q[j]);
            let [low, high] = held.positions_seen;
            let room = BEYOND_SEEN_SHARE * (high - low);
            let out = v[j].abs() > (1.0 + BEYOND_SEEN_SHARE) * held.speed_seen
                || tau[j].abs() > (1.0 + BEYOND_SEEN_SHARE) * held.torque_seen
                || q[j] < low - room
                || q[j] > high + room;
            self.beyond[j] += u64::from(out);
        }
    }

    /// The joints that leave what was seen of them.
    pub fn beyond(&self) -> Vec<BeyondSeen> {
        let more = |x: f64, seen: f64| (x > (1.0 + BEYOND_SEEN_SHARE) * seen).then_some([x, seen]);
        let of = |(j, held): (usize, &HeldOut)| {
            let [speed, torque, low, high] = self.seen[j];
            let [from, to] = held.positions_seen;
            let room = BEYOND_SEEN_SHARE * (to - from);
            let outside = low < from - room || high > to + room;
            (self.beyond[j] > 0).then(|| BeyondSeen {
                joint: held.joint.clone(),
                share: self.beyond[j] as f64 / self.samples as f64,
                speed: more(speed, held.speed_seen),
                torque: more(torque, held.torque_seen),
                positions: outside.then_some([[low, high], [from, to]]),
            })
        };
        self.held.iter().enumerate().filter_map(of).collect()
    }
}
