//! Speed of the stages that decide how long an identification takes, each beside a plain way of
//! doing the same, so that what is quoted is a ratio: the filter, and the regressor with its
//! accumulation. `cargo bench --bench pipeline`.

use std::hint::black_box;
use std::path::Path;

use cft_ident::config::RobotFile;
use cft_ident::friction::filter::ExtendedKalmanFilter;
use cft_ident::friction::passes::spread;
use cft_ident::friction::problem::{FRICTION, FrictionProblem, JointRecord, NoiseLevels};
use cft_ident::friction::score::score;
use cft_ident::math::rfactor::RFactor;
use cft_ident::robot::Robot;
use cft_ident::robot::cft::{LaboratorySetup, ParameterStructure};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{DMatrix, DVector};

const SAMPLES: usize = 20_000;
const NUISANCE: usize = 5;

/// A one-joint record of 20 s with a nuisance of five, as q1 of the CFT robot has.
fn problem() -> FrictionProblem {
    let t: Vec<f64> = (0..SAMPLES).map(|k| k as f64 * 1e-3).collect();
    let y: Vec<f64> = t.iter().map(|t| 0.2 * (1.3 * t).sin()).collect();
    let tau = t[1..]
        .iter()
        .map(|t| 60.0 * (1.3 * t).cos().signum() - 40.0 * (1.3 * t).sin());
    FrictionProblem {
        records: vec![JointRecord {
            r: vec![2e-12; SAMPLES],
            tau: tau.collect(),
            m: (0..SAMPLES - 1)
                .flat_map(|_| [100.0, 0.0, 0.0, 0.0, 0.0])
                .collect(),
            h: t[1..]
                .iter()
                .flat_map(|t| [0.0, t.sin(), t.cos(), 0.1, 1.0])
                .collect(),
            v0: 0.26,
            t,
            y,
        }],
        nuisance: NUISANCE,
        torque_scale: 60.0,
        velocity_scale: 0.2,
        slope_range: (0.1, 1e4),
        least_inertia: 0.1,
    }
}

fn start(problem: &FrictionProblem) -> Vec<f64> {
    let mut p = vec![0.5, 0.8, -0.3, 3.0, 1.0];
    p.resize(problem.parameters(), 0.1);
    p[FRICTION] = 1.2;
    p
}

/// The same filter with dense matrices, written as the equations stand: P' = Phi P Phi' + Q and
/// P = (I - K H) P, new matrices at every sample.
fn dense(problem: &FrictionProblem, start: &[f64]) -> DVector<f64> {
    let n = 2 + problem.parameters();
    let record = &problem.records[0];
    let mut x = DVector::zeros(n);
    x.rows_mut(2, n - 2).copy_from_slice(start);
    x[1] = record.v0;
    let mut p = DMatrix::<f64>::identity(n, n);
    for k in 0..record.tau.len() {
        let dt = record.t[k + 1] - record.t[k];
        let e = k * NUISANCE..(k + 1) * NUISANCE;
        let eta = x.rows(2 + FRICTION, NUISANCE).into_owned();
        let m: f64 = record.m[e.clone()]
            .iter()
            .zip(eta.iter())
            .map(|(a, b)| a * b)
            .sum();
        let h: f64 = record.h[e.clone()]
            .iter()
            .zip(eta.iter())
            .map(|(a, b)| a * b)
            .sum();
        let (w1, w2) = (x[5].exp() / 0.2, x[6].exp() / 0.2);
        let force =
            |v: f64| 60.0 * (x[2] * v / 0.2 + x[3] * (w1 * v).tanh() + x[4] * (w2 * v).tanh());
        let acc = |v: f64| (record.tau[k] - h - force(v)) / m;
        let v = x[1];
        let k1 = acc(v);
        let k2 = acc(v + 0.5 * dt * k1);
        let k3 = acc(v + 0.5 * dt * k2);
        let k4 = acc(v + dt * k3);
        let mut phi = DMatrix::<f64>::identity(n, n);
        phi[(0, 1)] = dt;
        let (t1, t2) = ((w1 * v).tanh(), (w2 * v).tanh());
        let slope = 60.0 * (x[2] / 0.2 + x[3] * w1 * (1.0 - t1 * t1) + x[4] * w2 * (1.0 - t2 * t2));
        phi[(1, 1)] = (-slope / m * dt).exp();
        let g = [
            v / 0.2,
            t1,
            t2,
            x[3] * w1 * v * (1.0 - t1 * t1),
            x[4] * w2 * v * (1.0 - t2 * t2),
        ];
        for (j, g) in g.iter().enumerate() {
            phi[(1, 2 + j)] = -60.0 * g / m * dt;
        }
        for j in 0..NUISANCE {
            phi[(1, 7 + j)] = -(record.h[e.start + j] + record.m[e.start + j] * k1) / m * dt;
        }
        x[0] += dt * v + dt * dt / 6.0 * (k1 + k2 + k3);
        x[1] += dt / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
        p = &phi * p * phi.transpose();
        p[(1, 1)] += (0.5 / m * dt).powi(2);
        let s = p[(0, 0)] + record.r[k + 1];
        let gain = p.column(0) / s;
        let innovation = record.y[k + 1] - x[0];
        x += &gain * innovation;
        let row = p.row(0).into_owned();
        p -= &gain * row;
    }
    x
}

fn filter(c: &mut Criterion) {
    let problem = problem();
    let p = start(&problem);
    let noise = NoiseLevels {
        torque: 0.5,
        position_factor: 1.0,
    };
    let mut group = c.benchmark_group("friction filter, 12 states");
    group
        .throughput(Throughput::Elements(SAMPLES as u64))
        .sample_size(10);
    group.bench_function("filter pass", |b| {
        let mut filter = ExtendedKalmanFilter::new(&problem);
        let spread = spread(&problem);
        b.iter(|| black_box(filter.pass(&problem, &p, &spread, noise)));
    });
    group.bench_function("score at fixed parameters", |b| {
        b.iter(|| black_box(score(&problem, &p, noise, 250)));
    });
    group.bench_function("plain: dense matrices", |b| {
        b.iter(|| black_box(dense(&problem, &p)))
    });
    group.finish();
}

fn regressor(c: &mut Criterion) {
    let robot = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Printed12);
    let rows: Vec<[f64; 12]> = (0..4096)
        .map(|k| {
            let t = f64::from(k) * 0.01;
            std::array::from_fn(|i| {
                0.4 * (t * (1.0 + 0.1 * i as f64)).sin() + if i == 3 { 1.5 } else { 0.0 }
            })
        })
        .collect();
    let mut group = c.benchmark_group("regressor 4 x 12");
    group
        .throughput(Throughput::Elements(rows.len() as u64))
        .sample_size(20);
    let mut y = [0.0; 48];
    group.bench_function("regressor", |b| {
        b.iter(|| {
            for x in &rows {
                robot.regressor(&x[..4], &x[4..8], &x[8..], &mut y);
                black_box(&y);
            }
        });
    });
    group.bench_function("regressor and R factor", |b| {
        let mut factor = RFactor::new(13);
        let mut row = [0.0; 52];
        b.iter(|| {
            for x in &rows {
                robot.regressor(&x[..4], &x[4..8], &x[8..], &mut y);
                for j in 0..4 {
                    row[13 * j..13 * j + 12].copy_from_slice(&y[12 * j..12 * j + 12]);
                    row[13 * j + 12] = x[j];
                }
                factor.fold(&row);
            }
            black_box(factor.rows())
        });
    });
    group.bench_function("plain: regressor and normal equations", |b| {
        b.iter(|| {
            let mut normal = DMatrix::<f64>::zeros(13, 13);
            let mut row = DVector::<f64>::zeros(13);
            for x in &rows {
                robot.regressor(&x[..4], &x[4..8], &x[8..], &mut y);
                for j in 0..4 {
                    row.rows_mut(0, 12).copy_from_slice(&y[12 * j..12 * j + 12]);
                    row[12] = x[j];
                    normal.ger(1.0, &row, &row, 1.0);
                }
            }
            black_box(normal)
        });
    });
    group.finish();
}

/// The TX40's 40 base parameters: its chain is timed beside Pinocchio by benches/pinocchio/run.sh.
fn serial(c: &mut Criterion) {
    const STATES: usize = 1000;
    let file = RobotFile::load(Path::new("configs/tx40.toml")).expect("a robot file");
    let robot = file.robot();
    let p = robot.parameters().len();
    let states: Vec<[[f64; 6]; 3]> = (0..STATES)
        .map(|k| {
            let t = k as f64 * 0.37;
            let of = |scale: f64, rate: f64| {
                std::array::from_fn(|i| scale * (t * (rate + 0.1 * i as f64)).sin())
            };
            [of(3.0, 1.0), of(2.0, 1.7), of(8.0, 2.3)]
        })
        .collect();
    let mut group = c.benchmark_group("regressor of six joints");
    group.throughput(Throughput::Elements(STATES as u64));
    let mut y = vec![0.0; 6 * p];
    group.bench_function("regressor", |b| {
        b.iter(|| {
            for [q, v, a] in &states {
                robot.regressor(q, v, a, &mut y);
                black_box(&y);
            }
        });
    });
    group.bench_function("regressor and R factor", |b| {
        let mut factor = RFactor::new(p + 1);
        let mut row = vec![0.0; p + 1];
        b.iter(|| {
            for [q, v, a] in &states {
                robot.regressor(q, v, a, &mut y);
                for (y, q) in y.chunks_exact(p).zip(q) {
                    row[..p].copy_from_slice(y);
                    row[p] = *q;
                    factor.fold(&row);
                }
            }
            black_box(factor.rows())
        });
    });
    group.finish();
}

criterion_group!(benches, filter, regressor, serial);
criterion_main!(benches);
