//! Measured logs. They lie beside the repository; without them these tests say that they skip.

use std::convert::Infallible;
use std::path::Path;

use cft_ident_core::block::Block;
use cft_ident_core::math::rank;
use cft_ident_core::math::rfactor::RFactor;
use cft_ident_core::motion::{
    self, DifferenceFormula, FilterSettings, FilteredRow, MotionSample, ParallelFilter, Summary,
};

/// The named columns of a file, row by row; none where the data folder is absent.
fn read<const N: usize>(name: &str, columns: [&str; N]) -> Option<Vec<[f64; N]>> {
    let path = Path::new(cft_ident_support::ROOT)
        .join("../shared/data")
        .join(name);
    if !path.exists() {
        eprintln!("SKIPPED: no {} beside the repository", path.display());
        return None;
    }
    let mut reader = csv::Reader::from_path(path).expect("a readable file");
    let header = reader.headers().expect("a header").clone();
    let at = columns.map(|name| {
        let found = header.iter().position(|column| column == name);
        found.expect("the column is there")
    });
    let rows = reader.records().map(|record| {
        let record = record.expect("a row");
        at.map(|i| record[i].parse().expect("a number"))
    });
    Some(rows.collect())
}

/// Hands out rows of t, q of all joints, tau of all joints.
fn blocks<const N: usize>(
    log: &[[f64; N]],
) -> impl FnMut(&mut Block) -> Result<bool, Infallible> + '_ {
    let joints = (N - 1) / 2;
    let mut blocks = log.chunks(4096);
    move |block: &mut Block| {
        let Some(rows) = blocks.next() else {
            return Ok(false);
        };
        for row in rows {
            block.t.push(row[0]);
            block.q.extend_from_slice(&row[1..=joints]);
            block.tau.extend_from_slice(&row[1 + joints..]);
        }
        Ok(true)
    }
}

/// The processing published with the EMPS benchmark (Janot, Gautier and Brunot 2019).
fn settings(trim_s: f64) -> FilterSettings {
    FilterSettings {
        cutoff_hz: 40.0,
        filter: ParallelFilter::Chebyshev {
            order: 8,
            ripple_db: 0.05,
        },
        decimation: Some(10),
        q_cutoff_hz: Some(100.0),
        q_order: 4,
        differences: DifferenceFormula::Central,
        q_trim_s: Some(0.0),
        trim_s: Some(trim_s),
        ..FilterSettings::default()
    }
}

/// R factor of [a, v, sign v, 1 | tau].
fn factor(log: &[[f64; 3]], settings: &FilterSettings) -> RFactor {
    let mut factor = RFactor::new(5);
    let summary = motion::run(
        &mut blocks(log),
        1,
        settings,
        None,
        5,
        &|s: &MotionSample<'_>, y: &mut [f64]| {
            let v = s.v[0];
            let sign = if v == 0.0 { 0.0 } else { v.signum() };
            y.copy_from_slice(&[s.a[0], v, sign, 1.0, s.tau[0]]);
        },
        &mut |row: &FilteredRow<'_>| factor.fold(row.filtered),
    )
    .expect("a log that can be filtered");
    assert_eq!(
        (summary.samples, summary.segments, summary.interpolated),
        (24841, 1, 0)
    );
    assert_eq!(summary.rows, factor.rows());
    factor
}

/// Error of `theta` in percent of the torque.
fn relative_error(factor: &RFactor, theta: &nalgebra::DVector<f64>) -> f64 {
    let r = factor.r();
    let tau = r.column(4).into_owned();
    100.0 * (&tau - r.columns(0, 4) * theta).norm() / tau.norm()
}

#[test]
fn published_processing_on_the_measured_log_gives_the_figures_of_numpy() {
    let columns = ["t", "q1", "tau1"];
    let (Some(identification), Some(validation)) = (
        read("emps/emps_id.csv", columns),
        read("emps/emps_pulses_val.csv", columns),
    ) else {
        return;
    };
    // Figures of numpy and scipy, same processing.
    // (dropped at each end [s], rows, parameters, errors on both logs [%], condition number)
    let cases = [
        (
            0.0,
            2485,
            [95.09964109, 202.15379536, 20.53589688, -3.16170446],
            [4.645527248672144, 6.312847684567384],
            25.97902731841721,
        ),
        (
            0.01,
            2483,
            [95.09452608, 203.4925423, 20.39724726, -3.17453933],
            [4.050044390120878, 5.9538903778358705],
            25.991801714468806,
        ),
    ];
    for (trim_s, rows, parameters, errors, condition) in cases {
        let id = factor(&identification, &settings(trim_s));
        let val = factor(&validation, &settings(trim_s));
        assert_eq!(id.rows(), rows);
        let r = id.r();
        let theta = r
            .view((0, 0), (4, 4))
            .solve_upper_triangular(&r.column(4).rows(0, 4).into_owned())
            .expect("full rank");
        for (found, expected) in theta.iter().zip(parameters) {
            assert!((found / expected - 1.0).abs() < 1e-5, "{found}, {expected}");
        }
        for (log, expected) in [(&id, errors[0]), (&val, errors[1])] {
            let found = relative_error(log, &theta);
            assert!((found - expected).abs() < 1e-4, "{found}, {expected}");
        }
        let s = rank::svd(&r.columns(0, 4).into_owned()).expect("finite").s;
        assert!((rank::condition(&s) / condition - 1.0).abs() < 1e-5);
    }
}

/// Relative difference, per joint, between velocities differentiated here and velocities that the
/// robot logged, both through the parallel filter.
fn velocity_errors<const N: usize>(
    log: &[[f64; N]],
    settings: &FilterSettings,
) -> (Vec<f64>, Summary) {
    let joints = (N - 1) / 2;
    let mut sums = vec![[0.0; 2]; joints];
    let summary = motion::run(
        &mut blocks(log),
        joints,
        settings,
        None,
        2 * joints,
        &|s: &MotionSample<'_>, y: &mut [f64]| {
            y[..joints].copy_from_slice(s.v);
            y[joints..].copy_from_slice(s.tau);
        },
        &mut |row: &FilteredRow<'_>| {
            for (j, sum) in sums.iter_mut().enumerate() {
                let (found, logged) = (row.filtered[j], row.filtered[joints + j]);
                sum[0] += (found - logged).powi(2);
                sum[1] += logged.powi(2);
            }
        },
    )
    .expect("a log that can be filtered");
    let errors = sums.iter().map(|[off, size]| (off / size).sqrt());
    (errors.collect(), summary)
}

#[test]
fn velocities_of_a_log_with_an_uneven_clock_are_those_that_the_robot_logged() {
    let Some(log) = read(
        "panda/panda_exciting.csv",
        [
            "t", "q1", "q2", "q3", "q4", "q5", "q6", "q7", "dq1", "dq2", "dq3", "dq4", "dq5",
            "dq6", "dq7",
        ],
    ) else {
        return;
    };
    let (errors, summary) = velocity_errors(&log, &FilterSettings::default());
    assert_eq!((summary.samples, summary.segments), (20544, 5));
    assert_eq!(summary.skipped.segments, 0);
    assert!(errors.iter().all(|e| *e < 0.02), "{errors:?}");
}

#[test]
fn velocities_of_a_slow_log_are_those_that_the_robot_logged() {
    let Some(log) = read(
        "ur10/ur10_exciting.csv",
        [
            "t", "q1", "q2", "q3", "q4", "q5", "q6", "dq1", "dq2", "dq3", "dq4", "dq5", "dq6",
        ],
    ) else {
        return;
    };
    let (errors, summary) = velocity_errors(&log, &FilterSettings::default());
    assert_eq!((summary.samples, summary.segments), (3441, 1));
    assert!(errors.iter().all(|e| *e < 0.006), "{errors:?}");
}
