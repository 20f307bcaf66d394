//! Condition of the regressor along the report's excitation trajectory (eq. (43), Table 3).

use cft_ident_core::robot::cft::{LaboratorySetup, pantograph, regressor};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

const A: [[f64; 4]; 4] = [
    [-0.1102, 0.0042, -0.0014, -0.0173],
    [0.1629, -0.0118, 0.1438, -0.0043],
    [1.9698, 0.0014, -0.0267, 0.0021],
    [0.0002, -0.0302, 0.0021, -0.0800],
];
const B: [[f64; 4]; 4] = [
    [0.0037, 0.0009, 0.0005, -0.0168],
    [0.0188, -0.0257, 0.0033, -0.0277],
    [0.0011, 0.0005, -0.0060, 0.0024],
    [-0.0347, 0.0273, 0.0294, 0.0447],
];
const OFFSETS: [f64; 4] = [-0.1343, 0.2766, 2.4, 0.0869];

/// x_c1..x_c4 with velocities and accelerations at time t, for the fundamental w in rad/s.
fn trajectory(t: f64, w: f64) -> [[f64; 4]; 3] {
    let mut out = [OFFSETS, [0.0; 4], [0.0; 4]];
    for i in 0..4 {
        for l in 0..4 {
            let lw = (l + 1) as f64 * w;
            let (s, c) = (lw * t).sin_cos();
            out[0][i] += (A[i][l] * s - B[i][l] * c) / lw;
            out[1][i] += A[i][l] * c + B[i][l] * s;
            out[2][i] += (B[i][l] * c - A[i][l] * s) * lw;
        }
    }
    out
}

/// Stacked regressor over whole periods.
fn stacked(w: f64, samples: usize, periods: usize) -> DMatrix<f64> {
    let mut rows = DMatrix::zeros(4 * samples * periods, 12);
    for n in 0..samples * periods {
        let [x, xd, xdd] = trajectory(TAU / w * n as f64 / samples as f64, w);
        let q = pantograph::joints(&x).unwrap();
        let v = pantograph::joint_velocities(&q, &xd).unwrap();
        let a = pantograph::joint_accelerations(&q, &v, &xdd).unwrap();
        let mut y = [[0.0; 12]; 4];
        regressor::regressor12(&q, &v, &a, &mut y);
        for i in 0..4 {
            for j in 0..12 {
                rows[(4 * n + i, j)] = y[i][j];
            }
        }
    }
    rows
}

/// Ratio of the extreme singular values: of R, by the eigenvalues of a symmetric matrix.
fn condition(matrix: &DMatrix<f64>) -> f64 {
    let r = matrix.clone().qr().r();
    let eigenvalues = (r.transpose() * r).symmetric_eigenvalues();
    (eigenvalues.max() / eigenvalues.min()).sqrt()
}

fn normalised(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = matrix.clone();
    for mut column in out.column_iter_mut() {
        let length = column.norm();
        column /= length;
    }
    out
}

#[test]
fn table_3_at_0_4_hz_has_condition_159_07_raw_and_91_73_normalised() {
    for (samples, periods) in [(25, 1), (40, 3), (250, 1), (1000, 2)] {
        let y = stacked(TAU * 0.4, samples, periods);
        let (raw, scaled) = (condition(&y), condition(&normalised(&y)));
        assert!(
            (raw - 159.07).abs() < 0.005,
            "{samples} samples a period: raw {raw}"
        );
        assert!(
            (scaled - 91.73).abs() < 0.005,
            "{samples} samples a period: normalised {scaled}"
        );
    }
}

#[test]
fn table_3_uses_28_21_26_and_9_percent_of_the_spans_and_leaves_dspace() {
    let w = TAU * 0.4;
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    for n in 0..4000 {
        let [x, ..] = trajectory(TAU / w * f64::from(n) / 4000.0, w);
        assert_eq!(LaboratorySetup::Tuedacs.limits().first_outside(&x), None);
        assert_eq!(LaboratorySetup::Dspace.limits().first_outside(&x), Some(3));
        for i in 0..4 {
            low[i] = low[i].min(x[i]);
            high[i] = high[i].max(x[i]);
        }
    }
    let spans = LaboratorySetup::Tuedacs.limits().spans();
    for (i, want) in [28.0, 21.0, 26.0, 9.0].into_iter().enumerate() {
        let used = 100.0 * (high[i] - low[i]) / spans[i];
        assert!((used - want).abs() < 0.6, "x_c{}: {used} %", i + 1);
    }
}

#[test]
fn read_as_0_4_rad_per_second_table_3_leaves_every_limit() {
    let limits = LaboratorySetup::Tuedacs.limits();
    let mut left = [false; 4];
    for n in 0..2000 {
        let [x, ..] = trajectory(TAU / 0.4 * f64::from(n) / 2000.0, 0.4);
        for i in 0..4 {
            left[i] |= x[i] < limits.lower[i] || x[i] > limits.upper[i];
        }
    }
    assert_eq!(left, [true; 4]);
}
