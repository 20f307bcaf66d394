//! Gaps, lost rows, uneven clocks, and logs that cannot be used.

use std::convert::Infallible;

use cft_ident_core::block::Block;
use cft_ident_core::math::MathError;
use cft_ident_core::motion::{
    self, FilterSettings, FilteredRow, MotionError, MotionSample, RunError, Summary,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn position(t: f64) -> f64 {
    0.8 * (3.0 * t).sin() + 0.1 * (14.0 * t).cos()
}

fn velocity(t: f64) -> f64 {
    2.4 * (3.0 * t).cos() - 1.4 * (14.0 * t).sin()
}

fn acceleration(t: f64) -> f64 {
    -7.2 * (3.0 * t).sin() - 19.6 * (14.0 * t).cos()
}

fn torque(t: f64) -> f64 {
    5.0 * acceleration(t) + 2.0
}

/// One kept row: t, segment, position, velocity, acceleration, filtered acceleration and torque.
type Kept = (f64, usize, [f64; 3], [f64; 2]);

fn run_block(block: Block, settings: &FilterSettings) -> Result<(Vec<Kept>, Summary), MotionError> {
    let mut source = Some(block);
    let mut rows = Vec::new();
    let outcome = motion::run::<Infallible>(
        &mut |out: &mut Block| {
            if let Some(block) = source.take() {
                *out = block;
                return Ok(true);
            }
            Ok(false)
        },
        1,
        settings,
        None,
        2,
        &|s: &MotionSample<'_>, y: &mut [f64]| y.copy_from_slice(&[s.a[0], s.tau[0]]),
        &mut |row: &FilteredRow<'_>| {
            rows.push((
                row.t,
                row.segment,
                [row.q[0], row.v[0], row.a[0]],
                [row.filtered[0], row.filtered[1]],
            ));
        },
    );
    match outcome {
        Ok(summary) => Ok((rows, summary)),
        Err(RunError::Motion(error)) => Err(error),
        Err(RunError::Source(never)) => match never {},
    }
}

fn run(t: &[f64], settings: &FilterSettings) -> Result<(Vec<Kept>, Summary), MotionError> {
    run_block(
        Block {
            t: t.to_vec(),
            q: t.iter().map(|&t| position(t)).collect(),
            tau: t.iter().map(|&t| torque(t)).collect(),
            ..Block::default()
        },
        settings,
    )
}

fn even(samples: usize, dt: f64) -> Vec<f64> {
    (0..samples).map(|k| k as f64 * dt).collect()
}

/// Largest errors of v and a, relative to their size, and of tau = 5 a + 2 after the filter.
fn errors(rows: &[Kept]) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    for (t, _, [_, v, a], [filtered_a, filtered_tau]) in rows {
        worst[0] = worst[0].max((v - velocity(*t)).abs() / 3.8);
        worst[1] = worst[1].max((a - acceleration(*t)).abs() / 26.8);
        worst[2] = worst[2].max((5.0 * filtered_a + 2.0 - filtered_tau).abs() / 136.0);
    }
    worst
}

#[test]
fn even_rows_are_differentiated_without_error() {
    let (rows, summary) = run(&even(20_000, 1e-3), &FilterSettings::default()).expect("usable");
    assert_eq!((summary.segments, summary.interpolated), (1, 0));
    assert_eq!((summary.decimation, summary.q_cutoff_hz), (10, Some(60.0)));
    assert!((summary.dt - 1e-3).abs() < 1e-15);
    assert!((summary.duration_s - 19.999).abs() < 1e-12);
    let [v, a, tau] = errors(&rows);
    assert!(v < 1e-6 && a < 1e-6 && tau < 1e-6, "{v:e} {a:e} {tau:e}");
}

#[test]
fn rows_that_are_missing_one_by_one_are_interpolated() {
    let t: Vec<f64> = (0..20_000)
        .filter(|k| k % 97 != 50)
        .map(|k| k as f64 * 1e-3)
        .collect();
    let (rows, summary) = run(&t, &FilterSettings::default()).expect("usable");
    assert_eq!(summary.segments, 1);
    assert_eq!(summary.interpolated, 206);
    let [v, a, tau] = errors(&rows);
    assert!(v < 1e-6 && a < 1e-5 && tau < 1e-5, "{v:e} {a:e} {tau:e}");
}

#[test]
fn uneven_rows_are_put_on_an_even_grid() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let t: Vec<f64> = (0..20_000)
        .map(|k| (k as f64 + rng.random_range(-0.4..0.4)) * 1e-3)
        .collect();
    let (rows, summary) = run(&t, &FilterSettings::default()).expect("usable");
    assert!(summary.segments == 1 && summary.interpolated > 15_000);
    let [v, a, tau] = errors(&rows);
    assert!(v < 1e-5 && a < 1e-4 && tau < 1e-5, "{v:e} {a:e} {tau:e}");
}

#[test]
fn nothing_is_differentiated_across_a_gap() {
    // The clock jumps by 3 s twice; the second stretch is too short to be used.
    let t: Vec<f64> = (0..20_300)
        .map(|k| {
            k as f64 * 1e-3
                + if k >= 10_000 { 3.0 } else { 0.0 }
                + if k >= 10_300 { 3.0 } else { 0.0 }
        })
        .collect();
    let settings = FilterSettings::default();
    let (rows, summary) = run(&t, &settings).expect("usable");
    assert_eq!((summary.segments, summary.skipped.segments), (2, 1));
    assert_eq!(summary.skipped.samples, 300);
    let [from, to] = summary.skipped.spans_s[0];
    assert!((from - 13.0).abs() < 1e-9 && (to - 13.299).abs() < 1e-9);
    let [v, a, tau] = errors(&rows);
    assert!(v < 1e-6 && a < 1e-6 && tau < 1e-6, "{v:e} {a:e} {tau:e}");
    let second: Vec<_> = rows.iter().filter(|row| row.1 == 1).collect();
    assert!(second.len() > 900 && second[0].0 > 16.3);
}

#[test]
fn a_clock_that_drifts_is_followed() {
    // 1 % slower at the end than at the start.
    let t: Vec<f64> = (0..60_000)
        .map(|k| k as f64 * 1e-3 * (1.0 + 5e-3 * k as f64 / 60_000.0))
        .collect();
    let (rows, summary) = run(&t, &FilterSettings::default()).expect("usable");
    assert_eq!(summary.segments, 1);
    let [v, a, _] = errors(&rows);
    assert!(v < 2e-3 && a < 4e-3, "{v:e} {a:e}");
}

#[test]
fn times_that_are_rounded_do_no_harm() {
    let exact = even(20_000, 1.0 / 1024.0);
    let block = Block {
        t: exact.iter().map(|t| (t * 1e6).round() / 1e6).collect(),
        q: exact.iter().map(|&t| position(t)).collect(),
        tau: exact.iter().map(|&t| torque(t)).collect(),
        ..Block::default()
    };
    let (rows, summary) = run_block(block, &FilterSettings::default()).expect("usable");
    assert_eq!(summary.interpolated, 0);
    assert!((summary.dt * 1024.0 - 1.0).abs() < 1e-7);
    let [v, a, tau] = errors(&rows);
    assert!(v < 1e-5 && a < 1e-5 && tau < 1e-6, "{v:e} {a:e} {tau:e}");
}

#[test]
fn a_slow_log_keeps_every_row() {
    let settings = FilterSettings {
        cutoff_hz: 5.0,
        ..FilterSettings::default()
    };
    let (rows, summary) = run(&even(3_000, 0.02), &settings).expect("usable");
    assert_eq!((summary.decimation, summary.q_cutoff_hz), (1, Some(20.0)));
    let [v, a, _] = errors(&rows);
    assert!(v < 1e-3 && a < 1e-3, "{v:e} {a:e}");
}

#[test]
fn logs_that_cannot_be_used_say_why() {
    let settings = FilterSettings::default();
    let outcome = |t: &[f64]| run(t, &settings).map(|_| ()).expect_err("not usable");
    assert_eq!(outcome(&[]), MotionError::TooFewSamples { samples: 0 });
    assert_eq!(outcome(&[1.0]), MotionError::TooFewSamples { samples: 1 });
    assert_eq!(
        outcome(&[0.0, 1.0, 1.0, 2.0]),
        MotionError::Time {
            before: 1.0,
            after: 1.0
        }
    );
    let MotionError::NoSegment {
        segments,
        longest,
        needed,
    } = outcome(&even(200, 1e-3))
    else {
        panic!("200 samples are too few");
    };
    assert!((segments, longest) == (1, 200) && needed > 200);
    assert!(matches!(
        outcome(&even(200, 0.1)),
        MotionError::Math(MathError::Cutoff { .. })
    ));
}

#[test]
fn time_that_runs_backwards_late_in_a_log_is_found() {
    let mut t = even(30_000, 1e-3);
    t[25_000] = 1.0;
    let error = run(&t, &FilterSettings::default()).expect_err("not usable");
    assert!(matches!(error, MotionError::Time { after, .. } if after == 1.0));
}

#[test]
fn rows_that_are_missing_for_a_short_part_of_a_period_do_not_part_a_log() {
    // bursts of ten rows, every half second
    let mut t = even(20_000, 1e-3);
    let mut k = 0;
    t.retain(|_| {
        k += 1;
        k % 500 >= 10
    });
    let parted = run(&t, &FilterSettings::default()).map(|(_, summary)| summary.segments);
    let settings = FilterSettings {
        bridge_s: 0.0125,
        ..FilterSettings::default()
    };
    let (_, whole) = run(&t, &settings).expect("it is one stretch");
    assert_eq!(whole.segments, 1);
    assert!(parted.is_err() || parted.is_ok_and(|segments| segments > 1));
    // a longer one parts it all the same
    t.retain(|t| !(5.0..5.014).contains(t));
    let (_, two) = run(&t, &settings).expect("two stretches");
    assert_eq!(two.segments, 2);
}

#[test]
fn settings_out_of_range_are_named() {
    let t = even(5_000, 1e-3);
    let broken = [
        FilterSettings {
            decimation: Some(0),
            ..FilterSettings::default()
        },
        FilterSettings {
            gap_factor: 0.5,
            ..FilterSettings::default()
        },
        FilterSettings {
            trim_s: Some(-1.0),
            ..FilterSettings::default()
        },
        FilterSettings {
            q_trim_s: Some(f64::NAN),
            ..FilterSettings::default()
        },
    ];
    for (settings, expected) in
        broken
            .iter()
            .zip(["decimation", "gap_factor", "trim_s", "q_trim_s"])
    {
        let error = run(&t, settings).expect_err("out of range");
        assert!(matches!(error, MotionError::Setting { name, .. } if name == expected));
    }
    for cutoff_hz in [0.0, -1.0, f64::NAN, 600.0] {
        let settings = FilterSettings {
            cutoff_hz,
            q_cutoff_hz: Some(60.0),
            ..FilterSettings::default()
        };
        assert!(matches!(
            run(&t, &settings),
            Err(MotionError::Math(MathError::Cutoff { .. }))
        ));
    }
}

#[test]
fn a_block_of_another_width_is_refused() {
    let block = Block {
        t: vec![0.0, 1.0],
        q: vec![0.0; 4],
        tau: vec![0.0; 2],
        ..Block::default()
    };
    let error = run_block(block, &FilterSettings::default()).expect_err("two joints");
    assert!(matches!(
        error,
        MotionError::Shape {
            channel: "q",
            values: 4,
            rows: 2,
            joints: 1
        }
    ));
}

#[test]
fn a_channel_that_is_not_finite_is_placed_in_time() {
    let t = even(20_000, 1e-3);
    let mut read = false;
    let outcome = motion::run::<Infallible>(
        &mut |block: &mut Block| {
            if !read {
                block.t.clone_from(&t);
                block.q = t.iter().map(|&t| position(t)).collect();
                block.tau = vec![0.0; t.len()];
            }
            Ok(!std::mem::replace(&mut read, true))
        },
        1,
        &FilterSettings::default(),
        None,
        3,
        &|s: &MotionSample<'_>, y: &mut [f64]| {
            y.fill(1.0);
            if s.t >= 15.0 {
                y[2] = f64::NAN;
            }
        },
        &mut |_| {},
    );
    let Err(RunError::Motion(MotionError::NotFinite { channel, t, .. })) = outcome else {
        panic!("NaN must not pass");
    };
    assert_eq!((channel, t), (2, 15.0));
}

#[test]
fn an_error_of_the_source_is_passed_on() {
    let outcome = motion::run::<&str>(
        &mut |_: &mut Block| Err("interrupted"),
        1,
        &FilterSettings::default(),
        None,
        1,
        &|_: &MotionSample<'_>, _: &mut [f64]| {},
        &mut |_| {},
    );
    assert!(matches!(outcome, Err(RunError::Source("interrupted"))));
}

#[test]
fn a_record_in_memory_gives_motion_at_its_own_rows() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for jitter in [0.0, 0.3] {
        let t: Vec<f64> = (0..8_000)
            .map(|k| (k as f64 + jitter * rng.random_range(-1.0..1.0)) * 1e-3)
            .collect();
        let q: Vec<f64> = t.iter().map(|&t| position(t)).collect();
        let smooth = motion::full_rate(&t, &q, 1, &FilterSettings::default()).expect("usable");
        assert_eq!(smooth.v.len(), t.len());
        assert!(smooth.settled.len() > 7_700 && smooth.settled.start > 10);
        for k in smooth.settled.clone() {
            assert!((smooth.q[k] - q[k]).abs() < 1e-7);
            assert!((smooth.v[k] - velocity(t[k])).abs() < 1e-4, "{k}");
            assert!((smooth.a[k] - acceleration(t[k])).abs() < 1e-2, "{k}");
        }
    }
}

#[test]
fn a_record_with_a_gap_is_cut_by_the_caller() {
    let mut t = even(4_000, 1e-3);
    for time in &mut t[1_500..] {
        *time += 1.0;
    }
    let q: Vec<f64> = t.iter().map(|&t| position(t)).collect();
    let error = motion::full_rate(&t, &q, 1, &FilterSettings::default());
    assert!(
        matches!(error, Err(MotionError::Gap { from, to }) if from < 1.5 && to > 2.4),
        "{error:?}"
    );
    assert_eq!(
        motion::segments(&t, &FilterSettings::default()),
        Ok(vec![0..1_500, 1_500..4_000])
    );
}
