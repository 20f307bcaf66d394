//! The noise floor: how much of a filtered residual is noise that no model could explain.
//!
//! Where a log repeats its motion, what the filtered residual does not repeat is noise; so is the rounding of
//! the encoders, which it may repeat. Otherwise, and where it says less: just above the band that is kept, the
//! residual holds nothing but noise. Two bands from 1.5 to 3 times the cut-off are looked at, block by block,
//! and the median of the blocks is not moved by reversals. Two, for noise has two sources: of the torque,
//! white, and of the encoder by way of the acceleration, which rises with the fourth power of the frequency;
//! carried on into the band as if it were white, it would hide what is there. The top of the spectrum, by
//! fourth differences, is looked at too, and the lowest counts: orders of a ripple beyond the band, and torque
//! that the position filter keeps the model from following, are no noise. Noise that falls towards high
//! frequency is underrated, and then some of it is called structure: the safe side.

use super::period::{period, unrepeated};
use crate::diagnose::problem::case::DiagnosisCase;
use crate::effect::stationary_joints;
use crate::math::sos::SosFilter;
use crate::math::zero_phase::ZeroPhase;
use crate::motion::{FilterDesign, MotionError, ParallelFilters, Stretch};

/// Borders of the bands that are looked at, over the cut-off.
const BORDERS: [f64; 3] = [1.5, 2.25, 3.0];

/// Variance of the filtered noise per joint, from raw residuals `[stretch][joint][sample]` along some stretches.
pub fn floor(
    case: &DiagnosisCase,
    residuals: &[Vec<Vec<f64>>],
    stretches: &[Stretch],
) -> Result<Vec<f64>, MotionError> {
    let stationary = stationary_joints(&case.given.model.robot, stretches);
    let band = (case.cutoff_hz, case.averaged);
    floor_of(residuals, stretches, &case.filters, band, &stationary)
}

/// The same with each part by itself; `band`: the cut-off \[Hz\], and whether each torque is the mean of two rows.
fn floor_of(
    residuals: &[Vec<Vec<f64>>],
    stretches: &[Stretch],
    filters: &ParallelFilters,
    band: (f64, bool),
    stationary: &[Vec<bool>],
) -> Result<Vec<f64>, MotionError> {
    // logs of one rate together
    let bands = filters.designs().iter();
    let bands = bands.map(|(dt, filter)| NoiseBands::design(filter, 1.0 / dt, band));
    let bands = bands.collect::<Result<Vec<_>, _>>()?;
    let rate_of: Vec<usize> = stretches.iter().map(|s| filters.rate_of(s)).collect();
    let periods: Vec<Option<usize>> = stretches.iter().map(|s| period(&s.q)).collect();
    let mut floor = Vec::new();
    for j in 0..stretches.first().map_or(0, Stretch::joints) {
        // friction at rest is no noise; a joint that never moves has nothing else
        let always = stationary.iter().all(|s| s[j]);
        let mut of_joint: Vec<Vec<StretchNoise>> = bands.iter().map(|_| Vec::new()).collect();
        for (i, residual) in residuals.iter().enumerate() {
            if always || !stationary[i][j] {
                let rate = rate_of[i];
                of_joint[rate].extend(bands[rate].look(&residual[j], periods[i])?);
            }
        }
        floor.push(over_rates(&bands, &of_joint));
    }
    Ok(floor)
}

/// Variance of the noise of one joint over the logs of every rate, by the rows that each keeps.
fn over_rates(bands: &[NoiseBands], noise: &[Vec<StretchNoise>]) -> f64 {
    let of_rate = |(bands, noise): (&NoiseBands, &Vec<StretchNoise>)| {
        let samples: f64 = noise.iter().map(|s| s.weight).sum();
        let rows = samples / bands.parallel.decimation as f64;
        (rows, together(noise, bands.seen, bands.kept))
    };
    let all = bands.iter().zip(noise).map(of_rate);
    let known: Vec<(f64, f64)> = all.filter(|(rows, _)| *rows > 0.0).collect();
    match known.as_slice() {
        [] => 0.0,
        [(_, variance)] => *variance,
        _ => {
            let rows: f64 = known.iter().map(|(rows, _)| rows).sum();
            known.iter().map(|(r, v)| r * v).sum::<f64>() / rows
        }
    }
}

/// The two bands beyond the one that is kept, and the blocks that are looked at.
struct NoiseBands<'a> {
    parallel: &'a FilterDesign,
    /// What each band sees of white noise and of white noise differentiated twice.
    seen: [[f64; 2]; 2],
    /// What the band that is kept sees of them.
    kept: [f64; 2],
    passes: [ZeroPhase; 3],
    /// Samples of a block, some periods of the band.
    block: usize,
    /// Independent numbers of a band in a block.
    freedom: f64,
    /// Variance of a white signal's fourth difference over its own.
    gain: f64,
}

impl<'a> NoiseBands<'a> {
    fn design(
        parallel: &'a FilterDesign,
        rate: f64,
        band: (f64, bool),
    ) -> Result<Self, MotionError> {
        let (cutoff_hz, averaged) = band;
        let top = (0.45 * rate / (BORDERS[2] * cutoff_hz)).min(1.0);
        let low_pass = |times: f64| -> Result<ZeroPhase, MotionError> {
            let cutoff = times * top * cutoff_hz;
            Ok(ZeroPhase::new(SosFilter::butterworth(4, cutoff, rate)?))
        };
        let [near, middle, far] = BORDERS.map(low_pass);
        let passes = [near?, middle?, far?];
        let block = ((4.0 / cutoff_hz * rate).ceil() as usize).max(64);
        let width = top * cutoff_hz * (BORDERS[1] - BORDERS[0]);
        let mut bands = NoiseBands {
            parallel,
            seen: [[0.0; 2]; 2],
            kept: [0.0; 2],
            passes,
            block,
            freedom: 2.0 * width * block as f64 / rate,
            // 1 + 16 + 36 + 16 + 1 = 70; of the mean of two neighbours (1 + 9 + 4 + 4 + 9 + 1) / 4 = 7
            gain: if averaged { 7.0 } else { 70.0 },
        };
        let kernels = [&[1.0][..], &[1.0, -2.0, 1.0][..]];
        for (source, kernel) in kernels.into_iter().enumerate() {
            let (beyond, within) = bands.powers(kernel)?;
            [bands.seen[0][source], bands.seen[1][source]] = beyond;
            bands.kept[source] = within;
        }
        Ok(bands)
    }

    /// A signal in each of the two bands.
    fn parted(&self, x: &[f64]) -> Result<[Vec<f64>; 2], MotionError> {
        let mut below = [(); 3].map(|()| x.to_vec());
        for (pass, x) in self.passes.iter().zip(&mut below) {
            pass.run(x, 1)?;
        }
        let between = |k: usize| -> Vec<f64> {
            let pairs = below[k + 1].iter().zip(&below[k]);
            pairs.map(|(a, b)| a - b).collect()
        };
        Ok([between(0), between(1)])
    }

    /// Power of a kernel in the two bands, and in the one that is kept.
    fn powers(&self, kernel: &[f64]) -> Result<([f64; 2], f64), MotionError> {
        let length = 2 * self.parallel.trim.max(500) + 1;
        let mut impulse = vec![0.0; length];
        impulse[length / 2..length / 2 + kernel.len()].copy_from_slice(kernel);
        let beyond = self.parted(&impulse)?.map(|x| power(&x));
        self.parallel.smooth(&mut impulse)?;
        Ok((beyond, power(&impulse)))
    }

    /// What the raw residual of a joint along one stretch shows; none where it is too short.
    fn look(
        &self,
        residual: &[f64],
        period: Option<usize>,
    ) -> Result<Option<StretchNoise>, MotionError> {
        let edge = self.parallel.trim.min(residual.len() / 4);
        if residual.len() < 2 * edge + self.block {
            return Ok(None);
        }
        let inner = edge..residual.len() - edge;
        let powers = |x: &[f64]| -> Vec<f64> {
            let blocks = x.chunks_exact(self.block);
            blocks.map(|b| power(b) / self.block as f64).collect()
        };
        let differences: Vec<f64> = residual
            .windows(5)
            .map(|w| w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4])
            .collect();
        let repeated = match period {
            Some(period) => {
                let mut filtered = residual.to_vec();
                self.parallel.smooth(&mut filtered)?;
                unrepeated(&filtered, inner.clone(), period)
            }
            None => None,
        };
        let near = self.parted(residual)?;
        Ok(Some(StretchNoise {
            weight: residual.len() as f64,
            near: near.map(|x| BlockMedian::of(powers(&x[inner.clone()]), self.freedom)),
            top: BlockMedian::of(powers(&differences), f64::INFINITY).value / self.gain,
            repeated,
        }))
    }
}

/// What one stretch shows of a joint's noise.
struct StretchNoise {
    weight: f64,
    /// Power in the two bands.
    near: [BlockMedian; 2],
    /// Variance of white noise by the top of the spectrum.
    top: f64,
    /// Variance in the band that is kept of what does not repeat.
    repeated: Option<f64>,
}

/// Variance of the noise in the band that is kept, over all stretches by their rows; 0 of none.
fn together(stretches: &[StretchNoise], seen: [[f64; 2]; 2], kept: [f64; 2]) -> f64 {
    let rows: f64 = stretches.iter().map(|s| s.weight).sum();
    if rows <= 0.0 {
        return 0.0;
    }
    let mean = |of: &dyn Fn(&StretchNoise) -> f64| {
        stretches.iter().map(|s| s.weight * of(s)).sum::<f64>() / rows
    };
    // bands are taken together before anything is solved for, so that their errors average out
    let near = [0, 1].map(|band: usize| BlockMedian {
        value: mean(&|s| s.near[band].value),
        error: (mean(&|s| s.weight * s.near[band].error.powi(2)) / rows).sqrt(),
    });
    let [white, rising] = carried_on(near, seen, kept);
    let beyond = (white + rising).min(kept[0] * mean(&|s| s.top));
    // the encoders' rounding comes again with the motion, and is noise all the same
    mean(&|s| s.repeated.map_or(beyond, |r| (r + rising).min(beyond)))
}

/// Variances of white and of rising noise in the band that is kept, from those in two bands, which see `seen[band][source]`.
fn carried_on(near: [BlockMedian; 2], seen: [[f64; 2]; 2], kept: [f64; 2]) -> [f64; 2] {
    let [[w, r], [x, s]] = seen;
    let determinant = w * s - r * x;
    let [first, second] = near.map(|n| n.value);
    let white = (first * s - r * second) / determinant;
    let rising = (w * second - first * x) / determinant;
    // white noise that the rising noise hides is taken to be its standard error: what is no more is no structure
    let error = (near[0].error * s).hypot(near[1].error * r) / determinant.abs();
    let alone = |source: usize| {
        let of_band = |band: usize| near[band].value / seen[band][source];
        kept[source] * of_band(0).min(of_band(1))
    };
    let white = (kept[0] * white.max(error)).min(alone(0));
    if rising <= 0.0 || !rising.is_finite() {
        [alone(0), 0.0]
    } else {
        [white, (kept[1] * rising).min(alone(1))]
    }
}

fn power(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// Blocks below which their spread says nothing of the median's error.
const MIN_BLOCKS: usize = 8;

/// Median of blocks with its standard error, as if they were normal between their quartiles.
#[derive(Debug, Clone, Copy, Default)]
struct BlockMedian {
    value: f64,
    error: f64,
}

impl BlockMedian {
    /// Of powers with so many independent numbers in each; 0 of none.
    fn of(mut values: Vec<f64>, freedom: f64) -> Self {
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let at = |part: f64| {
            let index = (part * n as f64) as usize;
            values.get(index).copied().unwrap_or(0.0)
        };
        // quartiles of a normal distribution are 1.349 apart, and its median has 1.2533 times the mean's error
        let spread = (at(0.75) - at(0.25)) / 1.349;
        // the median lies below the mean (Wilson and Hilferty 1931), which is reported
        let below = (1.0 - 2.0 / (9.0 * freedom)).powi(3);
        let value = at(0.5) / below;
        let error = match n < MIN_BLOCKS {
            true => value,
            false => 1.2533 * spread / (n as f64).sqrt() / below,
        };
        BlockMedian { value, error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::unexplained::normal;
    use crate::motion::FilterSettings;

    /// The floor of raw residuals of one joint, each with its time step, and the mean square of their rows.
    fn floor_and_power(raw: &[(f64, Vec<f64>)]) -> [f64; 2] {
        let stretch = |(dt, raw): &(f64, Vec<f64>)| Stretch {
            dt: *dt,
            q: vec![vec![0.0; raw.len()]],
            t: vec![0.0; raw.len()],
            ..Stretch::default()
        };
        let stretches: Vec<Stretch> = raw.iter().map(stretch).collect();
        let filters = ParallelFilters::design(&FilterSettings::default(), &stretches).unwrap();
        let residuals: Vec<_> = raw.iter().map(|(_, x)| vec![x.clone()]).collect();
        let still = vec![vec![false]; raw.len()];
        let found = floor_of(&residuals, &stretches, &filters, (10.0, false), &still);
        let rows = stretches.iter().zip(raw);
        let rows = rows.flat_map(|(s, (_, x))| filters.of(s).run(&[x]).unwrap().remove(0));
        let squares: Vec<f64> = rows.map(|x| x * x).collect();
        let power = squares.iter().sum::<f64>() / squares.len() as f64;
        [found.unwrap()[0], power]
    }

    #[test]
    fn noise_that_rises_is_distinguished_from_white_noise_and_what_it_hides_is_its_standard_error()
    {
        let (seen, kept) = ([[1.0, 3.0], [2.0, 20.0]], [5.0, 0.5]);
        let known = |value: f64| BlockMedian { value, error: 0.0 };
        let of = |white: f64, rising: f64| {
            let near = seen.map(|[w, r]| known(w * white + r * rising));
            carried_on(near, seen, kept)
        };
        for (white, rising) in [(1.0, 0.0), (0.3, 0.8), (0.0, 2.0)] {
            let [a, b] = of(white, rising);
            assert!((a - kept[0] * white).abs() < 1e-12, "{a} {b}");
            assert!((b - kept[1] * rising).abs() < 1e-12, "{a} {b}");
        }
        // a spectrum that falls: the lower of the two bands
        assert_eq!(carried_on([4.0, 2.0].map(known), seen, kept), [5.0, 0.0]);
        // rising noise alone, known to a tenth: (20 * 0.3 hypot 3 * 2) / 14 of white noise may be there
        let near = [3.0, 20.0].map(|value| BlockMedian {
            value,
            error: 0.1 * value,
        });
        let [white, rising] = carried_on(near, seen, kept);
        assert!((white - 5.0 * 72f64.sqrt() / 14.0).abs() < 1e-12, "{white}");
        assert!((rising - 0.5).abs() < 1e-12, "{rising}");
    }

    #[test]
    fn a_middle_has_the_standard_error_of_a_median() {
        let mut draw = normal(9);
        let mut middle =
            |_| BlockMedian::of((0..49).map(|_| 3.0 + draw()).collect(), f64::INFINITY);
        let found: Vec<BlockMedian> = (0..2000).map(&mut middle).collect();
        let scatter = found.iter().map(|m| (m.value - 3.0).powi(2)).sum::<f64>() / 2000.0;
        let shown = found.iter().map(|m| m.error).sum::<f64>() / 2000.0;
        let off = (shown / scatter.sqrt() - 1.0).abs();
        assert!(off < 0.1, "{shown} {scatter}");
    }

    #[test]
    fn white_noise_beside_an_encoders_has_its_floor_in_one_log_and_in_four() {
        let mut normal = normal(12);
        let n = 80_000;
        let rounding: Vec<f64> = (0..n + 2).map(|_| normal()).collect();
        // the encoder's noise rises much higher beyond the band
        let twice = |w: &[f64]| w[0] - 2.0 * w[1] + w[2];
        let noise = rounding.windows(3).map(|w| normal() + 60.0 * twice(w));
        let noise: Vec<f64> = noise.collect();
        let of = |parts: usize| {
            let pieces = noise.chunks_exact(n / parts);
            let pieces: Vec<_> = pieces.map(|part| (1e-3, part.to_vec())).collect();
            floor_and_power(&pieces)
        };
        let ([whole, wanted], [four, _]) = (of(1), of(4));
        assert!((whole / wanted - 1.0).abs() < 0.3, "{whole} {wanted}");
        assert!((four / whole - 1.0).abs() < 0.15, "{four} {whole}");
    }

    #[test]
    fn white_noise_is_its_own_floor_and_a_smooth_residual_adds_nothing() {
        let mut normal = normal(3);
        let noise: Vec<f64> = (0..40_000).map(|_| 0.3 * normal()).collect();
        let wave = |(k, x): (usize, &f64)| x + 2.0 * (0.02 * k as f64).sin();
        let smooth = noise.iter().enumerate().map(wave).collect();
        let [beside, _] = floor_and_power(&[(1e-3, smooth)]);
        let [alone, power] = floor_and_power(&[(1e-3, noise)]);
        for found in [alone, beside] {
            assert!((found / power - 1.0).abs() < 0.1, "{found} {power}");
        }
    }

    #[test]
    fn logs_of_two_rates_have_the_floor_of_each_by_its_rows() {
        let mut normal = normal(5);
        // the same noise per sample: the filter lets more of the slow log through
        let logs = [(1e-3, 60_000), (2.5e-3, 24_000)];
        let logs = logs.map(|(dt, n)| (dt, (0..n).map(|_| normal()).collect()));
        let [found, power] = floor_and_power(&logs);
        assert!((found / power - 1.0).abs() < 0.1, "{found} {power}");
    }
}
