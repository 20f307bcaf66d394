//! What noise of positions becomes on its way to velocities and accelerations, and how rough a signal is.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::MotionError;
use super::stretch::{Parallel, Stretch};

impl Parallel {
    /// Samples over which a difference of a joint's motion shows most of what is as fast as the position filter lets through, and next
    /// to nothing of motion.
    pub(super) fn rough_lag(&self, joint: usize, dt: f64) -> usize {
        let cutoff = self.position.as_ref().map(|f| f.cutoff_hz(joint));
        cutoff
            .map_or(1, |hz| (1.0 / (3.0 * hz * dt)) as usize)
            .max(1)
    }

    /// What white noise of a joint's positions, even over an interval of 1, becomes: position, velocity, acceleration.
    pub(super) fn motion_of_noise(
        &self,
        joint: usize,
        stretch: &Stretch,
        chance: &mut ChaCha8Rng,
    ) -> Result<[Vec<f64>; 3], MotionError> {
        let mut q: Vec<f64> = stretch
            .t
            .iter()
            .map(|_| chance.random::<f64>() - 0.5)
            .collect();
        if let Some(filter) = &self.position {
            filter.of(joint).run(&mut q, 1)?;
        }
        let (mut v, mut a) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        self.differences.apply(&q, 1, stretch.dt, &mut v, &mut a);
        Ok([q, v, a])
    }
}

/// Spans of a block whose roughness is taken together.
const BLOCK: usize = 12;
/// Lags that a fourth difference spans.
const SPAN: usize = 4;

/// Median over blocks of the rms of the fourth difference over a lag, to which motion gives next to nothing, and a
/// jerk at a reversal only a few of the blocks. 0 for less than a block.
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
