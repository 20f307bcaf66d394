use super::*;
use crate::math::sos::SosFilter;

fn value(k: usize, c: usize) -> f64 {
    let x = k as f64;
    match c {
        3..=11 => 0.0,
        c => (0.013 * x * (1.0 + c as f64)).sin() + 0.3 * (1.9 * x).cos() + 5.0 * c as f64,
    }
}

#[test]
fn outputs_that_are_kept_are_those_of_both_passes_over_all_samples() {
    let butterworth = |order, cutoff| SosFilter::butterworth(order, cutoff, 1000.0).unwrap();
    let designs = [
        butterworth(4, 5.0),
        butterworth(2, 60.0),
        butterworth(3, 20.0),
        SosFilter::chebyshev(8, 0.05, 20.0, 1000.0).unwrap(),
    ];
    for sos in designs {
        let filter = ZeroPhase::new(sos);
        for (every, first) in [
            (1, 0),
            (5, 3),
            (20, 0),
            (20, 19),
            (20, 133),
            (37, 400),
            (300, 7),
        ] {
            let kept = KeptEvery::new(filter.clone(), every);
            let mut work = KeptWork::default();
            for (samples, channels) in [(60, 3), (600, 17), (1111, 1), (1230, 21)] {
                if first >= samples {
                    continue;
                }
                let of = KeptRows {
                    samples,
                    channels,
                    first,
                    kept: (samples - first).div_ceil(every).min(40),
                };
                let fill = &mut |k: usize, row: &mut [f64]| {
                    row.iter_mut()
                        .enumerate()
                        .for_each(|(c, x)| *x = value(k, c));
                };
                let found = kept.run(of, &mut work, fill).unwrap();
                let mut all = vec![0.0; samples * channels];
                all.chunks_exact_mut(channels)
                    .enumerate()
                    .for_each(|(k, row)| fill(k, row));
                filter.run(&mut all, channels).unwrap();
                for (i, row) in found.chunks_exact(channels).enumerate() {
                    let plain = &all[(first + i * every) * channels..][..channels];
                    for (x, y) in row.iter().zip(plain) {
                        let off = (x - y).abs() / (1.0 + y.abs());
                        assert!(off < 1e-10, "{every} from {first} of {samples}: {x} {y}");
                    }
                }
            }
        }
    }
}

#[test]
fn too_few_samples_are_refused() {
    let filter = ZeroPhase::new(SosFilter::butterworth(4, 20.0, 1000.0).unwrap());
    let of = KeptRows {
        samples: 15,
        channels: 1,
        first: 0,
        kept: 1,
    };
    let found = KeptEvery::new(filter, 20).run(of, &mut KeptWork::default(), &mut |_, _| {});
    assert!(matches!(found, Err(MathError::TooShort { .. })));
}
