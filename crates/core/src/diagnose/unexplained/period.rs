//! Repeated periods of a motion: what a residual does not repeat from one to the next is noise, whatever
//! its spectrum, and what it does repeat is structure or the rounding of encoders.

use std::ops::Range;

/// Positions at which the lags are first looked at, at most.
const COARSE: usize = 2048;
/// Shortest period over a log's length.
const SHORTEST: f64 = 0.02;
/// Mean square of what a joint does not repeat over its variance: one per cent of its travel.
const REPEATS: f64 = 1e-4;

/// Samples of one period of a motion, `[joint][sample]`, that comes at least twice; joints that do not move have no say.
pub fn period(q: &[Vec<f64>]) -> Option<usize> {
    let samples = q.first()?.len();
    let step = samples.div_ceil(COARSE).max(1);
    let mut moving: Vec<(&Vec<f64>, f64)> = q.iter().map(|q| (q, variance(q))).collect();
    // a stationary joint's play is no motion
    let least = 1e-4 * moving.iter().map(|(_, v)| *v).fold(0.0, f64::max);
    moving.retain(|(_, v)| *v > least);
    if moving.is_empty() {
        return None;
    }
    let off = |lag: usize, stride: usize| {
        let of = |(q, variance): &(&Vec<f64>, f64)| apart(q, lag, stride) / variance;
        moving.iter().map(of).fold(0.0, f64::max)
    };
    let first = ((SHORTEST * samples as f64) as usize).max(2 * step);
    let lags: Vec<usize> = (first..=samples / 2).step_by(step).collect();
    let coarse: Vec<f64> = lags.iter().map(|&lag| off(lag, step)).collect();
    // the first lag in a valley that is deep enough, looked at again sample by sample
    let valley = |i: usize| {
        let side = |k: Option<usize>| k.and_then(|k| coarse.get(k)).copied();
        let lower = |k| side(k).is_none_or(|x| coarse[i] <= x);
        lower(i.checked_sub(1)) && lower(i.checked_add(1))
    };
    let valleys = (0..lags.len()).filter(|&i| valley(i));
    let mut fine = valleys.map(|i| {
        let around = lags[i].saturating_sub(step)..=(lags[i] + step).min(samples / 2);
        let found = around.map(|lag| (off(lag, step), lag));
        let least = found.min_by(|a, b| a.0.total_cmp(&b.0));
        least.unwrap_or((f64::INFINITY, 0))
    });
    fine.find(|(off, _)| *off < REPEATS).map(|(_, lag)| lag)
}

/// Variance of what a signal does not repeat over whole periods of `rows`; none with fewer than two of them.
pub(crate) fn unrepeated(signal: &[f64], rows: Range<usize>, period: usize) -> Option<f64> {
    let signal = signal.get(rows)?;
    let count = signal.len().checked_div(period)?;
    if count < 2 {
        return None;
    }
    let mut sum = 0.0;
    for k in 0..period {
        let values = || (0..count).map(|p| signal[p * period + k]);
        let mean = values().sum::<f64>() / count as f64;
        sum += values().map(|x| (x - mean).powi(2)).sum::<f64>();
    }
    Some(sum / ((count - 1) * period) as f64)
}

fn variance(x: &[f64]) -> f64 {
    let n = x.len().max(1) as f64;
    let mean = x.iter().sum::<f64>() / n;
    x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n
}

/// Mean square between a signal and itself a lag later.
fn apart(x: &[f64], lag: usize, stride: usize) -> f64 {
    let pairs = x.iter().zip(&x[lag..]).step_by(stride);
    let (sum, count) = pairs.fold((0.0, 0usize), |(s, n), (a, b)| (s + (a - b).powi(2), n + 1));
    sum / count.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::unexplained::normal;

    fn motion(samples: usize, period: f64) -> Vec<Vec<f64>> {
        let wave = |n: f64, phase: f64| {
            let at = move |k: usize| (std::f64::consts::TAU * n * k as f64 / period + phase).sin();
            (0..samples).map(at).collect::<Vec<f64>>()
        };
        let sum = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| a + 0.4 * b).collect();
        vec![
            sum(wave(1.0, 0.3), wave(3.0, 1.0)),
            sum(wave(2.0, 0.1), wave(5.0, 2.0)),
            vec![0.7; samples],
        ]
    }

    #[test]
    fn the_period_of_a_series_is_found_to_a_sample_and_a_sweep_has_none() {
        for wanted in [2500.0, 5003.0] {
            let found = period(&motion(20_000, wanted));
            let found_it = found.is_some_and(|p| p.abs_diff(wanted as usize) <= 1);
            assert!(found_it, "{found:?}");
        }
        // it comes less than twice
        assert_eq!(period(&motion(4000, 2500.0)), None);
        let sweep = (0..20_000).map(|k| (3e-8 * f64::from(k) * f64::from(k)).sin());
        assert_eq!(period(&[sweep.collect()]), None);
    }

    #[test]
    fn what_does_not_repeat_is_the_noise_and_what_repeats_does_not_count() {
        let n = 40_000;
        let mut normal = normal(5);
        let structure = &motion(n, 5000.0)[0];
        let signal: Vec<f64> = structure.iter().map(|s| 3.0 * s + 0.2 * normal()).collect();
        let found = unrepeated(&signal, 100..n - 100, 5000).unwrap();
        assert!((found / 0.04 - 1.0).abs() < 0.03, "{found}");
        assert_eq!(unrepeated(&signal, 0..9000, 5000), None);
    }
}
