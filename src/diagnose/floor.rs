//! The noise floor: how much of a filtered residual is noise that no model could explain.
//!
//! Just above the band that is kept, the residual holds nothing but noise: a band from 1.5 to 3 times
//! the cut-off is looked at, block by block, and the median of the blocks is not moved by
//! reversals. The top of the spectrum, by fourth differences, is looked at too, and the lower of the
//! two counts: orders of a ripple beyond the band, and torque that the position filter keeps the
//! model from following, are no noise. Noise that falls towards high frequency is underrated, and
//! then some of it is called structure: the safe side.

use crate::math::sos::Sos;
use crate::math::zero_phase::ZeroPhase;
use crate::motion::{MotionError, Parallel, Stretch};

/// Borders of the band that is looked at, over the cut-off.
const BAND: [f64; 2] = [1.5, 3.0];

/// Variance of the filtered noise per joint, from raw residuals `[stretch][joint][sample]`. `averaged`
/// where each torque is the mean of two rows, as of commands that are held.
///
/// # Errors
/// [`MotionError`] of the filters.
pub fn floor(
    residuals: &[Vec<Vec<f64>>],
    stretches: &[Stretch],
    parallel: &Parallel,
    cutoff_hz: f64,
    averaged: bool,
    held: &[Vec<bool>],
) -> Result<Vec<f64>, MotionError> {
    let joints = stretches.first().map_or(0, Stretch::joints);
    let rate = 1.0 / stretches.first().map_or(1.0, |s| s.dt);
    let low_pass = |times: f64| -> Result<ZeroPhase, MotionError> {
        let cutoff = (times * cutoff_hz).min(0.45 * rate * times / BAND[1]);
        Ok(ZeroPhase::new(Sos::butterworth(4, cutoff, rate)?))
    };
    let (lower, upper) = (low_pass(BAND[0])?, low_pass(BAND[1])?);
    let band = |x: &[f64]| -> Result<Vec<f64>, MotionError> {
        let (mut below, mut all) = (x.to_vec(), x.to_vec());
        lower.run(&mut below, 1)?;
        upper.run(&mut all, 1)?;
        Ok(all.iter().zip(&below).map(|(a, b)| a - b).collect())
    };
    let length = 2 * parallel.trim.max(500) + 1;
    let mut impulse = vec![0.0; length];
    impulse[length / 2] = 1.0;
    let power = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let seen = power(&band(&impulse)?);
    parallel.smooth(&mut impulse)?;
    let kept = power(&impulse);

    // a block is some periods of the band long
    let block = ((4.0 / cutoff_hz * rate).ceil() as usize).max(64);
    // A white signal's fourth difference has 1 + 16 + 36 + 16 + 1 = 70 times its variance; of the mean
    // of two neighbours, (1 + 9 + 4 + 4 + 9 + 1) / 4 = 7 times.
    let gain = if averaged { 7.0 } else { 70.0 };
    let mut floor = Vec::with_capacity(joints);
    for j in 0..joints {
        let middle = |x: &[f64]| {
            let blocks = x.chunks_exact(block).map(|b| power(b) / block as f64);
            median(&mut blocks.collect::<Vec<f64>>())
        };
        // logs differ in their noise: each has its own, and they count by their rows
        let (mut sum, mut rows) = (0.0, 0.0);
        // friction at rest is no noise; a joint that never moves has nothing else
        let always = held.iter().all(|h| h[j]);
        let moving = residuals.iter().zip(held).filter(|(_, h)| always || !h[j]);
        for (residual, _) in moving {
            let banded = band(&residual[j])?;
            let edge = parallel.trim.min(banded.len() / 4);
            let near = middle(&banded[edge..banded.len() - edge]);
            let differences: Vec<f64> = residual[j]
                .windows(5)
                .map(|w| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4])
                .collect();
            let weight = residual[j].len() as f64;
            sum += weight * (near / seen).min(middle(&differences) / gain);
            rows += weight;
        }
        floor.push(if rows > 0.0 { kept * sum / rows } else { 0.0 });
    }
    Ok(floor)
}

/// Middle value; 0 of nothing.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Settings;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn white_noise_is_its_own_floor_and_a_smooth_residual_adds_nothing() {
        let parallel = Parallel::design(&Settings::default(), 1e-3).unwrap();
        let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let n = 40_000;
        let mut normal = || -> f64 { (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0 };
        let noise: Vec<f64> = (0..n).map(|_| 0.3 * normal()).collect();
        let stretch = Stretch {
            dt: 1e-3,
            q: vec![vec![0.0; n]],
            t: vec![0.0; n],
            ..Stretch::default()
        };
        let mut filtered = noise.clone();
        parallel.smooth(&mut filtered).unwrap();
        let seen = filtered[500..n - 500].iter().map(|x| x * x).sum::<f64>() / (n - 1000) as f64;
        let smooth: Vec<f64> = noise
            .iter()
            .enumerate()
            .map(|(k, x)| x + 2.0 * (0.02 * k as f64).sin())
            .collect();
        for raw in [noise, smooth] {
            let found = floor(
                &[vec![raw]],
                std::slice::from_ref(&stretch),
                &parallel,
                10.0,
                false,
                &[vec![false]],
            )
            .unwrap()[0];
            assert!((found / seen - 1.0).abs() < 0.15, "{found} {seen}");
        }
    }
}
