//! A log run through in windows gives the rows of filtering each segment as a whole.

use std::convert::Infallible;

use cft_ident_core::block::Block;
use cft_ident_core::math::sos::SosFilter;
use cft_ident_core::math::zero_phase::ZeroPhase;
use cft_ident_core::motion::{
    self, DifferenceFormula, FilterSettings, FilteredRow, MotionSample, ParallelFilter, Summary,
    TorqueTiming,
};
use proptest::prelude::*;

const JOINTS: usize = 2;
const CHANNELS: usize = 11;

#[derive(Clone, Debug)]
struct Log {
    t: Vec<f64>,
    q: Vec<f64>,
    tau: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq)]
struct Kept {
    t: f64,
    segment: usize,
    q: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    raw: Vec<f64>,
    filtered: Vec<f64>,
}

/// Two joints that move over several frequencies, with noise that repeats; stretches of the given
/// lengths with 20 steps missing between them.
fn log(stretches: &[usize], dt: f64) -> Log {
    let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    let mut k = 0_usize;
    let mut noise = 1_u32;
    let mut random = || {
        noise = noise.wrapping_mul(1664525).wrapping_add(1013904223);
        f64::from(noise >> 8) / f64::from(1 << 24) - 0.5
    };
    for &length in stretches {
        for _ in 0..length {
            let x = k as f64 * dt;
            t.push(x);
            q.push(0.7 * (2.1 * x).sin() + 0.2 * (9.0 * x).cos() + 1e-5 * random());
            q.push(2.0 + 0.3 * (5.3 * x).sin() + 1e-5 * random());
            tau.push(10.0 * (3.0 * x).sin() + random());
            tau.push(4.0 * (11.0 * x).cos() + random());
            k += 1;
        }
        k += 20;
    }
    Log { t, q, tau }
}

fn fill(sample: &MotionSample<'_>, channels: &mut [f64]) {
    channels[0] = sample.tau[0];
    channels[1] = sample.tau[1];
    for j in 0..JOINTS {
        let (q, v, a) = (sample.q[j], sample.v[j], sample.a[j]);
        channels[2 + j] = a * q.cos();
        channels[4 + j] = v * v * q.sin();
        channels[6 + j] = (50.0 * v).tanh();
        channels[8 + j] = v;
    }
    channels[10] = 1.0;
}

fn run(log: &Log, settings: &FilterSettings, block: usize) -> (Vec<Kept>, Summary) {
    let mut at = 0;
    let mut kept = Vec::new();
    let summary = motion::run::<Infallible>(
        &mut |out: &mut Block| {
            let end = (at + block).min(log.t.len());
            out.t.extend_from_slice(&log.t[at..end]);
            out.q.extend_from_slice(&log.q[at * JOINTS..end * JOINTS]);
            out.tau
                .extend_from_slice(&log.tau[at * JOINTS..end * JOINTS]);
            at = end;
            Ok(at < log.t.len())
        },
        JOINTS,
        settings,
        None,
        CHANNELS,
        &fill,
        &mut |row: &FilteredRow<'_>| {
            kept.push(Kept {
                t: row.t,
                segment: row.segment,
                q: row.q.to_vec(),
                v: row.v.to_vec(),
                a: row.a.to_vec(),
                raw: row.raw.to_vec(),
                filtered: row.filtered.to_vec(),
            });
        },
    )
    .expect("a log that can be filtered");
    (kept, summary)
}

/// The same by plain means: every segment as a whole.
fn whole(log: &Log, stretches: &[usize], settings: &FilterSettings, dt: f64) -> Vec<Kept> {
    let rate = 1.0 / dt;
    let q_cutoff = settings.q_cutoff_hz.expect("given");
    let position =
        ZeroPhase::new(SosFilter::butterworth(settings.q_order, q_cutoff, rate).expect("valid"));
    let sos = match settings.filter {
        ParallelFilter::Butterworth { order } => {
            SosFilter::butterworth(order, settings.cutoff_hz, rate)
        }
        ParallelFilter::Chebyshev { order, ripple_db } => {
            SosFilter::chebyshev(order, ripple_db, settings.cutoff_hz, rate)
        }
    };
    let parallel = ZeroPhase::new(sos.expect("valid"));
    let edge = (settings.q_trim_s.expect("given") / dt).round() as usize;
    let trim = (settings.trim_s.expect("given") / dt).round() as usize;
    let every = settings.decimation.expect("given");
    let mut kept = Vec::new();
    let (mut start, mut segment) = (0, 0);
    for &length in stretches {
        let rows = start * JOINTS..(start + length) * JOINTS;
        let t = &log.t[start..start + length];
        start += length;
        let mut q = log.q[rows.clone()].to_vec();
        let tau = &log.tau[rows];
        if length < shortest(&position, &parallel, edge, trim) {
            continue;
        }
        position.run(&mut q, JOINTS).expect("long enough");
        let (mut v, mut a) = (vec![0.0; q.len()], vec![0.0; q.len()]);
        settings.differences.apply(&q, JOINTS, dt, &mut v, &mut a);
        let mut raw = Vec::new();
        for (k, &time) in t.iter().enumerate().take(length - edge).skip(edge) {
            let row = k * JOINTS..(k + 1) * JOINTS;
            let mut channels = [0.0; CHANNELS];
            let sample = MotionSample {
                t: time,
                q: &q[row.clone()],
                v: &v[row.clone()],
                a: &a[row.clone()],
                tau: &tau[row.clone()],
                tau_beside: [&tau[row.clone()], &tau[row]],
                weight: &[1.0; JOINTS],
                rests: &[false; JOINTS],
            };
            fill(&sample, &mut channels);
            raw.extend(channels);
        }
        let mut filtered = raw.clone();
        parallel.run(&mut filtered, CHANNELS).expect("long enough");
        for i in (0..length - 2 * edge).step_by(every) {
            if i < trim || i >= length - 2 * edge - trim {
                continue;
            }
            let row = (i + edge) * JOINTS..(i + edge + 1) * JOINTS;
            let channels = i * CHANNELS..(i + 1) * CHANNELS;
            kept.push(Kept {
                t: t[i + edge],
                segment,
                q: q[row.clone()].to_vec(),
                v: v[row.clone()].to_vec(),
                a: a[row].to_vec(),
                raw: raw[channels.clone()].to_vec(),
                filtered: filtered[channels].to_vec(),
            });
        }
        segment += 1;
    }
    kept
}

fn shortest(position: &ZeroPhase, parallel: &ZeroPhase, edge: usize, trim: usize) -> usize {
    let pad = |f: &ZeroPhase| f.sos().pad_samples() + 1;
    2 * (edge + trim) + 3 * pad(position).max(pad(parallel))
}

/// Largest difference of each kind of number, relative to the largest of its column.
fn largest_difference(found: &[Kept], expected: &[Kept]) -> f64 {
    let columns = |pick: fn(&Kept) -> &[f64]| {
        let width = expected.first().map_or(0, |row| pick(row).len());
        (0..width)
            .map(|c| {
                let size = expected.iter().map(|row| pick(row)[c].abs());
                let off = found
                    .iter()
                    .zip(expected)
                    .map(|(x, y)| (pick(x)[c] - pick(y)[c]).abs());
                off.fold(0.0, f64::max) / size.fold(0.0, f64::max)
            })
            .fold(0.0, f64::max)
    };
    [
        columns(|row| &row.q),
        columns(|row| &row.v),
        columns(|row| &row.a),
        columns(|row| &row.filtered),
    ]
    .into_iter()
    .fold(0.0, f64::max)
}

fn settings() -> FilterSettings {
    FilterSettings {
        cutoff_hz: 10.0,
        filter: ParallelFilter::Butterworth { order: 4 },
        decimation: Some(10),
        q_cutoff_hz: Some(60.0),
        q_trim_s: Some(0.06),
        trim_s: Some(0.1),
        ..FilterSettings::default()
    }
}

fn check(
    stretches: &[usize],
    settings: &FilterSettings,
    block: usize,
) -> Result<(), TestCaseError> {
    let dt = 1e-3;
    let log = log(stretches, dt);
    let (found, summary) = run(&log, settings, block);
    let expected = whole(&log, stretches, settings, dt);
    prop_assert_eq!(found.len(), expected.len());
    prop_assert_eq!(summary.rows, found.len() as u64);
    prop_assert_eq!(summary.samples, log.t.len() as u64);
    for (x, y) in found.iter().zip(&expected) {
        prop_assert_eq!((x.t, x.segment), (y.t, y.segment));
    }
    let off = largest_difference(&found, &expected);

    prop_assert!(off < 1e-9, "relative difference {off:e}");
    Ok(())
}

#[test]
fn a_long_log_in_windows_equals_the_whole_log() {
    for filter in [
        ParallelFilter::Butterworth { order: 4 },
        ParallelFilter::Chebyshev {
            order: 8,
            ripple_db: 0.05,
        },
    ] {
        for differences in [DifferenceFormula::Central, DifferenceFormula::HighOrder] {
            for (q_trim, trim) in [(0.0, 0.0), (0.06, 0.1), (0.5, 2.0)] {
                let settings = FilterSettings {
                    filter,
                    differences,
                    q_trim_s: Some(q_trim),
                    trim_s: Some(trim),
                    ..settings()
                };
                check(&[60_000], &settings, 4096).expect("equal to 1e-9");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn random_segments_and_blocks_equal_the_whole_log(
        stretches in prop::collection::vec(1_usize..30_000, 1..5),
        long in 1_000_usize..40_000,
        block in 1_usize..9_000,
        decimation in 1_usize..25,
        cutoff_hz in 4.0..60.0,
        q_factor in 4.0..7.0,
        trim_s in 0.0..0.5,
    ) {
        let mut stretches = stretches;
        stretches.push(long);
        let settings = FilterSettings {
            cutoff_hz,
            q_cutoff_hz: Some(q_factor * cutoff_hz),
            decimation: Some(decimation),
            trim_s: Some(trim_s),
            ..settings()
        };
        check(&stretches, &settings, block)?;
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let log = log(&[70_000, 500, 9_000], 1e-3);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| run(&log, &settings(), 4096))
    };
    let (one, summary) = with(1);
    for threads in [2, 3, 8] {
        let (rows, other) = with(threads);
        assert_eq!(other, summary);
        assert!(rows == one, "{threads} threads");
    }
    assert_eq!(summary.segments, 3);
}

#[test]
fn how_a_reader_cuts_its_blocks_changes_no_bit() {
    // Uneven rows with gaps and a held torque: every stage that looks ahead is in use.
    let mut log = log(&[30_000, 7, 2_000, 1, 1, 9_000], 1e-3);
    for (k, t) in log.t.iter_mut().enumerate() {
        *t += 2e-4 * ((k * k) as f64).sin();
    }
    let settings = FilterSettings {
        torque: TorqueTiming::ZeroOrderHold,
        ..settings()
    };
    let (whole, summary) = run(&log, &settings, log.t.len());
    assert!(summary.interpolated > 20_000 && summary.skipped.segments == 3);
    for block in [1, 3, 1_000, 4_096, 8_192, 20_001] {
        let (rows, other) = run(&log, &settings, block);
        assert_eq!(other, summary, "blocks of {block}");
        assert!(rows == whole, "blocks of {block}");
    }
}

/// Root mean square of a channel's differences between two runs, over that of the channel.
fn off([thin, full]: [&[Kept]; 2], of: impl Fn(&Kept) -> f64) -> f64 {
    let square = |x: f64| x * x;
    let size: f64 = full.iter().map(|row| square(of(row))).sum();
    let pairs = thin.iter().zip(full);
    let off: f64 = pairs.map(|(a, b)| square(of(a) - of(b))).sum();
    (off / size).sqrt()
}

#[test]
fn a_log_much_faster_than_its_motion_gives_the_same_rows_from_fewer_samples() {
    let (dt, stretches) = (2e-4, [52_000, 9_000]);
    let log = log(&stretches, dt);
    let full = FilterSettings {
        cutoff_hz: 20.0,
        q_cutoff_hz: Some(100.0),
        differences: DifferenceFormula::HighOrder,
        decimation: Some(25),
        ..FilterSettings::default()
    };
    let thin = FilterSettings {
        thin: true,
        ..full.clone()
    };
    let ((rows, summary), (plain, as_given)) = (run(&log, &thin, 1000), run(&log, &full, 1000));
    assert_eq!(summary, as_given, "a log is described as it is");
    assert_eq!(rows.len(), plain.len());
    for (a, b) in rows.iter().zip(&plain) {
        assert_eq!((a.t, a.segment), (b.t, b.segment));
        assert_eq!((&a.q, &a.v, &a.a), (&b.q, &b.v, &b.a));
    }
    // near the ends of a stretch rows hold what the filter's extension makes of the last samples, both sides alike
    let border = plain.iter().position(|row| row.segment == 1).unwrap();
    let inside =
        |rows: &[Kept]| [&rows[15..border - 15], &rows[border + 15..rows.len() - 15]].concat();
    let (rows, plain) = (inside(&rows), inside(&plain));
    let both = [rows.as_slice(), plain.as_slice()];
    // torques through a filter; smooth terms sampled, and a steep law
    for (channel, most) in [
        (0, 5e-5),
        (1, 1e-4),
        (2, 5e-5),
        (3, 5e-5),
        (8, 1e-5),
        (9, 1e-5),
        (7, 1e-3),
    ] {
        let off = off(both, |row| row.filtered[channel]);
        assert!(off < most, "channel {channel}: {off:e}");
    }
}

#[test]
fn noise_between_the_samples_that_are_left_is_not_folded_onto_the_rows() {
    let (dt, n) = (2e-4, 40_000);
    let mut log = log(&[n], dt);
    // 15 Hz beside the thinned rate of 1 kHz: what is left out of it would be a wave of 15 Hz
    for (k, tau) in log.tau.chunks_exact_mut(JOINTS).enumerate() {
        tau[0] = (std::f64::consts::TAU * 1015.0 * k as f64 * dt).sin();
    }
    let settings = FilterSettings {
        cutoff_hz: 20.0,
        q_cutoff_hz: Some(100.0),
        decimation: Some(25),
        thin: true,
        ..FilterSettings::default()
    };
    let (rows, _) = run(&log, &settings, 1000);
    let largest = rows
        .iter()
        .map(|row| row.filtered[0].abs())
        .fold(0.0, f64::max);
    assert!(rows.len() > 1000 && largest < 1e-4, "{largest:e}");
}
