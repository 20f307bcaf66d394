//! The grain of a channel: the step of its numbers, or that it has none at all.

use super::windows::Window;

/// Steps up to this many grains are looked at.
const MAX_GRAINS: f64 = 64.0;
/// Share of the steps that must be whole grains.
const WHOLE_GRAINS_SHARE: f64 = 0.995;
/// Order of the difference that shows noise: it takes slow motion away.
const ORDER: usize = 8;
/// The factor by which it makes white noise larger: sqrt(binomial(16, 8)).
const WHITE_NOISE_GAIN: f64 = 113.446;

/// The step of a channel's numbers, where they have one: all differences from row to row are multiples of it.
pub(crate) fn step(windows: &[Window], channel: usize) -> Option<f64> {
    let differences = || {
        windows.iter().flat_map(move |window| {
            let column = &window.columns[channel];
            column.windows(2).map(|pair| {
                let size = pair[0].abs().max(pair[1].abs());
                ((pair[1] - pair[0]).abs(), size)
            })
        })
    };
    // Differences of equal counts that were scaled leave rounding behind.
    let rounding = |size: f64| 1e-12 * size.max(f64::MIN_POSITIVE);
    let steps = differences().filter(|(step, size)| *step > rounding(*size));
    let least = steps.map(|(step, _)| step).fold(f64::INFINITY, f64::min);
    if !least.is_finite() {
        return None;
    }
    let values = windows.iter().flat_map(|window| &window.columns[channel]);
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(*x), high.max(*x))
    });
    let (mut whole, mut looked_at, mut sum, mut grains) = (0u64, 0u64, 0.0, 0.0);
    for (difference, size) in differences() {
        if difference <= rounding(size) || difference > MAX_GRAINS * least {
            continue;
        }
        looked_at += 1;
        let count = (difference / least).round();
        // A printed number is rounded to its last digit, so that a grain wavers.
        let slack = 0.02 * least * count.max(1.0) + 2.0 * rounding(size);
        if (difference - count * least).abs() <= slack {
            whole += 1;
            sum += difference;
            grains += count;
        }
    }
    let enough = looked_at >= 20 && whole as f64 >= WHOLE_GRAINS_SHARE * looked_at as f64;
    // A flag has two levels and no grain.
    (enough && high - low > 2.5 * least).then(|| sum / grains)
}

/// Deviation of the noise of a moving channel, by its differences of order eight; `None` where it moves too little.
pub(crate) fn noise(windows: &[Window], channel: usize) -> Option<f64> {
    let mut sizes = Vec::new();
    for window in windows {
        for rows in window.columns[channel].windows(ORDER + 1) {
            if rows.windows(2).all(|pair| pair[0] != pair[1]) {
                sizes.push(eighth_difference(rows).abs() / WHITE_NOISE_GAIN);
            }
        }
    }
    if sizes.len() < 200 {
        return None;
    }
    let middle = sizes.len() / 2;
    let (_, median, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    // The median of |x| is 0.6745 deviations for a normal x.
    Some(*median / 0.6745)
}

fn eighth_difference(rows: &[f64]) -> f64 {
    const BINOMIAL: [f64; ORDER + 1] = [1.0, -8.0, 28.0, -56.0, 70.0, -56.0, 28.0, -8.0, 1.0];
    // From the middle of the rows, so that a large constant part leaves less rounding behind.
    let about = rows[ORDER / 2];
    let terms = rows.iter().zip(BINOMIAL);
    terms.map(|(x, b)| b * (x - about)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(values: impl Iterator<Item = f64>) -> Vec<Window> {
        let column: Vec<f64> = values.collect();
        vec![Window {
            t: (0..column.len()).map(|k| k as f64 * 1e-3).collect(),
            columns: vec![column],
        }]
    }

    #[test]
    fn the_step_of_an_encoder_is_found_whatever_its_scale_and_a_smooth_channel_has_none() {
        let sine = |k: i32| (f64::from(k) * 0.003).sin();
        for grain in [8.8e-6, 1e-3, 0.25] {
            let coarse = window((0..4000).map(|k| (sine(k) / grain).round() * grain + 0.1));
            let found = step(&coarse, 0).unwrap();
            assert!((found / grain - 1.0).abs() < 1e-6, "{found} for {grain}");
        }
        let smooth = window((0..4000).map(sine));
        assert_eq!(step(&smooth, 0), None);
        let flag = window((0..4000).map(|k| f64::from(k / 100 % 2)));
        assert_eq!(step(&flag, 0), None);
    }

    #[test]
    fn noise_is_measured_through_motion() {
        use rand::{RngExt, SeedableRng};
        let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut random = move || chance.random::<f64>() - 0.5;
        let noisy = window((0..4000u32).map(|k| (f64::from(k) * 0.003).sin() + 1e-3 * random()));
        let found = noise(&noisy, 0).unwrap();
        assert!((found / (1e-3 / 12f64.sqrt()) - 1.0).abs() < 0.1, "{found}");
        let smooth = window((0..4000u32).map(|k| (f64::from(k) * 0.003).sin()));
        assert!(noise(&smooth, 0).unwrap() < 1e-14);
        let rest = window((0..4000u32).map(|_| 1.0));
        assert_eq!(noise(&rest, 0), None);
    }
}
