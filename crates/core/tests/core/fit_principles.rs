//! What least squares must satisfy whatever the rows are: invariances, and what two sets of rows are together.

use cft_ident_core::inertia::accumulate::{BlockFactors, RowAccumulator};
use cft_ident_core::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident_core::inertia::solve::{Fit, RowWeighting, fit, residual_of};
use cft_ident_core::robot::{JointKind, Robot};
use nalgebra::DVector;

/// Inertia, viscous friction, Coulomb friction, offset.
const TRUE: [f64; 4] = [1.3, 0.7, 2.1, -0.4];
const STEP: f64 = 0.01;
const COUNT: usize = 3000;

/// Speed, acceleration and torque of one row.
type Row = [f64; 3];

/// Columns of one joint whose rows count from this speed on.
pub fn columns_of_one_joint(rest_speed: Vec<f64>) -> RegressorColumns {
    RegressorColumns {
        joints: 1,
        shared: 1,
        own: vec![vec![
            JointTerm::Viscous,
            JointTerm::Coulomb,
            JointTerm::Offset,
        ]],
        known: vec![None],
        rest_speed,
    }
}

fn columns() -> RegressorColumns {
    columns_of_one_joint(Vec::new())
}

fn regressor([v, a, _]: &Row) -> [f64; 4] {
    [*a, *v, v.signum(), 1.0]
}

fn torque(row: &Row, theta: &[f64; 4]) -> f64 {
    regressor(row).iter().zip(theta).map(|(x, t)| x * t).sum()
}

/// Rows of a motion over several frequencies, their torques with noise of this size.
fn rows(noise: f64, seed: u32) -> Vec<Row> {
    let mut state = seed;
    let mut uniform = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24) - 0.5
    };
    (0..COUNT)
        .map(|k| {
            let t = STEP * k as f64 + f64::from(seed);
            let waves = [(0.8, 1.7, 0.3), (0.5, 4.1, 1.0), (0.2, 9.3, 2.0)];
            let v = waves.iter().map(|(s, w, p)| s * (w * t + p).sin()).sum();
            let a = waves
                .iter()
                .map(|(s, w, p)| s * w * (w * t + p).cos())
                .sum();
            let row = [v, a, 0.0];
            [v, a, torque(&row, &TRUE) + noise * uniform()]
        })
        .collect()
}

fn sums(rows: &[Row]) -> BlockFactors {
    let columns = columns();
    let robot = Robot::single_joint("q1", JointKind::Prismatic);
    let mut all = RowAccumulator::new(columns.clone(), 0.05);
    let mut channels = vec![0.0; columns.channels()];
    for [v, a, tau] in rows {
        columns.fill(&robot, &[0.0], &[*v], &[*a], &[*tau], &mut channels);
        all.add(0, STEP, &channels);
    }
    all.finish()
}

fn fitted(rows: &[Row], weighting: RowWeighting) -> Fit {
    fit(&sums(rows), weighting).expect("rows that determine all")
}

#[track_caller]
fn near(found: &DVector<f64>, expected: &DVector<f64>, relative: f64) {
    let off = (found - expected).norm() / expected.norm();
    assert!(off < relative, "{found} {expected}: {off:e}");
}

#[test]
fn torques_without_noise_give_back_what_made_them() {
    for weighting in [RowWeighting::Ols, RowWeighting::Wls] {
        let found = fitted(&rows(0.0, 1), weighting);
        near(&found.theta, &DVector::from_row_slice(&TRUE), 1e-10);
        assert!(found.relative_error[0].all < 1e-9);
        assert_eq!((found.rank, found.rows), (4, COUNT as u64));
        assert!(found.determined.iter().all(|known| *known));
    }
}

#[test]
fn torques_in_another_unit_scale_parameters_and_deviations_alike() {
    let plain = rows(0.5, 2);
    let scaled: Vec<Row> = plain
        .iter()
        .map(|[v, a, tau]| [*v, *a, 1000.0 * tau])
        .collect();
    let [a, b] = [&plain, &scaled].map(|rows| fitted(rows, RowWeighting::Wls));
    near(&b.theta, &(1000.0 * &a.theta), 1e-9);
    let [a_std, b_std] = [&a, &b].map(|f| f.covariance.diagonal().map(f64::sqrt));
    near(&b_std, &(1000.0 * &a_std), 1e-7);
    assert!((b.relative_error[0].all / a.relative_error[0].all - 1.0).abs() < 1e-9);
    let conditions = [&a, &b].map(|f| f.condition.raw.expect("a full rank"));
    assert!((conditions[1] / conditions[0] - 1.0).abs() < 1e-9);
}

#[test]
fn torques_of_more_parameters_move_the_fit_by_those_and_change_no_residual() {
    let plain = rows(0.5, 3);
    let more = [0.2, -0.1, 0.9, 5.0];
    let moved: Vec<Row> = (plain.iter())
        .map(|row| [row[0], row[1], row[2] + torque(row, &more)])
        .collect();
    let [a, b] = [&plain, &moved].map(|rows| fitted(rows, RowWeighting::Wls));
    near(&(b.theta - &a.theta), &DVector::from_row_slice(&more), 1e-9);
    assert!((b.residual_std[0] / a.residual_std[0] - 1.0).abs() < 1e-9);
    near(&b.covariance.diagonal(), &a.covariance.diagonal(), 1e-6);
}

#[test]
fn what_is_left_is_at_right_angles_to_every_column() {
    let rows = rows(0.5, 4);
    let found = fitted(&rows, RowWeighting::Ols);
    let theta: [f64; 4] = std::array::from_fn(|i| found.theta[i]);
    let (mut along, mut size) = ([0.0; 4], [0.0; 4]);
    let mut square = 0.0;
    for row in &rows {
        let left = row[2] - torque(row, &theta);
        square += left * left;
        for (i, x) in regressor(row).iter().enumerate() {
            along[i] += x * left;
            size[i] += x * x;
        }
    }
    for (along, size) in along.iter().zip(&size) {
        assert!(along.abs() < 1e-9 * (size * square).sqrt(), "{along}");
    }
    let expected = (square / COUNT as f64).sqrt();
    let residual = residual_of(&sums(&rows), &found.theta).expect("sums of these columns");
    assert!(
        (residual[0] / expected - 1.0).abs() < 0.01,
        "{residual:?} {expected}"
    );
}

#[test]
fn time_that_runs_backwards_gives_the_same_parameters() {
    let plain = rows(0.5, 5);
    // positions retrace their way: speeds turn their sign, and with them friction
    let back: Vec<Row> = (plain.iter().rev())
        .map(|row| {
            let turned = [-row[0], row[1], 0.0];
            let left = row[2] - torque(row, &TRUE);
            [turned[0], turned[1], torque(&turned, &TRUE) + left]
        })
        .collect();
    let [a, b] = [&plain, &back].map(|rows| fitted(rows, RowWeighting::Wls).theta);
    // even columns keep their estimate, odd ones their error with the other sign
    for i in [0, 3] {
        assert!((a[i] - b[i]).abs() < 1e-9, "{i}");
    }
    for i in [1, 2] {
        assert!((a[i] + b[i] - 2.0 * TRUE[i]).abs() < 1e-9, "{i}");
    }
}

#[test]
fn logs_together_are_their_rows_in_any_order() {
    let (one, other) = (rows(0.5, 6), rows(0.5, 7));
    let together = |first: &[Row], second: &[Row]| {
        let mut all = sums(first);
        all.merge(sums(second));
        fit(&all, RowWeighting::Ols).expect("rows that determine all")
    };
    let [a, b] = [together(&one, &other), together(&other, &one)];
    near(&a.theta, &b.theta, 1e-12);
    near(&a.covariance.diagonal(), &b.covariance.diagonal(), 1e-6);
    let whole = fitted(&[one, other].concat(), RowWeighting::Ols);
    near(&a.theta, &whole.theta, 1e-10);
    assert_eq!(a.rows, whole.rows);
}

#[test]
fn twice_the_rows_halve_the_variance_and_their_own_copy_moves_nothing() {
    let one = rows(0.5, 8);
    let alone = fitted(&one, RowWeighting::Ols);
    let mut twice = sums(&one);
    twice.merge(sums(&one));
    let twice = fit(&twice, RowWeighting::Ols).expect("rows that determine all");
    near(&twice.theta, &alone.theta, 1e-10);
    for i in 0..4 {
        let ratio = twice.covariance[(i, i)] / alone.covariance[(i, i)];
        assert!((0.4..0.6).contains(&ratio), "{i}: {ratio}");
    }
}

#[test]
fn deviations_are_those_of_fits_to_other_noise() {
    let (mut squares, mut promised) = ([0.0; 4], [0.0; 4]);
    let runs = 200;
    for seed in 0..runs {
        let found = fitted(&rows(0.5, 100 + seed), RowWeighting::Ols);
        for i in 0..4 {
            squares[i] += (found.theta[i] - TRUE[i]).powi(2);
            promised[i] += found.covariance[(i, i)];
        }
    }
    // of 200 fits a variance is known to 10 %
    for (square, promised) in squares.iter().zip(&promised) {
        let ratio = square / promised;
        assert!((0.65..1.5).contains(&ratio), "{ratio}");
    }
}
