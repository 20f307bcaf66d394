//! Random motions that fill the limits: where searches start, and what stands for a usual motion.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::limits::BoundedQuantity;
use super::machine::ForeseenRobot;
use super::repair::repaired;
use super::series::Series;
use super::usage::ScanEffort;
use super::variables::DesignVariables;

/// Standard deviation of the offsets about the middle, in half spans.
const SPREAD: f64 = 0.2;
/// A motion is drawn this many times too large, so that its repair lets it fill the limits.
const START_EXCESS: f64 = 10.0;
/// Random motions whose torques stand for usual ones, their seed and the samples of each.
const USUAL: usize = 16;
const USUAL_SEED: u64 = 0;
const SAMPLES: usize = 64;

/// Random motion number `number` of a seed, within the channels; at rest at its offsets where it could not be fitted.
pub(super) fn random_motion(
    machine: &ForeseenRobot,
    channels: &[BoundedQuantity],
    variables: &DesignVariables,
    seed: u64,
    number: usize,
) -> Series {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    chance.set_stream(number as u64 + 1);
    let mut normal = || -> f64 { StandardNormal.sample(&mut chance) };
    let n = variables.coordinates();
    let mut series = Series::still(variables.fundamental, n, variables.harmonics);
    for i in 0..n {
        let (middle, half) = variables.span[i];
        let shift = SPREAD * half * normal().clamp(-2.0, 2.0);
        series.offset[i] = variables.fixed[i].unwrap_or(middle + shift);
        for l in 0..variables.harmonics {
            series.a[i][l] = variables.speed[i] * normal();
            series.b[i][l] = variables.speed[i] * normal();
        }
    }
    let large = series.scaled(START_EXCESS);
    repaired(
        machine,
        channels,
        &large,
        &variables.fixed,
        ScanEffort::Rough,
    )
    .unwrap_or_else(|| series.scaled(0.0))
}

/// A random motion that fills the limits: what stands for a usual one.
pub fn usual_motion(machine: &ForeseenRobot, fundamental: f64, harmonics: usize) -> Series {
    usual(machine, fundamental, harmonics)(0)
}

/// Usual motions by their number.
fn usual(
    machine: &ForeseenRobot,
    fundamental: f64,
    harmonics: usize,
) -> impl Fn(usize) -> Series + '_ {
    let (channels, free) = (&machine.channels, vec![None; machine.coordinates()]);
    let variables = DesignVariables::new(channels, fundamental, harmonics, free);
    move |number| random_motion(machine, channels, &variables, USUAL_SEED, number)
}

/// Root mean square of every joint's torque over random motions that fill the limits \[N or N m\]:
/// what a share of the torque refers to before there is a motion.
pub fn usual_torque(machine: &ForeseenRobot, fundamental: f64, harmonics: usize) -> Vec<f64> {
    let (mut squares, mut count) = (vec![0.0; machine.coordinates()], 0usize);
    for series in (0..USUAL).map(usual(machine, fundamental, harmonics)) {
        for m in 0..SAMPLES {
            let t = series.period() * m as f64 / SAMPLES as f64;
            if let Ok(state) = machine.state(&series.at(t)) {
                for (sum, tau) in squares.iter_mut().zip(state.tau) {
                    *sum += tau * tau;
                }
                count += 1;
            }
        }
    }
    let size = |sum: &f64| (sum / count.max(1) as f64).sqrt();
    squares.iter().map(size).collect()
}
