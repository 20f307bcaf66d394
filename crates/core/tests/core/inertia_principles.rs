//! Sums of rows that are reduced, weighed, widened and corrected: what changes, by how much, and what does not.

use cft_ident_core::block::Block;
use cft_ident_core::inertia::accumulate::{BlockFactors, RowAccumulator};
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::inertia::departure::widen_by_departure;
use cft_ident_core::inertia::encoder::{PositionNoise, bias, correct, tells};
use cft_ident_core::inertia::solve::{Fit, RowWeighting, fit};
use cft_ident_core::inertia::standstill::{counted, open_joints};
use cft_ident_core::inertia::{add_processing, bandwidth};
use cft_ident_core::motion::MotionSample;
use cft_ident_core::robot::{JointKind, Robot};
use nalgebra::{DMatrix, DVector};

use crate::diagnosis_bench::Chance;
use crate::fit_principles::columns_of_one_joint;

const STEP: f64 = 0.01;
const ROWS: usize = 4000;
const INERTIA: f64 = 1.3;

fn columns() -> RegressorColumns {
    columns_of_one_joint(vec![0.01])
}

fn motion(k: usize) -> [f64; 2] {
    let t = STEP * k as f64;
    let waves = [(0.8, 1.7, 0.3), (0.5, 4.1, 1.0), (0.2, 9.3, 2.0)];
    let v = waves.iter().map(|(s, w, p)| s * (w * t + p).sin()).sum();
    let a = waves
        .iter()
        .map(|(s, w, p)| s * w * (w * t + p).cos())
        .sum();
    [v, a]
}

/// Rows of a joint with this friction, in a unit of torque; forward alone where `forward` is more than its speeds.
fn rows(friction: &dyn Fn(f64) -> f64, noise: f64, unit: f64, forward: f64) -> BlockFactors {
    let (columns, robot) = (columns(), Robot::single_joint("q1", JointKind::Revolute));
    let mut all = RowAccumulator::new(columns.clone(), 0.05);
    let mut out = vec![0.0; columns.channels()];
    let mut chance = Chance(17);
    for k in 0..ROWS {
        let [v, a] = motion(k);
        let v = v + forward;
        let tau = unit * (INERTIA * a + friction(v) + noise * chance.next());
        columns.fill(&robot, &[0.0], &[v], &[a], &[tau], &mut out);
        let sample = MotionSample {
            t: STEP * k as f64,
            q: &[0.0],
            v: &[v],
            a: &[a],
            tau: &[tau],
            tau_beside: [&[tau], &[tau]],
            weight: &[1.0],
            rests: &[true],
        };
        columns.weigh(&sample, &mut out);
        all.at(sample.t);
        all.add(0, STEP, &out);
    }
    all.finish()
}

fn lawful(v: f64) -> f64 {
    0.7 * v + 2.1 * v.signum() - 0.4
}

/// The same with a fall of friction at low speed that no term has.
fn bent(v: f64) -> f64 {
    lawful(v) + 0.6 * v.signum() * (-(v / 0.2).powi(2)).exp()
}

fn fitted(rows: &BlockFactors) -> Fit {
    fit(rows, RowWeighting::Wls).expect("rows that determine all")
}

#[track_caller]
fn near(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * b.abs().max(1e-12), "{a} {b}");
}

#[test]
fn rows_at_rest_and_in_motion_are_all_rows_and_each_has_its_square() {
    let rows = rows(&lawful, 0.3, 1.0, 0.0);
    let theta = DVector::from_row_slice(&[1.2, 0.8, 2.0, -0.3]);
    let (mut squares, mut resting) = ([0.0; 2], 0);
    let mut chance = Chance(17);
    for k in 0..ROWS {
        let [v, a] = motion(k);
        let tau = INERTIA * a + lawful(v) + 0.3 * chance.next();
        let left = tau - (theta[0] * a + theta[1] * v + theta[2] * v.signum() + theta[3]);
        let rests = v.abs() <= 0.01;
        squares[usize::from(rests)] += left * left;
        resting += usize::from(rests);
    }
    assert!(resting > 10);
    let [moving, at_rest] = rows.squares(&theta)[0];
    near(moving, squares[0], 1e-9);
    near(at_rest, squares[1], 1e-9);
    near(
        rows.resting_shares()[0],
        resting as f64 / ROWS as f64,
        1e-12,
    );
    assert_eq!(rows.moving[0].count + rows.resting[0].count, ROWS as u64);
}

#[test]
fn a_log_that_is_condensed_gives_the_same_fit_and_nearly_the_same_deviations() {
    let whole = rows(&lawful, 0.3, 1.0, 0.0);
    let plain = fitted(&whole);
    let few = whole.clone().condensed(ROWS as u64, 0);
    assert_eq!(few.blocks.len(), 1);
    let found = fitted(&few);
    assert!((&found.theta - &plain.theta).amax() < 1e-9);
    for i in 0..4 {
        near(found.covariance[(i, i)], plain.covariance[(i, i)], 0.3);
    }
    // parts hold every row once
    let parts = whole.in_parts().in_time;
    assert!((9..=11).contains(&parts.len()), "{}", parts.len());
    assert_eq!(parts.iter().map(|p| p.rows).sum::<u64>(), ROWS as u64);
    let gram = |r: &DMatrix<f64>| r.tr_mul(r);
    let sum = parts
        .iter()
        .map(|p| gram(&p.r[0]))
        .reduce(|a, b| a + b)
        .expect("parts");
    let all = gram(&whole.joint(0));
    assert!((sum - &all).amax() < 1e-9 * all.amax());
    let one = whole.in_one_block();
    assert!((gram(&one.blocks[0].r[0]) - &all).amax() < 1e-9 * all.amax());
}

#[test]
fn friction_that_bends_over_the_speed_widens_what_it_may_be_off_by_and_a_right_law_nothing() {
    let widened = |friction: &dyn Fn(f64) -> f64, unit: f64| {
        let rows = rows(friction, 0.3, unit, 0.0);
        let before = fitted(&rows);
        let mut after = before.clone();
        widen_by_departure(&rows, &mut after);
        assert_eq!(after.theta, before.theta);
        (before, after)
    };
    let (before, after) = widened(&lawful, 1.0);
    for i in 0..4 {
        let ratio = after.covariance[(i, i)] / before.covariance[(i, i)];
        assert!((1.0..3.0).contains(&ratio), "{i}: {ratio}");
    }
    let (before, after) = widened(&bent, 1.0);
    let std = |fit: &Fit, i: usize| fit.covariance[(i, i)].sqrt();
    // the level at speed is 2.1
    assert!((before.theta[2] - 2.1).abs() > 4.0 * std(&before, 2));
    assert!((after.theta[2] - 2.1).abs() < 3.0 * std(&after, 2));
    assert!(std(&after, 2) < 0.6 && std(&after, 0) < 0.1);
    let (_, scaled) = widened(&bent, 1024.0);
    for i in 0..4 {
        near(std(&scaled, i), 1024.0 * std(&after, i), 1e-6);
    }
    // a torque the same in both directions that bends over the speed is in doubt as an offset
    let same = |v: f64| lawful(v) + 0.8 * (-(v / 0.3).powi(2)).exp();
    let (before, after) = widened(&same, 1.0);
    assert!(std(&after, 3) > 1.5 * std(&before, 3));
}

#[test]
fn a_joint_that_turns_one_way_leaves_its_friction_open_and_one_that_reverses_does_not() {
    let reverses = fitted(&rows(&lawful, 0.3, 1.0, 0.0));
    assert!(open_joints(&columns(), &reverses).is_empty());
    let one_way = fitted(&rows(&lawful, 0.3, 1.0, 2.0));
    assert!(!one_way.determined[2] || !one_way.determined[3]);
    let mut open = reverses.clone();
    open.covariance[(2, 2)] = (1.01 * open.torque_rms[0] / open.column_rms[(0, 2)]).powi(2);
    assert_eq!(open_joints(&columns(), &open), [0]);
    assert_eq!(counted(&columns(), vec![0], [&open, &reverses]), [0]);
    assert!(counted(&columns(), vec![0], [&open, &open]).is_empty());
    let mut worse = reverses.clone();
    worse.relative_error[0].all = 1.5 * open.relative_error[0].all;
    assert!(counted(&columns(), vec![0], [&open, &worse]).is_empty());
}

#[test]
fn the_bias_of_noise_is_the_mean_of_what_as_much_again_makes() {
    let plain = fitted(&rows(&lawful, 0.3, 1.0, 0.0));
    let moved = |by: f64| {
        let mut other = plain.clone();
        other.theta.iter_mut().for_each(|x| *x += by);
        other
    };
    let off = bias(&plain, &[moved(0.3), moved(-0.1)]).expect("two of them");
    off.iter().for_each(|x| near(*x, 0.1, 1e-9));
    assert!(bias(&plain, &[]).is_none());
    for stay in [true, false] {
        let (mut theta, mut covariance) = (plain.theta.clone(), DMatrix::zeros(5, 5));
        correct(&mut theta, &mut covariance, &off, stay);
        let (by, unsure) = if stay { (0.0, 1.0) } else { (0.1, 0.25) };
        theta
            .iter()
            .zip(&plain.theta)
            .for_each(|(a, b)| near(*a, b - by, 1e-9));
        near(covariance[(1, 3)], unsure * 0.01, 1e-9);
        assert_eq!(covariance[(4, 4)], 0.0);
    }
    assert!(tells(1e-3) && !tells(1e-5));
    // what another processing changes is one more deviation
    let mut widened = plain.clone();
    add_processing(&mut widened, &moved(0.2));
    near(
        widened.covariance[(0, 3)] - plain.covariance[(0, 3)],
        0.04,
        1e-6,
    );
}

#[test]
fn noise_of_the_positions_is_even_over_its_interval_and_taken_away_as_it_is_added() {
    let intervals = [0.01, 0.5];
    let block = Block {
        t: (0..5000).map(f64::from).collect(),
        q: vec![1.0; 10_000],
        ..Block::default()
    };
    let with = |reading: u32| {
        let mut noisy = block.clone();
        PositionNoise::new(&intervals, reading, 7).add(&mut noisy);
        noisy.q
    };
    let (more, less) = (with(0), with(1));
    for (j, interval) in intervals.iter().enumerate() {
        let own = |x: &[f64]| {
            x.iter()
                .skip(j)
                .step_by(2)
                .map(|x| x - 1.0)
                .collect::<Vec<f64>>()
        };
        let (more, less) = (own(&more), own(&less));
        more.iter()
            .zip(&less)
            .for_each(|(a, b)| assert!((a + b).abs() < 1e-12));
        assert!(more.iter().all(|x| x.abs() <= 0.5 * interval));
        let square = more.iter().map(|x| x * x).sum::<f64>() / more.len() as f64;
        near(square, interval * interval / 12.0, 0.05);
    }
}

#[test]
fn the_bandwidth_of_scores_that_fall_by_a_share_is_that_of_andrews() {
    let of = |rho: f64, count: usize, seconds: f64, scale: f64| {
        let score = |k: usize| (0, DVector::from_element(1, scale * rho.powi(k as i32)));
        let scores: Vec<_> = (0..count).map(score).collect();
        bandwidth(&scores, 1, seconds)
    };
    for rho in [0.6_f64, 0.8, -0.7] {
        // alpha(1) of a first-order autoregression (Andrews 1991, eq. (6.4)) and the lag of Bartlett's kernel (6.2)
        let n = 400.0;
        let alpha = 4.0 * rho * rho / ((1.0 - rho).powi(2) * (1.0 + rho).powi(2));
        let lag = (1.1447 * (alpha * n).cbrt()).clamp(4.0, n / 5.0);
        near(of(rho, 400, 0.25, 1.0), lag, 1e-9);
        near(of(rho, 400, 0.25, 1e3), lag, 1e-9);
    }
    // of nothing there is no correlation, and filters alone correlate neighbours
    assert_eq!(of(0.0, 1, 0.25, 1.0), 0.0);
    near(of(0.01, 400, 0.25, 1.0), 4.0, 1e-9);
    // correlation that lasts is at most a fifth of the record
    near(of(0.999, 50, 0.25, 1.0), 10.0, 1e-9);
    // blocks a fifth as long hold five to a neighbour
    near(of(0.01, 400, 0.05, 1.0), 24.0, 1e-9);
    // of blocks that are longer fewer count
    near(of(0.01, 400, 0.5, 1.0), 1.5, 1e-9);
}
