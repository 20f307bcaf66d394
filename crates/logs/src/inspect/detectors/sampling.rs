//! Whether rows were sampled when their stamps say, or evenly: positions show it.
//!
//! A position is smooth in the time at which it was sampled. So each is compared with the cubic through two rows
//! before and two behind it, once by their stamps and once as if rows lay evenly: what is off less is right.

use super::histogram::Histogram;
use crate::log::{EvenFit, EvenSpacing};

/// Positions that are looked at.
const MOST: usize = 16;
/// A position counts where it goes from row to row by at least this share of its fastest step.
const MIN_SHARE_OF_FASTEST: f64 = 0.1;
/// Shares of the comparisons by whose largest deviations the two clocks are judged: bursts, and samples that are held,
/// leave most rows as they are; lost rows put some of an even clock off.
const QUANTILES: [f64; 3] = [0.8, 0.9, 0.95];
/// Positions are off their stamps by so many times what they are off an even clock, where it is the stamps that jitter.
const MIN_RATIO: f64 = 3.0;
/// Comparisons from which something is known.
const MIN_ROWS: u64 = 100;

#[derive(Debug, Clone, Default)]
struct SeenPosition {
    rows: [f64; 5],
    fastest: f64,
    by_stamp: Histogram,
    by_place: Histogram,
}

/// Stamps of rows and the positions in them.
#[derive(Debug, Clone, Default)]
pub(crate) struct SamplingTimes {
    times: [f64; 5],
    filled: usize,
    seen: Vec<SeenPosition>,
    fit: EvenFit,
}

/// How rows lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct EvenRows {
    pub(crate) even: EvenSpacing,
    /// Root mean square by which stamps are off their places \[s\].
    pub(crate) off_s: f64,
    pub(crate) rows: f64,
    /// No stamp is so late that a row may be lost before it.
    pub(crate) whole: bool,
}

/// What a cubic through the other four makes of the middle number, by its times.
fn cubic(times: &[f64; 5], x: &[f64; 5]) -> f64 {
    const OTHERS: [usize; 4] = [0, 1, 3, 4];
    let weight = |k: &usize| {
        let others = OTHERS.iter().filter(|other| *other != k);
        let parts = others.map(|other| (times[2] - times[*other]) / (times[*k] - times[*other]));
        parts.product::<f64>()
    };
    OTHERS.iter().map(|k| weight(k) * x[*k]).sum()
}

impl SamplingTimes {
    /// Takes a row; `step` is about the time between two \[s\].
    pub(crate) fn take(&mut self, t: f64, step: f64, positions: &[f64]) {
        let last = self.times[4];
        if !t.is_finite() || (self.filled > 0 && t <= last) {
            self.filled = 0;
            return;
        }
        self.fit.take(t, step);
        self.seen
            .resize(positions.len().min(MOST), SeenPosition::default());
        self.times.rotate_left(1);
        self.times[4] = t;
        self.filled += 1;
        let whole = self.filled >= 5;
        const PLACES: [f64; 5] = [0.0, 1.0, 2.0, 3.0, 4.0];
        for (seen, q) in self.seen.iter_mut().zip(positions) {
            seen.rows.rotate_left(1);
            seen.rows[4] = *q;
            if !whole {
                continue;
            }
            let moved = (seen.rows[3] - seen.rows[1]).abs();
            if !moved.is_finite() {
                continue;
            }
            seen.fastest = seen.fastest.max(moved);
            if moved < MIN_SHARE_OF_FASTEST * seen.fastest || moved == 0.0 {
                continue;
            }
            let off = |times| cubic(times, &seen.rows) - seen.rows[2];
            let (stamp, place) = (off(&self.times), off(&PLACES));
            if stamp.is_finite() {
                seen.by_stamp.add(stamp);
                seen.by_place.add(place);
            }
        }
    }

    /// The even clock, where the positions say that rows lie evenly and their stamps do not.
    pub(crate) fn even(&self) -> Option<EvenRows> {
        let known = self
            .seen
            .iter()
            .filter(|seen| seen.by_stamp.total >= MIN_ROWS);
        let evident = |seen: &&SeenPosition| {
            let off =
                |share: &f64| [&seen.by_stamp, &seen.by_place].map(|all| all.quantile(*share));
            let mut each = QUANTILES.iter().map(off);
            each.any(|[stamp, place]| stamp > MIN_RATIO * place)
        };
        let evidently = known.clone().filter(evident).count();
        let (even, off_s) = self.fit.clock()?;
        let (rows, whole) = (self.fit.rows, self.fit.is_whole());
        let found = EvenRows {
            even,
            off_s,
            rows,
            whole,
        };
        (evidently > 0 && 2 * evidently > known.count()).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(k: u32) -> f64 {
        f64::from(k.wrapping_mul(2_654_435_761) >> 8) / f64::from(1 << 24) - 0.5
    }

    /// Positions that were sampled at `sampled` and stamped at `stamped`, with the grain of an encoder.
    fn judged(sampled: &dyn Fn(u32) -> f64, stamped: &dyn Fn(u32) -> f64) -> Option<EvenRows> {
        let mut sampling = SamplingTimes::default();
        for k in 0..2000 {
            let q = (1.3 * sampled(k)).sin() + 0.2 * (4.0 * sampled(k)).sin();
            sampling.take(stamped(k), 0.0101, &[(q / 2e-5).round() * 2e-5]);
        }
        sampling.even()
    }

    #[test]
    fn positions_show_whether_stamps_jitter_or_the_sampling() {
        let even = |k: u32| 0.01 * f64::from(k);
        let jitter = |k: u32| 0.01 * f64::from(k) + 0.004 * noise(k);
        let found = judged(&even, &jitter).unwrap();
        assert!(
            (found.even.step_s - 0.01).abs() < 1e-6 && (found.off_s - 0.00115).abs() < 2e-4,
            "{found:?}"
        );
        assert_eq!(judged(&jitter, &jitter), None);
        assert_eq!(judged(&even, &even), None);
        let bursts = |k: u32| 0.1 * f64::from(k / 10 + 1) + 1e-4 * f64::from(k % 10);
        assert!(judged(&even, &bursts).is_some());
    }
}
