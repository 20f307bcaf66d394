use super::super::columns::JointTerm;
use super::super::solve::{RowWeighting, fit};
use super::*;
use crate::robot::JointKind;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TRUTH: [f64; 3] = [95.0, 200.0, 20.0];
const STEP: f64 = 0.002;
const FORCE_NOISE: f64 = 2.0;

fn columns() -> RegressorColumns {
    RegressorColumns::of_one(&[JointTerm::Viscous, JointTerm::Offset], None)
}

fn settings() -> FilterSettings {
    FilterSettings {
        cutoff_hz: 30.0,
        // raw positions, so that their noise reaches the regressor
        q_order: 0,
        decimation: Some(5),
        ..FilterSettings::default()
    }
}

/// Ten seconds of a sliding joint: noise on position and force, and the reference beside it.
fn log(noise: f64, seed: u64, with_reference: bool) -> Block {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
    let mut block = Block::default();
    for k in 0..5000 {
        let t = f64::from(k) * STEP;
        let (mut q, mut v, mut a) = (0.0, 0.0, 0.0);
        for (size, w, phase) in [(0.05, 5.0, 0.0), (0.02, 11.0, 1.0), (0.004, 29.0, 2.0)] {
            let (sin, cos) = f64::sin_cos(w * t + phase);
            q += size * sin;
            v += size * w * cos;
            a -= size * w * w * sin;
        }
        let tau = TRUTH[0] * a + TRUTH[1] * v + TRUTH[2];
        block.t.push(t);
        block.q.push(q + noise * draw());
        block.tau.push(tau + FORCE_NOISE * draw());
        if with_reference {
            block.q.push(q);
            block.tau.push(0.0);
        }
    }
    block
}

fn once(block: Block) -> impl FnMut(&mut Block) -> Result<bool, FitError> + Send {
    let mut left = Some(block);
    move |out| {
        let block = left.take();
        let more = block.is_some();
        *out = block.unwrap_or_default();
        Ok(more)
    }
}

fn failed(error: RunError<FitError>) -> FitError {
    panic!("{error}")
}

fn plain(noise: f64, seed: u64) -> Fit {
    let robot = Robot::single_joint("q1", JointKind::Prismatic);
    let mut source = once(log(noise, seed, false));
    let (factors, _) =
        super::super::accumulate(&robot, &columns(), &settings(), &mut source).unwrap();
    fit(&factors, RowWeighting::Wls).unwrap()
}

fn instrumental(noise: f64, seed: u64, reference: ReferenceSource) -> InstrumentalFit {
    let robot = Robot::single_joint("q1", JointKind::Prismatic);
    let start = plain(noise, seed);
    iterate(&columns(), &start, &mut |theta| {
        let mut source = once(log(noise, seed, reference == ReferenceSource::Logged));
        accumulate(
            &robot,
            &columns(),
            theta,
            reference,
            &settings(),
            STEP,
            &mut source,
        )
        .map(|read| read.factors)
        .map_err(failed)
    })
    .unwrap()
}

#[test]
fn without_noise_in_position_instruments_change_nothing() {
    let (plain, found) = (plain(0.0, 1), instrumental(0.0, 1, ReferenceSource::Logged));
    assert_eq!(found.ending, IterationEnding::Converged);
    for i in 0..3 {
        let std = plain.covariance[(i, i)].sqrt();
        assert!((plain.theta[i] - found.fit.theta[i]).abs() < std, "{i}");
    }
}

#[test]
fn noisy_positions_bias_least_squares_and_not_instruments() {
    let noise = 1.5e-4;
    let (mut covered, mut mean, runs) = ([0; 3], [0.0; 2], 100);
    for seed in 0..runs {
        let found = instrumental(noise, seed, ReferenceSource::Logged).fit;
        mean[0] += plain(noise, seed).theta[0] / runs as f64;
        mean[1] += found.theta[0] / runs as f64;
        for (i, truth) in TRUTH.into_iter().enumerate() {
            let std = found.covariance[(i, i)].sqrt();
            covered[i] += u32::from((found.theta[i] - truth).abs() < 1.96 * std);
        }
    }
    assert!(mean[0] < 0.97 * TRUTH[0], "least squares: {}", mean[0]);
    assert!(
        (mean[1] / TRUTH[0] - 1.0).abs() < 0.003,
        "instruments: {}",
        mean[1]
    );
    // of 100 draws of 0.95 fewer than 87 come in 0.1 % of all tests
    assert!(covered.iter().all(|c| *c >= 87), "{covered:?}");
}

#[test]
fn a_smoothed_reference_removes_most_of_the_bias() {
    let found = instrumental(1.5e-4, 3, ReferenceSource::Smoothed).fit;
    let [off, before] = [found, plain(1.5e-4, 3)].map(|fit| fit.theta[0] - TRUTH[0]);
    assert!(off.abs() < 0.3 * before.abs(), "{off} {before}");
}
