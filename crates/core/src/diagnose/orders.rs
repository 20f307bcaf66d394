//! Peaks of the residual's spectrum over position, from which ripples and position-dependent
//! friction start: of the raw residual, for a ripple dies in a decimating filter, and of the
//! filtered one at full rate, where a strong order beyond the band does not hide a weaker one in it.

use crate::effect::{Cover, JointCover};
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
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn find(
    cover: &mut Cover,
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
        let (mut plain, mut flipped) = (Vec::new(), Vec::new());
        for residual in [&filtered, &raw] {
            let bins = Binned::of(&cover.joints[j], j, stretches, residual);
            plain.extend(peaks(&bins.plain, &bins.count));
            flipped.extend(peaks(&bins.flipped, &bins.count));
        }
        let orders = |mut waves: Vec<f64>| -> Vec<f64> {
            waves.sort_by(f64::total_cmp);
            waves.dedup();
            waves.into_iter().map(|w| w * per_range).collect()
        };
        cover.joints[j].ripple_orders = orders(plain);
        cover.joints[j].friction_orders = orders(flipped);
    }
    Ok(())
}

/// A residual summed over position, as it is and times the sign of the speed.
struct Binned {
    plain: Vec<f64>,
    flipped: Vec<f64>,
    count: Vec<f64>,
}

impl Binned {
    fn of(joint: &JointCover, j: usize, stretches: &[Stretch], residual: &[Vec<f64>]) -> Self {
        let (low, range) = (joint.position[0], joint.range());
        let slow = 0.02 * joint.speed_rms;
        let mut bins = Binned {
            plain: vec![0.0; BINS],
            flipped: vec![0.0; BINS],
            count: vec![0.0; BINS],
        };
        for (s, e) in stretches.iter().zip(residual) {
            for ((q, v), e) in s.q[j].iter().zip(&s.v[j]).zip(e) {
                if v.abs() <= slow {
                    continue;
                }
                let bin = (((q - low) / range * BINS as f64) as usize).min(BINS - 1);
                bins.plain[bin] += e;
                bins.flipped[bin] += e * v.signum();
                bins.count[bin] += 1.0;
            }
        }
        bins
    }
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
    let power: Vec<f64> = (0..last)
        .step_by(LANES)
        .flat_map(|first| powers(&free, first))
        .take(last)
        .collect();
    let first = (MIN_WAVES / SPACING) as usize;
    let mut found: Vec<(f64, f64)> = (first.max(1)..last.saturating_sub(1))
        .filter(|&i| power[i] >= power[i - 1] && power[i] >= power[i + 1] || i == first)
        .map(|i| (power[i], i as f64 * SPACING))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(PEAKS);
    found.into_iter().map(|(_, waves)| waves).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_peak_is_the_wave_that_is_there() {
        for waves in [3.0f64, 17.25, 120.0] {
            let bins = 4096;
            let count = vec![5.0; bins];
            let sums: Vec<f64> = (0..bins)
                .map(|b| {
                    let x = b as f64 / bins as f64;
                    5.0 * (std::f64::consts::TAU * waves * x + 0.4).sin() + 2.0
                })
                .collect();
            let found = peaks(&sums, &count)[0];
            assert!((found - waves).abs() <= SPACING, "{found} {waves}");
        }
    }
}
