//! The processing published with the EMPS benchmark (Janot, Gautier and Brunot 2019), on the
//! measured log. The figures are those of numpy and scipy, same processing, to 1e-5.

use std::convert::Infallible;
use std::path::Path;

use cft_ident::log::Block;
use cft_ident::math::rank;
use cft_ident::math::rfactor::RFactor;
use cft_ident::motion::{self, Differences, ParallelFilter, Row, Sample, Settings};

/// Rows of t, q, tau; none where the data folder is absent.
fn read(name: &str) -> Option<Vec<[f64; 3]>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/data/emps")
        .join(name);
    if !path.exists() {
        eprintln!("SKIPPED: no {} beside the repository", path.display());
        return None;
    }
    let mut reader = csv::Reader::from_path(path).expect("a readable file");
    let header = reader.headers().expect("a header").clone();
    let at = ["t", "q1", "tau1"].map(|name| {
        let found = header.iter().position(|column| column == name);
        found.expect("the column is there")
    });
    let rows = reader.records().map(|record| {
        let record = record.expect("a row");
        at.map(|i| record[i].parse().expect("a number"))
    });
    Some(rows.collect())
}

fn settings(trim_s: f64) -> Settings {
    Settings {
        cutoff_hz: 40.0,
        filter: ParallelFilter::Chebyshev {
            order: 8,
            ripple_db: 0.05,
        },
        decimation: Some(10),
        q_cutoff_hz: Some(100.0),
        q_order: 4,
        differences: Differences::Central,
        q_trim_s: Some(0.0),
        trim_s: Some(trim_s),
        ..Settings::default()
    }
}

/// R factor of [a, v, sign v, 1 | tau].
fn factor(log: &[[f64; 3]], settings: &Settings) -> RFactor {
    let mut factor = RFactor::new(5);
    let mut blocks = log.chunks(4096);
    let summary = motion::run::<Infallible>(
        &mut |block: &mut Block| {
            let Some(rows) = blocks.next() else {
                return Ok(false);
            };
            block.t.extend(rows.iter().map(|row| row[0]));
            block.q.extend(rows.iter().map(|row| row[1]));
            block.tau.extend(rows.iter().map(|row| row[2]));
            Ok(true)
        },
        1,
        settings,
        None,
        5,
        &|s: &Sample<'_>, y: &mut [f64]| {
            let v = s.v[0];
            let sign = if v == 0.0 { 0.0 } else { v.signum() };
            y.copy_from_slice(&[s.a[0], v, sign, 1.0, s.tau[0]]);
        },
        &mut |row: &Row<'_>| factor.fold(row.filtered),
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
    let (Some(identification), Some(validation)) =
        (read("emps_id.csv"), read("emps_pulses_val.csv"))
    else {
        return;
    };
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
