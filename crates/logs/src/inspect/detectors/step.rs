//! Leaps of a position that stay: an encoder that slipped, a new reference, logs that were joined,
//! rows that were lost without their times.
//!
//! Through the four rows about a place goes one parabola, if nothing leapt there. The height of a
//! leap that brings them onto one is their third divided difference over that of a leap of height 1;
//! times need not be even. Two things give it a height without a leap: noise, whose heights are seen
//! all through the log, and the motion, where the acceleration changes from one row to the next.

use super::histogram::Histogram;
use super::ring::RowRing;

/// Rows to each side in which a leap must stand alone.
const AROUND: usize = 25;
/// Rows about a leap in which it shows itself.
const OWN: usize = 4;
/// Rows to each side by which it is seen that the new level stays.
const LEVEL: usize = 5;
/// Share of a leap's height that the rows next to it tell, and those beyond three rows, where the motion may have bent.
const NEXT: [f64; 2] = [0.5, 1.5];
const BEYOND: [f64; 2] = [0.25, 2.0];
/// Rows that repeat all positions from which the robot is at rest.
const MIN_ROWS_AT_REST: usize = 6;
/// Leaps that are kept, the highest.
const MAX_LEAPS: usize = 4096;
/// Largest heights that may be leaps, over those of 99 % of the rows.
const SUSPECT_FACTOR: f64 = 3.0;

/// A step of a channel from one row to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SampleLeap {
    /// Times of the last row before it and of the first one after it [s].
    pub(crate) before: f64,
    pub(crate) at: f64,
    pub(crate) height: f64,
}

/// Finds leaps of a channel, row after row.
#[derive(Debug, Clone, Default)]
pub(crate) struct LeapDetector {
    times: RowRing,
    values: RowRing,
    heights: RowRing,
    /// Rows since the stretch began.
    count: usize,
    /// Rows whose height was looked at.
    judged: usize,
    heights_seen: Histogram,
    suspect: f64,
    /// Those that may be leaps, in the order of time.
    pub(crate) found: Vec<SampleLeap>,
    lowest: f64,
}

impl LeapDetector {
    /// Takes the next row that is not one of a few that repeat the positions of the row before.
    #[inline]
    pub(crate) fn take(&mut self, t: f64, value: f64) {
        let k = self.count;
        self.times[k] = t;
        self.values[k] = value;
        self.heights[k] = 0.0;
        self.count += 1;
        if self.count < 4 {
            return;
        }
        // the leap would be between the two rows in the middle
        let height = self.height(k - 1);
        self.heights[k - 1] = height;
        self.heights_seen.add(height);
        if k > AROUND + 1 {
            self.judge(k - 1 - AROUND, k - 1);
        }
    }

    /// Height of a leap between a row and the one before it.
    #[inline]
    fn height(&self, row: usize) -> f64 {
        let at = |i: usize| row + i - 2;
        let t: [f64; 4] = std::array::from_fn(|i| self.times[at(i)]);
        let (mut all, mut after) = (0.0, 0.0);
        for i in 0..4 {
            let mut product = 1.0;
            for j in 0..4 {
                if j != i {
                    product *= t[i] - t[j];
                }
            }
            let weight = 1.0 / product;
            // from the row before the leap, so that a large constant part leaves no rounding
            all += weight * (self.values[at(i)] - self.values[at(1)]);
            after += if i >= 2 { weight } else { 0.0 };
        }
        all / after
    }

    pub(crate) fn part(&mut self) {
        if self.count >= 4 {
            let last = self.count - 2;
            for row in self.judged.max(2)..=last {
                self.judge(row, last);
            }
        }
        self.count = 0;
        self.judged = 0;
    }

    /// Brings the suspicion up to date with what was seen so far.
    pub(crate) fn settle(&mut self) {
        self.suspect = SUSPECT_FACTOR * self.heights_seen.quantile(0.99);
    }

    #[inline]
    fn judge(&mut self, row: usize, last: usize) {
        self.judged = row + 1;
        let height = self.heights[row];
        if height.abs() > self.suspect.max(self.lowest) {
            self.judge_closely(row, last, height);
        }
    }

    #[cold]
    fn judge_closely(&mut self, row: usize, last: usize, height: f64) {
        let from = row.saturating_sub(AROUND).max(2);
        let others = from..=last.min(row + AROUND);
        let far = others.filter(|k| k.abs_diff(row) > OWN);
        let far = far.filter(|k| self.heights[*k].abs() > 0.25 * height.abs());
        // A second leap may be near, a rough stretch may not.
        if far.count() > 3 || !self.stays(row) {
            return;
        }
        // Windows beside a leap show it, too, and on an uneven clock higher, but it is not there that
        // the rows part.
        let near = row.saturating_sub(OWN).max(2)..=last.min(row + OWN);
        let higher = |k: &usize| self.heights[*k].abs() > height.abs();
        if near.filter(higher).any(|k| self.stays(k)) {
            return;
        }
        if self.found.len() == MAX_LEAPS {
            let mut heights: Vec<f64> = self.found.iter().map(|leap| leap.height.abs()).collect();
            heights.sort_by(f64::total_cmp);
            self.lowest = heights[MAX_LEAPS / 2];
            self.found.retain(|leap| leap.height.abs() > self.lowest);
        }
        self.found.push(SampleLeap {
            before: self.times[row - 1],
            at: self.times[row],
            height,
        });
    }

    /// Whether the leap that the window at a row shows is one that stays: that of a spike of up to three rows does not.
    fn stays(&self, row: usize) -> bool {
        let height = self.heights[row];
        [(1, NEXT), (3, BEYOND)].iter().all(|(skip, [low, high])| {
            self.level(row, *skip).is_none_or(|level| {
                let share = level / height;
                *low < share && share < *high
            })
        })
    }

    /// Height that brings five rows on each side onto one parabola, without `skip` rows next to the leap on each.
    fn level(&self, row: usize, skip: usize) -> Option<f64> {
        let from = row.saturating_sub(LEVEL + skip);
        let rows: Vec<usize> = (from..(row + LEVEL + skip).min(self.count))
            .filter(|k| k + skip < row || *k >= row + skip)
            .collect();
        let (before, after) = rows.split_at(rows.partition_point(|k| *k < row));
        if before.len() < 2 || after.len() < 2 {
            return None;
        }
        let begin = self.times[row];
        let length = (self.times[rows[rows.len() - 1]] - self.times[rows[0]]).abs();
        let column = |f: &dyn Fn(f64, usize) -> f64| -> Vec<f64> {
            let each = rows.iter();
            each.map(|k| f((self.times[*k] - begin) / length, *k))
                .collect()
        };
        let powers: [&dyn Fn(f64, usize) -> f64; 3] = [&|_, _| 1.0, &|t, _| t, &|t, _| t * t];
        let mut basis = powers.map(column);
        let mut leap = column(&|_, k| if k >= row { 1.0 } else { 0.0 });
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let take_off = |x: &mut [f64], of: &[f64]| {
            let share = dot(x, of);
            x.iter_mut().zip(of).for_each(|(x, y)| *x -= share * y);
        };
        // Gram-Schmidt: what of the leap is no parabola
        for i in 0..basis.len() {
            let (done, rest) = basis.split_at_mut(i);
            let own = &mut rest[0];
            done.iter().for_each(|other| take_off(own, other));
            let norm = dot(own, own).sqrt();
            if norm < 1e-9 {
                return None;
            }
            own.iter_mut().for_each(|x| *x /= norm);
            take_off(&mut leap, own);
        }
        let about = self.values[row - 1];
        let values = column(&|_, k| self.values[k] - about);
        let found = dot(&leap, &values) / dot(&leap, &leap);
        found.is_finite().then_some(found)
    }

    /// Height that noise and the usual motion do not reach in a million logs like this one.
    pub(crate) fn unusual(&self, rows: u64) -> f64 {
        const LOGS: f64 = 1e6;
        // the share of the rows that pass a height falls exponentially with it, as it does from the 90th to the 99th
        // of a hundred (a normal distribution falls faster)
        let [most, nearly_all] = [0.9, 0.99].map(|share| self.heights_seen.quantile(share));
        let decades = (0.01 * LOGS * rows.max(100) as f64).log10();
        nearly_all + (nearly_all - most) * decades
    }
}

/// Leaves out rows that repeat the positions of the row before; of a rest the last one stands for all.
#[derive(Debug, Clone, Default)]
pub(crate) struct FreshRows {
    previous: Vec<f64>,
    /// Time of the last row that repeats, and how many there are in a row.
    repeated: usize,
    last: f64,
}

/// What to do with a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum RowFreshness {
    /// Its positions are those of the row before.
    Repeats,
    /// Its positions are new.
    Fresh,
    /// The same, after a rest, whose last row was at this time [s].
    AfterRest(f64),
}

impl FreshRows {
    pub(crate) fn new(positions: usize) -> Self {
        Self {
            previous: vec![f64::NAN; positions],
            ..Self::default()
        }
    }

    #[inline]
    pub(crate) fn look(&mut self, t: f64, positions: &[f64]) -> RowFreshness {
        if positions == self.previous {
            self.repeated += 1;
            self.last = t;
            return RowFreshness::Repeats;
        }
        let rest = self.repeated >= MIN_ROWS_AT_REST;
        self.repeated = 0;
        self.previous.copy_from_slice(positions);
        match rest {
            true => RowFreshness::AfterRest(self.last),
            false => RowFreshness::Fresh,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fed(rows: impl Iterator<Item = (f64, f64)>) -> LeapDetector {
        let mut leaps = LeapDetector::default();
        for (k, (t, q)) in rows.enumerate() {
            if k % 256 == 0 {
                leaps.settle();
            }
            leaps.take(t, q);
        }
        leaps.part();
        leaps
    }

    fn high(leaps: &LeapDetector, least: f64) -> Vec<(f64, f64)> {
        let found = leaps.found.iter();
        let high = found.filter(|leap| leap.height.abs() > least);
        high.map(|leap| (leap.at, leap.height)).collect()
    }

    /// Rows with an uneven clock and the last digits of an encoder.
    fn rows(alter: impl Fn(usize, f64) -> f64) -> Vec<(f64, f64)> {
        let row = |k: usize| {
            let t = k as f64 * 1e-3 + 1e-4 * ((k * 7) % 5) as f64;
            let q = (2.0 * t).sin() + 0.3 * (9.0 * t).cos();
            (t, (alter(k, q) / 1e-6).round() * 1e-6)
        };
        (0..4000).map(row).collect()
    }

    #[test]
    fn a_leap_is_found_at_its_row_with_its_height_whatever_the_clock() {
        for height in [1e-3, -0.02, 0.1] {
            let leaps = fed(rows(|k, q| q + if k < 2345 { 0.0 } else { height }).into_iter());
            let found = high(&leaps, leaps.unusual(4000));
            assert_eq!(found.len(), 1, "{height}: {found:?}");
            let (at, size) = found[0];
            assert!((at - 2.345).abs() < 1e-3 && (size / height - 1.0).abs() < 0.01);
        }
    }

    #[test]
    fn spikes_and_smooth_turns_are_no_leaps() {
        let spike = |k: usize| (100..100 + 1 + k / 1500).contains(&(k % 500));
        let spiky = fed(rows(|k, q| q + if spike(k) { 0.05 } else { 0.0 }).into_iter());
        let found = high(&spiky, spiky.unusual(4000));
        assert!(found.is_empty(), "{found:?}");
        let smooth = fed(rows(|_, q| q).into_iter());
        assert!(high(&smooth, smooth.unusual(4000)).is_empty());
    }

    #[test]
    fn a_rest_is_its_first_and_its_last_row_and_a_few_that_repeat_are_none() {
        let mut fresh = FreshRows::new(1);
        let rows = [0.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 3.0];
        let shown: Vec<RowFreshness> = (0..rows.len())
            .map(|k| fresh.look(k as f64, &rows[k..=k]))
            .collect();
        assert_eq!(shown[3], RowFreshness::Fresh);
        assert_eq!(shown[10], RowFreshness::AfterRest(9.0));
        let repeats = shown.iter().filter(|f| **f == RowFreshness::Repeats);
        assert_eq!(repeats.count(), 7);
    }
}
