//! What biased the positions, done to them again: noise of their own level is added (SIMEX). What estimates make of it
//! shows their bias.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::MotionError;
use super::settings::FilterDesign;
use super::stretch::Stretch;

impl FilterDesign {
    /// The stretch with white noise of its own positions' level, times `sign`, added to them. In the mean over both
    /// signs what is of first order in the noise is gone, and what is of second is there twice
    /// (Cook and Stefanski, J. Am. Stat. Assoc. 89, 1994). Velocity and acceleration get the noise as
    /// they got that of the log, filtered and differentiated. `seed` chooses it.
    ///
    /// # Errors
    /// [`MotionError`] where the stretch is too short for the filter.
    pub fn with_added_noise(
        &self,
        stretch: &Stretch,
        seed: u64,
        sign: f64,
    ) -> Result<Stretch, MotionError> {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut noisy = stretch.clone();
        for j in 0..stretch.joints() {
            let lag = self.rough_lag(j, stretch.dt);
            let [q, v, a] = self.motion_of_noise(j, stretch, &mut chance)?;
            let level = middle_roughness(&stretch.a[j], lag) / middle_roughness(&a, lag);
            if !level.is_finite() {
                continue;
            }
            let channels = [&mut noisy.q[j], &mut noisy.v[j], &mut noisy.a[j]];
            for (channel, noise) in channels.into_iter().zip([q, v, a]) {
                for (x, n) in channel.iter_mut().zip(&noise) {
                    *x += sign * level * n;
                }
            }
        }
        Ok(noisy)
    }

    /// Samples over which a difference shows most of what the position filter lets through, and next to nothing of motion.
    pub(super) fn rough_lag(&self, joint: usize, dt: f64) -> usize {
        let cutoff = self.position.as_ref().map(|f| f.cutoff_hz(joint));
        let lag = cutoff.map_or(1, |hz| (1.0 / (3.0 * hz * dt)) as usize);
        lag.max(1)
    }

    /// What white noise of a joint's positions, even over an interval of 1, becomes: position, velocity, acceleration.
    pub(super) fn motion_of_noise(
        &self,
        joint: usize,
        stretch: &Stretch,
        chance: &mut ChaCha8Rng,
    ) -> Result<[Vec<f64>; 3], MotionError> {
        let noise = stretch.t.iter().map(|_| chance.random::<f64>() - 0.5);
        self.motion_of(joint, noise.collect(), stretch.dt)
    }

    /// Position, velocity and acceleration of a joint by its unfiltered positions.
    pub(super) fn motion_of(
        &self,
        joint: usize,
        mut q: Vec<f64>,
        dt: f64,
    ) -> Result<[Vec<f64>; 3], MotionError> {
        if let Some(filter) = &self.position {
            filter.of(joint).run(&mut q, 1)?;
        }
        let (mut v, mut a) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        self.differences.apply(&q, 1, dt, &mut v, &mut a);
        Ok([q, v, a])
    }
}

/// Spans of a block whose roughness is taken together.
const BLOCK: usize = 12;
/// Lags that a fourth difference spans.
const SPAN: usize = 4;

/// Median over blocks of the rms of the fourth difference over a lag, which motion hardly moves; 0 for less than a block.
pub(super) fn middle_roughness(x: &[f64], lag: usize) -> f64 {
    let reach = SPAN * lag;
    let rough = |k: usize| {
        x[k] - 4.0 * x[k + lag] + 6.0 * x[k + 2 * lag] - 4.0 * x[k + 3 * lag] + x[k + reach]
    };
    let samples = x.len().saturating_sub(reach);
    let block = BLOCK * (reach + 1);
    let of_block = |b: usize| (b * block..(b + 1) * block).map(|k| rough(k).powi(2)).sum();
    let mut of_blocks: Vec<f64> = (0..samples / block).map(of_block).collect();
    let middle = of_blocks.len() / 2;
    if of_blocks.is_empty() {
        return 0.0;
    }
    let (_, square, _) = of_blocks.select_nth_unstable_by(middle, f64::total_cmp);
    (*square / block as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::FilterSettings;

    /// A slow motion, read by encoders of known counts at several rates and through filters of several widths.
    #[test]
    fn the_noise_that_comes_to_a_stretch_is_that_of_its_encoder() {
        for (rate, hz, count) in [
            (1000.0, 60.0, 1e-4),
            (125.0, 40.0, 1e-5),
            (8000.0, 100.0, 1e-5),
        ] {
            let (dt, n) = (1.0 / rate, 20_000);
            let settings = FilterSettings {
                q_cutoff_hz: Some(hz),
                ..FilterSettings::default()
            };
            let parallel = FilterDesign::design(&settings, dt).unwrap();
            let motion = |k: usize| {
                let t = k as f64 * dt;
                0.4 * (1.7 * t).sin() + 0.05 * (9.1 * t).sin()
            };
            let smooth = |mut q: Vec<f64>| {
                parallel.position.clone().unwrap().run(&mut q, 1).unwrap();
                let (mut v, mut a) = (vec![0.0; n], vec![0.0; n]);
                parallel.differences.apply(&q, 1, dt, &mut v, &mut a);
                Stretch {
                    dt,
                    t: (0..n).map(|k| k as f64 * dt).collect(),
                    q: vec![q],
                    v: vec![v],
                    a: vec![a],
                    ..Stretch::default()
                }
            };
            let true_motion = smooth((0..n).map(motion).collect());
            let read = smooth(
                (0..n)
                    .map(|k| (motion(k) / count).round() * count)
                    .collect(),
            );
            let [more, less] =
                [1.0, -1.0].map(|sign| parallel.with_added_noise(&read, 1, sign).unwrap());
            let rms_off = |x: &[f64], y: &[f64]| {
                let inner = 1000..n - 1000;
                let pairs = x[inner.clone()].iter().zip(&y[inner]);
                pairs.map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt()
            };
            for of in [|s: &Stretch| s.q[0].clone(), |s: &Stretch| s.a[0].clone()] {
                let added = rms_off(&of(&more), &of(&read));
                let had = rms_off(&of(&read), &of(&true_motion));
                assert!((added / had - 1.0).abs() < 0.2, "{rate} {added} {had}");
                assert!((rms_off(&of(&more), &of(&less)) / added - 2.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn what_holds_no_noise_gets_none() {
        let parallel = FilterDesign::design(&FilterSettings::default(), 1e-3).unwrap();
        let still = Stretch {
            dt: 1e-3,
            t: vec![0.0; 3000],
            q: vec![vec![0.3; 3000]],
            v: vec![vec![0.0; 3000]],
            a: vec![vec![0.0; 3000]],
            ..Stretch::default()
        };
        assert_eq!(parallel.with_added_noise(&still, 1, 1.0).unwrap(), still);
    }
}
