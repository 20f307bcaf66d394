//! Errors of a model on logs: those of the log that is read are those of the log in memory, and known errors are found.

use std::convert::Infallible;

use cft_ident_core::block::Block;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::motion::{FilterSettings, ParallelFilters, Stretch, stretches};
use cft_ident_core::robot::model::Model;
use cft_ident_core::validate::{SummedRows, TorqueErrors, TorqueReconstruction};

use crate::diagnosis_bench::{Chance, DT};
use crate::effect_bench::machines;

fn model() -> Model {
    let arm = machines().into_iter().find(|m| m.name == "arm");
    arm.expect("it is one").model
}

/// A log of the arm, its torques off by a part of themselves, a constant and noise; a pause, and a rest of the first joint.
fn log(part: f64, constant: f64, noise: f64) -> Block {
    logged([part, constant, noise], 1200..1500)
}

fn logged([part, constant, noise]: [f64; 3], rest: std::ops::Range<usize>) -> Block {
    let machine = machines()
        .into_iter()
        .find(|m| m.name == "arm")
        .expect("it is one");
    let mut stretch = machine.stretch(30.0);
    for k in rest.clone() {
        stretch.q[0][k] = stretch.q[0][rest.start];
    }
    let mut chance = Chance(3);
    let mut out = Block::default();
    for k in (0..stretch.len()).filter(|k| !(2000..2050).contains(k)) {
        out.t.push(DT * k as f64);
        for j in 0..2 {
            out.q.push(stretch.q[j][k]);
            let tau = stretch.tau[j][k];
            out.tau
                .push((1.0 + part) * tau + constant + noise * chance.next());
        }
    }
    out
}

fn settings() -> FilterSettings {
    FilterSettings {
        decimation: Some(3),
        ..FilterSettings::default()
    }
}

fn once(block: &Block) -> impl FnMut(&mut Block) -> Result<bool, Infallible> {
    let mut given = Some(block.clone());
    move |block| {
        *block = given.take().unwrap_or_default();
        Ok(false)
    }
}

const RESTS: [f64; 2] = [0.02; 2];

/// By the log that is read, and every raw row.
fn read(block: &Block) -> (TorqueErrors, usize, Vec<f64>) {
    let model = model();
    let mut all = TorqueReconstruction::new(&model, &RESTS, None);
    let mut rows = 0;
    let summary = all.add(&settings(), &mut once(block), &mut |r| {
        assert_eq!((r.q.len(), r.measured.len(), r.half_width.len()), (2, 2, 2));
        rows += 1;
        let fast = [0, 1].map(|j| r.v[j].abs() > RESTS[j]);
        assert_eq!([0, 1].map(|j| r.moving[j] > 0.0), fast, "row {rows}");
    });
    let found = all.finish(summary.expect("a log that can be filtered"));
    assert_eq!(found.summary.decimation, 3);
    (found.errors, rows, found.traces.measured)
}

/// The same by stretches in memory.
fn in_memory(block: &Block) -> (TorqueErrors, usize, Vec<f64>) {
    let model = model();
    let (parts, summary) = stretches(0, 2, &settings(), &mut once(block)).expect("a log");
    assert_eq!(parts.len(), 2);
    let mut all = TorqueReconstruction::new(&model, &RESTS, None);
    let mut rows = 0;
    let augmented = AugmentedModel::plain(model.clone());
    for (segment, stretch) in parts.iter().enumerate() {
        let hat = augmented.reconstruct(stretch);
        let added = all.add_stretch(&settings(), segment, stretch, &hat, &mut |_| rows += 1);
        added.expect("it can be filtered");
    }
    let found = all.finish(summary);
    (found.errors, rows, found.traces.measured)
}

#[track_caller]
fn near(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * b.abs().max(1e-12), "{a} {b}");
}

#[test]
fn a_log_in_memory_has_the_errors_of_the_log_that_is_read() {
    let block = log(0.1, 0.3, 2.0);
    let ((a, a_rows, a_trace), (b, b_rows, b_trace)) = (read(&block), in_memory(&block));
    assert_eq!(a_rows, b_rows);
    assert_eq!(a_trace.len(), b_trace.len());
    a_trace
        .iter()
        .zip(&b_trace)
        .for_each(|(a, b)| near(*a, *b, 1e-6));
    for (a, b) in a.joints.iter().zip(&b.joints) {
        assert_eq!((a.samples, a.resting), (b.samples, b.resting));
        near(a.rmse, b.rmse, 1e-6);
        near(a.relative_error_raw, b.relative_error_raw, 1e-6);
        near(a.headline(), b.headline(), 1e-6);
        near(a.r2, b.r2, 1e-6);
        near(a.max_abs, b.max_abs, 1e-6);
    }
    assert!(a.joints[0].resting > 20 && a.joints[0].moves());
    near(
        a.overall.mean_relative_error,
        b.overall.mean_relative_error,
        1e-6,
    );
}

#[test]
fn a_torque_that_is_off_by_a_part_of_itself_has_that_relative_error() {
    let (found, ..) = read(&logged([0.25, 0.0, 0.0], 0..0));
    // of the torque as it is logged
    let part = 0.25 / 1.25;
    for joint in &found.joints {
        near(joint.headline(), part, 0.02);
        near(joint.relative_error_raw, part, 0.1);
        assert!(joint.r2 > 0.9);
    }
    let relative = found.overall.relative_error_moving.expect("one unit");
    near(relative, part, 0.02);
    near(found.overall.mean_relative_error_moving, part, 0.02);
}

#[test]
fn errors_of_logs_are_those_of_their_rows_together() {
    let (one, other) = (log(0.1, 0.0, 2.0), log(0.0, 0.5, 2.0));
    let model = model();
    let mut all = TorqueReconstruction::new(&model, &RESTS, None);
    for block in [&one, &other] {
        all.add(&settings(), &mut once(block), &mut |_| {})
            .expect("a log");
        all.end_log();
    }
    let apart = [0, 1].map(|log| all.errors_of(|of| of == log));
    let both = all.errors_of(|_| true);
    let alone = [read(&one).0, read(&other).0];
    for j in 0..2 {
        let [a, b] = [&apart[0].joints[j], &apart[1].joints[j]];
        near(a.rmse, alone[0].joints[j].rmse, 1e-12);
        near(b.rmse, alone[1].joints[j].rmse, 1e-12);
        let (n, m) = (a.samples as f64, b.samples as f64);
        let square = (n * a.rmse.powi(2) + m * b.rmse.powi(2)) / (n + m);
        near(both.joints[j].rmse, square.sqrt(), 1e-9);
        assert_eq!(both.joints[j].samples, a.samples + b.samples);
        near(both.joints[j].max_abs, a.max_abs.max(b.max_abs), 1e-12);
    }
}

#[test]
fn rows_of_which_the_sums_are_known_count_as_rows() {
    let model = model();
    let mut all = TorqueReconstruction::new(&model, &RESTS, None);
    let rows = SummedRows {
        error: [8.0, 1.0],
        torque: [200.0, 25.0],
        rows: [20, 5],
    };
    all.add_sums(0, &rows);
    all.add_sums(0, &rows);
    all.end_log();
    let found = all.errors_of(|_| true);
    let joint = &found.joints[0];
    assert_eq!((joint.samples, joint.resting), (50, 10));
    near(joint.rmse, (18.0_f64 / 50.0).sqrt(), 1e-12);
    near(joint.relative_error, 0.2, 1e-12);
    near(joint.relative_error_moving.expect("it moves"), 0.2, 1e-12);
    near(
        joint.rmse_moving.expect("it moves"),
        0.2 * 10.0_f64.sqrt(),
        1e-12,
    );
    near(joint.relative_error_rest.expect("it rests"), 0.2, 1e-12);
    assert!(joint.r2.is_nan() && joint.max_abs.is_nan() && joint.relative_error_raw.is_nan());
    near(found.overall.mean_relative_error, 0.2, 1e-12);
}

#[test]
fn a_part_of_a_stretch_has_its_own_rows_and_times_and_lies_beside_it() {
    let (parts, _) = stretches(4, 2, &settings(), &mut once(&log(0.0, 0.0, 0.0))).expect("a log");
    let [first, second] = &parts[..] else {
        panic!("a pause parts two stretches")
    };
    assert_eq!((first.log, first.joints(), first.is_empty()), (4, 2, false));
    assert!(Stretch::default().is_empty() && !first.has_temperature(0));
    let pause = second.t[0] - first.t[0];
    near(second.began - first.began, pause, 1e-9);
    let part = first.part(100, 300);
    assert_eq!(part.len(), 200);
    near(part.began, first.began + 100.0 * DT, 1e-12);
    near(part.own_time(7), first.own_time(107), 1e-12);
    let (mut a, mut b) = ([[0.0; 2]; 3], [[0.0; 2]; 3]);
    for k in [0, 57, 199] {
        let [q, v, x] = &mut a;
        part.at(k, q, v, x);
        let [q, v, x] = &mut b;
        first.at(100 + k, q, v, x);
        assert_eq!(a, b);
    }
    // the whole beside its part is the part; a part beside the whole does not reach as far
    let beside = first.beside(&part).expect("it reaches as far");
    assert_eq!(
        (beside.q, beside.tau, beside.v),
        (part.q.clone(), part.tau.clone(), part.v.clone())
    );
    assert!(part.beside(first).is_none());
    assert!(second.beside(&part).is_none());
    let mut slower = part.clone();
    slower.dt *= 2.0;
    assert!(first.beside(&slower).is_none());
    // rows of a filter are those of its channels, and as many as it says
    let filters = ParallelFilters::design(&settings(), &parts).expect("a rate");
    let parallel = filters.of(first);
    let rows = parallel
        .run(&[&first.q[0], &first.tau[1]])
        .expect("long enough");
    assert_eq!(rows[0].len(), parallel.rows(first.len()));
    let mut whole = first.tau[1].clone();
    parallel.smooth(&mut whole).expect("long enough");
    for (i, x) in rows[1].iter().enumerate() {
        near(*x, whole[parallel.sample_of(i)], 1e-7);
    }
    near(filters.row_rate_hz(), 1.0 / (3.0 * DT), 1e-9);
}
