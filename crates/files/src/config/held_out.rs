//! What a model left of the torques of data that were set aside: for prediction bands and for alarms.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What was left of one joint's torque in blocks of the logs, by models that were fitted without each block.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeldOut {
    /// Joint.
    pub joint: String,
    /// Samples, each in the block that its model did not see.
    pub samples: u64,
    /// Effective sample size: two a period of the model's cut-off.
    pub effective_samples: f64,
    /// Cut-off of the filter that its positions came through \[Hz\].
    pub position_cutoff_hz: f64,
    /// Between ranges of speed [m/s or rad/s].
    pub speed_edges: Vec<f64>,
    /// Between ranges of the modulus of the model's torque [N or Nm].
    pub torque_edges: Vec<f64>,
    /// Half the width of a band that holds 95 % of the samples, parameters' deviations aside, by ranges of
    /// speed, then of torque [N or Nm].
    pub half_width_95: Vec<Vec<f64>>,
    /// Least and greatest position [m or rad].
    pub positions_seen: [f64; 2],
    /// Greatest speed [m/s or rad/s].
    pub speed_seen: f64,
    /// Greatest acceleration [m/s^2 or rad/s^2].
    #[serde(default = "absent")]
    pub acceleration_seen: f64,
    /// Greatest modulus of the measured torque [N or Nm].
    pub torque_seen: f64,
    /// Standard deviation of the external torque where nothing touched the robot, by ranges of speed, the parameters'
    /// own deviation aside [N or Nm].
    pub external_std: Vec<f64>,
    /// Deviations that 99 % of those external torques stay within.
    pub external_99: f64,
}

/// What stands for a number that version 0.2 did not write.
fn absent() -> f64 {
    f64::NAN
}

impl HeldOut {
    /// Whether version 0.2 wrote it.
    pub(super) fn is_of_0_2(&self) -> bool {
        self.acceleration_seen.is_nan()
    }

    /// The range that a number lies in.
    fn range(edges: &[f64], x: f64) -> usize {
        edges.iter().take_while(|edge| x > **edge).count()
    }

    /// Half the width of the band at a speed and a torque of the model.
    pub fn half_width(&self, speed: f64, torque: f64) -> f64 {
        let row = &self.half_width_95[Self::range(&self.speed_edges, speed.abs())];
        row[Self::range(&self.torque_edges, torque.abs())]
    }

    /// Standard deviation of the external torque at a speed where parameters make the model's torque uncertain by
    /// `variance`.
    pub fn external_std(&self, speed: f64, variance: f64) -> f64 {
        let own = self.external_std[Self::range(&self.speed_edges, speed.abs())];
        (own * own + variance).sqrt()
    }

    /// What does not fit together, where something does not.
    pub(super) fn fault(&self) -> Option<(&'static str, &'static str)> {
        let sizes = |x: &[f64]| x.iter().all(|x| *x >= 0.0 && x.is_finite());
        let edges = |x: &[f64]| sizes(x) && x.windows(2).all(|p| p[0] < p[1]);
        let above = |x: &f64| *x > 0.0 && x.is_finite();
        let (speeds, torques) = (self.speed_edges.len() + 1, self.torque_edges.len() + 1);
        let (rows, external) = (&self.half_width_95, &self.external_std);
        let whole = rows.len() == speeds && rows.iter().all(|row| row.len() == torques);
        let of_speeds = external.len() == speeds && external.iter().all(above);
        let lists =
            "must have one list for each range of speed, with a number for each range of torque";
        let faults = [
            (
                edges(&self.speed_edges),
                "speed_edges",
                "must rise from 0 on",
            ),
            (
                edges(&self.torque_edges),
                "torque_edges",
                "must rise from 0 on",
            ),
            (whole, "half_width_95", lists),
            (
                rows.iter().all(|row| sizes(row)),
                "half_width_95",
                "must be numbers of 0 or more",
            ),
            (
                of_speeds,
                "external_std",
                "must have one number above 0 for each range of speed",
            ),
            (
                above(&self.position_cutoff_hz),
                "position_cutoff_hz",
                "must be above 0",
            ),
            (above(&self.external_99), "external_99", "must be above 0"),
        ];
        let first = faults.into_iter().find(|(right, ..)| !right);
        first.map(|(_, key, problem)| (key, problem))
    }
}

/// How often external torques of an untouched robot go beyond a level: clusters of excesses, and how far the
/// largest of each goes (generalised Pareto law: Pickands 1975; Hosking and Wallis 1987).
///
/// The level and the excesses are of the greatest over joints of |external| / (`external_std` `external_99`).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Excesses")]
pub struct TorqueExcesses {
    /// Time that was observed \[s\].
    pub observed_s: f64,
    /// Cut-off of the filter of positions and torques \[Hz\].
    pub position_cutoff_hz: f64,
    pub level: f64,
    /// Clusters beyond the level.
    pub clusters: u64,
    pub scale: f64,
    pub shape: f64,
    /// The largest of the clusters, from the largest on: what crosses a threshold now and then is counted, and the law
    /// stands for what is rarer. A motion that comes again errs at the same places each time, which no smooth law has.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub largest: Vec<f64>,
}

/// Clusters from which on a threshold is one of them.
const COUNTED: f64 = 5.0;

impl TorqueExcesses {
    /// The threshold that is crossed so often an hour.
    pub fn threshold(&self, per_hour: f64) -> f64 {
        let rate = self.clusters as f64 / self.observed_s * 3600.0;
        if self.clusters == 0 || rate <= per_hour {
            return self.level;
        }
        let expected = per_hour * self.observed_s / 3600.0;
        if let Some(counted) = self.counted(expected.max(COUNTED)) {
            return match expected >= COUNTED {
                true => counted,
                false => counted.max(self.by_law(rate / per_hour)),
            };
        }
        self.by_law(rate / per_hour)
    }

    /// What so many clusters of those observed go beyond; none where fewer are kept.
    fn counted(&self, clusters: f64) -> Option<f64> {
        let (whole, part) = (clusters as usize, clusters.fract());
        let above = self.largest.get(whole.checked_sub(1)?)?;
        let below = self.largest.get(whole)?;
        Some(above + part * (below - above))
    }

    /// The threshold that the law crosses `more` times as rarely as the level.
    fn by_law(&self, more: f64) -> f64 {
        let excess = match self.shape.abs() < 1e-6 {
            true => more.ln(),
            false => (more.powf(self.shape) - 1.0) / self.shape,
        };
        self.level + self.scale * excess
    }

    /// Whether all numbers are possible.
    pub(super) fn is_possible(&self) -> bool {
        let above = |x: f64| x > 0.0 && x.is_finite();
        above(self.observed_s)
            && above(self.position_cutoff_hz)
            && above(self.level)
            && above(self.scale)
            && self.largest.iter().all(|x| above(*x))
            && self.largest.is_sorted_by(|a, b| a >= b)
            && (-1.0..1.0).contains(&self.shape)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thresholds_rise_as_alarms_become_rarer() {
        let mut law = TorqueExcesses {
            observed_s: 1800.0,
            position_cutoff_hz: 60.0,
            level: 0.9,
            clusters: 100,
            scale: 0.1,
            shape: 0.0,
            largest: Vec::new(),
        };
        // 200 an hour beyond the level
        assert_eq!(law.threshold(300.0), 0.9);
        let wanted = 0.9 + 0.1 * (200.0f64 / 60.0).ln();
        assert!((law.threshold(60.0) - wanted).abs() < 1e-12);
        law.shape = -0.2;
        let bounded = law.threshold(60.0);
        assert!(bounded < wanted && bounded > 0.9);
        assert!(law.threshold(1.0) > bounded && law.threshold(1e-9) < 0.9 + 0.1 / 0.2 + 1e-9);
        // 30 of half an hour are 60 an hour, and the law never brings a rarer one below five of half an hour
        law.largest = (0..100).map(|k| 2.0 - 0.01 * f64::from(k)).collect();
        assert!((law.threshold(60.0) - 1.71).abs() < 1e-12);
        assert!((law.threshold(61.0) - 1.705).abs() < 1e-12);
        assert!(law.threshold(1.0) >= law.threshold(10.0) && law.threshold(10.0) == 1.96);
    }

    #[test]
    fn numbers_are_those_of_the_range_that_a_sample_lies_in() {
        let held = HeldOut {
            position_cutoff_hz: 60.0,
            speed_edges: vec![0.1, 0.5],
            torque_edges: vec![4.0],
            half_width_95: vec![vec![1.0, 2.0], vec![3.0, 4.0], vec![5.0, 6.0]],
            external_std: vec![0.1, 0.2, 0.3],
            external_99: 2.5,
            ..HeldOut::default()
        };
        assert_eq!(held.fault(), None);
        assert_eq!(held.half_width(-0.3, -5.0), 4.0);
        assert_eq!(held.half_width(0.05, 1.0), 1.0);
        assert_eq!(held.external_std(-2.0, 0.0), 0.3);
        assert!((held.external_std(-2.0, 0.16) - 0.5).abs() < 1e-15);
        let lacking = HeldOut {
            external_std: vec![0.1],
            ..held
        };
        assert_eq!(lacking.fault().unwrap().0, "external_std");
    }
}
