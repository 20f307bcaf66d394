//! What the encoders' steps change in the fit.
//!
//! Noise of the positions stands in the columns, where it draws inertias towards zero (errors in variables; Fuller,
//! Measurement Error Models, 1987). Noise of the log's own level, added and taken away, does so once more: by the mean of
//! both fits the bias is known, and taken off (SIMEX: Cook and Stefanski, J. Am. Stat. Assoc. 89, 1994).
//!
//! A rounding error depends on the position alone, so on a periodic motion it is the same in every
//! period, no residual shows it, and no covariance of residuals holds it. Here the measured motion
//! is smoothed and rounded again on grids that are shifted by parts of a step; the scatter of the
//! fits is the part of the uncertainty that the encoders make.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::accumulate::BlockFactors;
use super::columns::RegressorColumns;
use super::robust::RowWeigher;
use super::solve::Fit;
use super::two_pass::two_passes;
use crate::block::Block;
use crate::motion::{self, FilterSettings, RunError};
use crate::robot::Robot;

/// Number of shifted grids.
pub const GRIDS: u32 = 6;

/// Readings with the noise of the positions once more: added, and taken away.
pub const NOISY: u32 = 2;

/// The numbers that decide.
struct DecisionNumbers {
    /// Share of the acceleration's mean square from which noise is looked at: it takes as much off an inertia. Half or
    /// twice: biases of a ten thousandth are seen, or not.
    share: f64,
    /// How uncertain the bias is, over itself: what the extrapolation leaves of it grows with its square. Half: noise of a
    /// fifth of the acceleration leaves inertias outside; twice: the correction is no use.
    unsure: f64,
}

const NUMBERS: DecisionNumbers = DecisionNumbers {
    share: 1e-4,
    unsure: 0.5,
};

/// Whether noise that makes this share of the acceleration's mean square says something in a fit.
pub fn tells(share: f64) -> bool {
    share > NUMBERS.share
}

/// Noise of each joint's positions, even over an interval, that is added to blocks one after the other.
pub struct PositionNoise {
    /// Interval of each joint, below zero where the same noise is taken away \[m or rad\].
    intervals: Vec<f64>,
    chance: ChaCha8Rng,
}

impl PositionNoise {
    /// The noise of one of the [`NOISY`] readings by the intervals of the joints; `seed` chooses it.
    pub fn new(intervals: &[f64], reading: u32, seed: u64) -> Self {
        let sign = if reading.is_multiple_of(2) { 1.0 } else { -1.0 };
        PositionNoise {
            intervals: intervals.iter().map(|step| sign * step).collect(),
            chance: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    pub fn add(&mut self, block: &mut Block) {
        for row in block.q.chunks_exact_mut(self.intervals.len().max(1)) {
            for (q, interval) in row.iter_mut().zip(&self.intervals) {
                *q += interval * (self.chance.random::<f64>() - 0.5);
            }
        }
    }
}

/// What noise of the positions makes of the unknowns of a fit, by the fits with that noise once more; none without them.
pub fn bias(fit: &Fit, noisy: &[Fit]) -> Option<DVector<f64>> {
    let shares = noisy.iter().map(|other| &other.theta / noisy.len() as f64);
    let mean = shares.reduce(|a, b| a + b)?;
    Some(mean - &fit.theta)
}

/// Takes the bias off the estimates, or widens their covariance by it where they stay as they are because a model predicts
/// with them.
pub fn correct(
    theta: &mut DVector<f64>,
    covariance: &mut DMatrix<f64>,
    bias: &DVector<f64>,
    stay: bool,
) {
    let unsure = if stay { 1.0 } else { NUMBERS.unsure };
    let u = theta.len();
    let mut own = covariance.view_mut((0, 0), (u, u));
    own.ger(unsure * unsure, bias, bias, 1.0);
    if !stay {
        *theta -= bias;
    }
}

/// Shifts of a grid as parts of a step per motor: multiples of irrational numbers, spread evenly without chance.
fn shifts(grid: u32) -> [f64; 4] {
    const TURNS: [f64; 4] = [
        0.618_033_988_7,
        0.414_213_562_4,
        0.732_050_807_6,
        0.236_067_977_5,
    ];
    TURNS.map(|turn| (turn * f64::from(grid + 1)).fract())
}

/// Reduces a log whose smoothed positions are rounded anew on a shifted grid. `None` where the
/// robot's encoders are not known.
///
/// # Errors
/// Those of the source and of [`motion::run`].
pub fn accumulate_shifted<E: Send>(
    robot: &Robot,
    columns: &RegressorColumns,
    weigher: Option<&mut RowWeigher>,
    settings: &FilterSettings,
    grid: u32,
    source: &mut (dyn FnMut(&mut Block) -> Result<bool, E> + Send),
) -> Result<Option<BlockFactors>, RunError<E>> {
    if robot.transmission().encoder_steps().is_none() {
        return Ok(None);
    }
    let n = columns.joints;
    let shift = shifts(grid);
    let smooth = FilterSettings {
        decimation: Some(1),
        ..settings.clone()
    };
    let (_, (factors, _)) = two_passes(
        |outlet| {
            motion::run(
                source,
                n,
                &smooth,
                None,
                n,
                &|s, out| out.copy_from_slice(s.tau),
                &mut |row| {
                    outlet.row(|block| {
                        block.t.push(row.t);
                        let at = block.q.len();
                        block.q.extend_from_slice(row.q);
                        robot
                            .transmission()
                            .round_at_encoders(&mut block.q[at..], &shift);
                        block.tau.extend_from_slice(row.raw);
                    });
                },
            )
        },
        |blocks| super::accumulate_weighted(robot, columns, weigher, settings, blocks),
    )?;
    Ok(Some(factors))
}

/// Adds the scatter of the fits on shifted grids to a fit's covariance.
pub fn add_scatter(fit: &mut Fit, shifted: &[Fit]) {
    let k = shifted.len();
    if k < 2 {
        return;
    }
    let u = fit.theta.len();
    let mut mean = fit.theta.clone() * 0.0;
    for other in shifted {
        mean += &other.theta / k as f64;
    }
    let mut scatter = DMatrix::zeros(u, u);
    for other in shifted {
        let d = &other.theta - &mean;
        scatter.ger(1.0 / (k - 1) as f64, &d, &d, 1.0);
    }
    fit.covariance += scatter;
}

#[cfg(test)]
mod tests {
    use super::super::columns::JointTerm;
    use super::super::solve::{RowWeighting, fit};
    use super::*;

    const STEP: f64 = 0.004;

    /// Fit of an inertia of 0.4 and a friction of 0.7 where positions are rounded and noise comes on top.
    fn fitted(count: f64, noise: Option<PositionNoise>) -> Fit {
        let columns = RegressorColumns::of_one(&[JointTerm::Viscous], None);
        let samples = 20_000;
        let at = |k: usize| {
            let t = k as f64 * STEP;
            let (w, u) = (3.0, 7.3);
            let q = 0.4 * (w * t).sin() + 0.1 * (u * t).cos();
            let v = 0.4 * w * (w * t).cos() - 0.1 * u * (u * t).sin();
            let a = -0.4 * w * w * (w * t).sin() - 0.1 * u * u * (u * t).cos();
            (q, 0.4 * a + 0.7 * v)
        };
        let mut block = Block {
            q: (0..samples)
                .map(|k| (at(k).0 / count).round() * count)
                .collect(),
            ..Block::default()
        };
        if let Some(mut noise) = noise {
            noise.add(&mut block);
        }
        let q = &block.q;
        let lag = 8;
        let h = lag as f64 * STEP;
        let rows = (lag..samples - lag).map(|k| {
            let v = (q[k + lag] - q[k - lag]) / (2.0 * h);
            let a = (q[k + lag] - 2.0 * q[k] + q[k - lag]) / (h * h);
            [v, a, at(k).1]
        });
        fit(&columns.rows_of_one(0.2, rows), RowWeighting::Wls).unwrap()
    }

    #[test]
    fn an_inertia_behind_a_coarse_encoder_is_brought_back() {
        let fine = fitted(1e-9, None);
        let count = 3e-3;
        let mut coarse = fitted(count, None);
        let noisy: Vec<Fit> = (0..NOISY)
            .map(|reading| fitted(count, Some(PositionNoise::new(&[count], reading, 5))))
            .collect();
        let before = coarse.theta[0] / fine.theta[0] - 1.0;
        let off = bias(&coarse, &noisy).unwrap();
        correct(&mut coarse.theta, &mut coarse.covariance, &off, false);
        let after = coarse.theta[0] / fine.theta[0] - 1.0;
        assert!(before < -0.02, "{before}");
        assert!(after.abs() < 0.3 * before.abs(), "{before} {after}");
        let std = coarse.covariance[(0, 0)].sqrt();
        assert!((coarse.theta[0] - fine.theta[0]).abs() < 2.0 * std, "{std}");
    }
}
