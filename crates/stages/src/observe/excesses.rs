//! From external torques of an untouched robot to deviations and thresholds.

use crate::band::quantile;
use cft_ident_files::config::held_out::{HeldOut, TorqueExcesses};

/// Samples of a period of the cut-off that are kept.
pub const KEPT: f64 = 20.0;
/// Clusters from which on a law of excesses has a shape.
const MIN_CLUSTERS_WITH_SHAPE: usize = 50;
/// Clusters that a level has, if it can.
const USUAL_CLUSTERS: usize = 40;
/// Levels to try: shares of the samples below.
const LEVELS: [f64; 6] = [0.995, 0.99, 0.98, 0.96, 0.93, 0.9];
/// Peaks that are kept at most.
const MAX_PEAKS: usize = 256;
/// Share of the external torques' mean square that the parameters' deviation leaves at least.
const MIN_VARIANCE_SHARE: f64 = 0.04;
/// Samples that a deviation of its own takes.
const MIN_SAMPLES: usize = 40;

/// Time without an excess that ends a cluster or an alarm \[s\].
pub fn hold_s(cutoff_hz: f64) -> f64 {
    2.0 / cutoff_hz
}

/// External torques and speeds of one sample, and whether one went before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuietSample<'a> {
    pub t: f64,
    pub begins: bool,
    pub external: &'a [f64],
    pub speed: &'a [f64],
    /// Variance of the model's torque by its parameters \[N^2 or Nm^2\].
    pub variance: &'a [f64],
}

/// External torques of a robot that nothing touched: hundreds of thousands, of which seven digits are enough.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QuietTorques {
    /// Time since the sample before \[s\], infinite where none goes before.
    gaps: Vec<f64>,
    /// External torques, speeds and variances of each sample.
    numbers: Vec<f32>,
    /// Time of the last sample \[s\].
    last: f64,
    /// From one to the next \[s\].
    pub step_s: f64,
}

/// External torques of one row of an untouched robot.
#[derive(Clone, Copy)]
struct QuietRow<'a> {
    gap: f64,
    numbers: &'a [f32],
}

impl QuietRow<'_> {
    /// Of a joint: external torque, speed, variance.
    fn of(&self, j: usize) -> [f64; 3] {
        let n = self.numbers.len() / 3;
        [0, 1, 2].map(|kind| f64::from(self.numbers[kind * n + j]))
    }

    /// External torque of a joint over its deviation.
    fn share(&self, j: usize, held: &HeldOut) -> f64 {
        let [external, speed, variance] = self.of(j);
        external.abs() / held.external_std(speed, variance)
    }
}

impl QuietTorques {
    pub fn push(&mut self, sample: QuietSample) {
        self.gaps.push(match sample.begins {
            true => f64::INFINITY,
            false => sample.t - self.last,
        });
        self.last = sample.t;
        for numbers in [sample.external, sample.speed, sample.variance] {
            self.numbers.extend(numbers.iter().map(|x| *x as f32));
        }
    }

    fn samples(&self) -> impl Iterator<Item = QuietRow<'_>> + Clone {
        let width = self.numbers.len() / self.gaps.len().max(1);
        let rows = self.numbers.chunks_exact(width.max(1));
        let each = self.gaps.iter().zip(rows);
        each.map(|(gap, numbers)| QuietRow { gap: *gap, numbers })
    }

    /// Completes what was held out with deviations of external torques; excesses where there are enough samples.
    pub fn learn(
        &self,
        held: &mut [HeldOut],
        cutoff_hz: f64,
        position_cutoff_hz: f64,
    ) -> Option<TorqueExcesses> {
        if self.gaps.len() < MIN_SAMPLES {
            return None;
        }
        for (j, held) in held.iter_mut().enumerate() {
            let squares = |range: Option<usize>| {
                let within = |[_, speed, _]: &[f64; 3]| {
                    let below = |edge: &&f64| *speed > **edge;
                    let at = held.speed_edges.iter().take_while(below).count();
                    range.is_none_or(|range| range == at)
                };
                let chosen = self.samples().map(|s| s.of(j)).filter(within);
                let add = |(sum, own, n): (f64, f64, usize), [x, _, variance]: [f64; 3]| {
                    (sum + x * x, own + x * x - variance, n + 1)
                };
                let (sum, own, count) = chosen.fold((0.0, 0.0, 0), add);
                // what the parameters' deviation leaves, of which something always is there
                (own.max(MIN_VARIANCE_SHARE * sum), count)
            };
            let (all, count) = squares(None);
            let all = (all / count as f64).sqrt().max(f64::MIN_POSITIVE);
            let each = (0..=held.speed_edges.len()).map(|range| match squares(Some(range)) {
                (sum, count) if count >= MIN_SAMPLES && sum > 0.0 => (sum / count as f64).sqrt(),
                _ => all,
            });
            held.external_std = each.collect();
            let mut shares: Vec<f64> = self.samples().map(|s| s.share(j, held)).collect();
            held.external_99 = quantile(&mut shares, 0.99).max(f64::MIN_POSITIVE);
        }
        let greatest = |s: QuietRow| {
            let each = held.iter().enumerate().map(|(j, held)| {
                let [external, speed, variance] = s.of(j);
                external.abs() / (held.external_std(speed, variance) * held.external_99)
            });
            each.fold(0.0, f64::max)
        };
        let sizes: Vec<f64> = self.samples().map(greatest).collect();
        let mut sorted = sizes.clone();
        let tried = LEVELS.map(|p| {
            let level = quantile(&mut sorted, p);
            (level, self.peaks(&sizes, level, hold_s(cutoff_hz)))
        });
        let usual = |(_, peaks): &&(f64, Vec<f64>)| peaks.len() >= USUAL_CLUSTERS;
        let most = || tried.iter().max_by_key(|(_, peaks)| peaks.len());
        let (level, peaks) = tried.iter().find(usual).or_else(most)?;
        if peaks.is_empty() || *level <= 0.0 {
            return None;
        }
        let (scale, shape) = pareto(peaks.iter().map(|peak| peak - level).collect());
        let mut largest = peaks.clone();
        largest.sort_by(|a, b| b.total_cmp(a));
        largest.truncate(MAX_PEAKS);
        Some(TorqueExcesses {
            observed_s: self.gaps.len() as f64 * self.step_s,
            position_cutoff_hz,
            level: *level,
            clusters: peaks.len() as u64,
            scale,
            shape,
            largest,
        })
    }

    /// The greatest size of each cluster beyond a level.
    fn peaks(&self, sizes: &[f64], level: f64, hold_s: f64) -> Vec<f64> {
        let mut peaks: Vec<f64> = Vec::new();
        let mut since = f64::INFINITY;
        for (s, size) in self.samples().zip(sizes) {
            since += s.gap;
            if *size <= level {
                continue;
            }
            match peaks.last_mut() {
                Some(peak) if since <= hold_s => *peak = peak.max(*size),
                _ => peaks.push(*size),
            }
            since = 0.0;
        }
        peaks
    }
}

/// Scale and shape of their Pareto law by weighted moments (Hosking and Wallis 1987); shape 0 where they are few.
fn pareto(mut x: Vec<f64>) -> (f64, f64) {
    x.sort_by(f64::total_cmp);
    let n = x.len() as f64;
    let mean = x.iter().sum::<f64>() / n;
    let mean = mean.max(1e-6);
    if x.len() < MIN_CLUSTERS_WITH_SHAPE {
        return (mean, 0.0);
    }
    let above = |(i, x): (usize, &f64)| (n - 1.0 - i as f64) / (n - 1.0) * x;
    let weighted = x.iter().enumerate().map(above).sum::<f64>() / n;
    // their k is the negative of the shape here
    let k = mean / (mean - 2.0 * weighted) - 2.0;
    let shape = (-k).clamp(-0.3, 0.3);
    // the mean is scale / (1 - shape)
    (mean * (1.0 - shape), shape)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that are one after the other in a fixed, disorderly way, 0..1.
    fn uniform(k: usize) -> f64 {
        ((k * 7919 + 13) % 100_003) as f64 / 100_003.0
    }

    #[test]
    fn a_pareto_law_is_found_again() {
        for (scale, shape) in [(0.4, 0.0), (0.3, -0.2), (1.5, 0.15)] {
            let draw = |k: usize| {
                let u: f64 = 1.0 - uniform(k);
                match shape == 0.0 {
                    true => -scale * u.ln(),
                    false => scale * (u.powf(-shape) - 1.0) / shape,
                }
            };
            let (s, x) = pareto((0..5000).map(draw).collect());
            assert!((s / scale - 1.0).abs() < 0.05, "{s} {scale}");
            assert!((x - shape).abs() < 0.05, "{x} {shape}");
        }
    }

    #[test]
    fn the_threshold_is_crossed_as_often_as_was_stated() {
        // bursts of 10 samples whose sizes have exponential tails, one joint, 100 Hz
        let burst = |k: usize| -(1.0 - uniform(k / 10)).ln();
        let mut quiet = QuietTorques {
            step_s: 0.01,
            ..QuietTorques::default()
        };
        for k in 0..200_000 {
            let external = match k % 100 < 10 {
                true => burst(k / 10 * 10),
                false => 0.01,
            };
            quiet.push(QuietSample {
                t: k as f64 * 0.01,
                begins: k == 0,
                external: &[external],
                speed: &[0.1],
                variance: &[0.0],
            });
        }
        let mut held = [HeldOut {
            joint: "a".to_owned(),
            ..HeldOut::default()
        }];
        let law = quiet.learn(&mut held, 10.0, 60.0).unwrap();
        assert!((law.observed_s - 2000.0).abs() < 1e-6);
        // one burst a second: 3600 an hour, of which the share beyond x is e^-x
        for per_hour in [60.0, 150.0] {
            let wanted = (3600.0f64 / per_hour).ln();
            let found = law.threshold(per_hour) * held[0].external_std[0] * held[0].external_99;
            assert!((found - wanted).abs() < 0.15 * wanted, "{found} {wanted}");
        }
    }
}
