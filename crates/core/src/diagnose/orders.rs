//! Peaks of the residual's spectrum over position, from which ripples and position-dependent
//! friction start: of the raw residual, for a ripple dies in a decimating filter, and of the
//! filtered one at full rate, where a strong order beyond the band does not hide a weaker one in it.

use crate::effect::{JointCover, LogCoverage};
use crate::motion::{MotionError, ParallelFilters, Stretch};
use crate::robot::JointKind;

/// Bins over the travel.
const BINS: usize = 4096;
/// Spacing of the orders that are looked at, over 1/travel.
const SPACING: f64 = 0.25;
/// Peaks kept of each spectrum.
const PEAKS: usize = 6;
/// Least waves over the travel.
const MIN_WAVES: f64 = 1.5;

/// Fills the orders of a cover from the raw residuals of a model, `[stretch][joint][sample]`.
pub fn find(
    cover: &mut LogCoverage,
    residuals: &[Vec<Vec<f64>>],
    stretches: &[Stretch],
    filters: &ParallelFilters,
) -> Result<(), MotionError> {
    for j in 0..cover.joints.len() {
        let range = cover.joints[j].range();
        if range <= 0.0 {
            continue;
        }
        let raw: Vec<Vec<f64>> = residuals.iter().map(|r| r[j].clone()).collect();
        let mut filtered = raw.clone();
        for (channel, stretch) in filtered.iter_mut().zip(stretches) {
            filters.of(stretch).smooth(channel)?;
        }
        let per_range = match cover.kinds[j] {
            JointKind::Revolute => std::f64::consts::TAU / range,
            JointKind::Prismatic => 1.0 / range,
        };
        let [mut plain, mut flipped, mut loaded] = [(); 3].map(|()| Vec::new());
        for residual in [&filtered, &raw] {
            let [as_is, signed, by_torque, count] =
                binned(&cover.joints[j], j, stretches, residual);
            plain.extend(peaks(&as_is, &count));
            flipped.extend(peaks(&signed, &count));
            loaded.extend(peaks(&by_torque, &count));
        }
        let orders = |mut waves: Vec<f64>| -> Vec<f64> {
            waves.sort_by(f64::total_cmp);
            waves.dedup();
            waves.into_iter().map(|w| w * per_range).collect()
        };
        cover.joints[j].ripple_orders = orders(plain);
        cover.joints[j].friction_orders = orders(flipped);
        cover.joints[j].torque_orders = orders(loaded);
    }
    Ok(())
}

/// A residual summed over position: as it is, times the sign of the speed and times that of the torque, and the number
/// of its rows.
fn binned(
    joint: &JointCover,
    j: usize,
    stretches: &[Stretch],
    residual: &[Vec<f64>],
) -> [Vec<f64>; 4] {
    let (low, range) = (joint.position[0], joint.range());
    let slow = 0.02 * joint.speed_rms;
    let mut bins = [(); 4].map(|()| vec![0.0; BINS]);
    for (s, e) in stretches.iter().zip(residual) {
        let rows = s.q[j].iter().zip(&s.v[j]).zip(&s.tau[j]).zip(e);
        for (((q, v), tau), e) in rows.filter(|(((_, v), _), _)| v.abs() > slow) {
            let bin = (((q - low) / range * BINS as f64) as usize).min(BINS - 1);
            let row = [*e, e * v.signum(), e * tau.signum(), 1.0];
            bins.iter_mut()
                .zip(row)
                .for_each(|(sums, x)| sums[bin] += x);
        }
    }
    bins
}

/// Orders that are summed side by side.
const LANES: usize = 8;

/// Power of a binned signal at `LANES` orders from the given one on.
fn powers(free: &[f64], first: usize) -> [f64; LANES] {
    let step = std::array::from_fn::<_, LANES, _>(|l| {
        let waves = (first + l) as f64 * SPACING;
        (std::f64::consts::TAU * waves / free.len() as f64).sin_cos()
    });
    // rotation from bin to bin instead of a sine each
    let (mut c, mut s) = ([1.0; LANES], [0.0; LANES]);
    let (mut re, mut im) = ([0.0; LANES], [0.0; LANES]);
    for x in free {
        for l in 0..LANES {
            re[l] += c[l] * x;
            im[l] += s[l] * x;
            let (sin, cos) = step[l];
            (c[l], s[l]) = (c[l] * cos - s[l] * sin, s[l] * cos + c[l] * sin);
        }
    }
    std::array::from_fn(|l| re[l] * re[l] + im[l] * im[l])
}

/// Waves over the travel at the highest peaks of a binned signal's spectrum.
fn peaks(sums: &[f64], count: &[f64]) -> Vec<f64> {
    let bins = sums.len();
    let (total, rows) = (sums.iter().sum::<f64>(), count.iter().sum::<f64>());
    if rows <= 0.0 {
        return Vec::new();
    }
    let mean = total / rows;
    let free: Vec<f64> = sums.iter().zip(count).map(|(s, c)| s - mean * c).collect();
    let last = (bins as f64 / 8.0 / SPACING) as usize;
    let power = (0..last).step_by(LANES);
    let power = power.flat_map(|first| powers(&free, first)).take(last);
    let power: Vec<f64> = power.collect();
    let first = (MIN_WAVES / SPACING) as usize;
    let is_peak = |i: &usize| {
        let i = *i;
        power[i] >= power[i - 1] && power[i] >= power[i + 1] || i == first
    };
    let mut found: Vec<usize> = (first.max(1)..last.saturating_sub(1))
        .filter(is_peak)
        .collect();
    found.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    found.truncate(PEAKS);
    found.iter().map(|i| *i as f64 * SPACING).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_peak_is_the_wave_that_is_there() {
        for waves in [3.0f64, 17.25, 120.0] {
            let bins = 4096;
            let count = vec![5.0; bins];
            let sum = |b| {
                let x = f64::from(b) / bins as f64;
                5.0 * (std::f64::consts::TAU * waves * x + 0.4).sin() + 2.0
            };
            let sums: Vec<f64> = (0..bins as u32).map(sum).collect();
            let found = peaks(&sums, &count)[0];
            assert!((found - waves).abs() <= SPACING, "{found} {waves}");
        }
    }
}
