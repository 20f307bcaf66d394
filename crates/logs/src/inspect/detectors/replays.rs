//! Stretches of a log that stand in it a second time, number for number: a file that was appended to itself, a
//! recorder that wrote its buffer twice. Counted twice, they make intervals too narrow.

use std::collections::HashMap;

use crate::inspect::fault::FaultEpisodes;

/// Rows that are remembered; of longer logs every second of them, every fourth, and so on, chosen by what is in them.
const MAX_REMEMBERED: usize = 1 << 16;
/// Rows of a stretch that stands twice: no chance makes noise repeat itself over so many.
const MIN_ROWS: u64 = 50;
/// Remembered rows of it that must be found again, all at one distance.
const MIN_HITS: u32 = 3;

/// A stretch that has been seen before.
#[derive(Debug, Clone, Copy)]
struct RepeatedStretch {
    /// Rows from the first time to the second.
    distance: u64,
    /// Number and time of its first row and of its last.
    first: (u64, f64),
    last: (u64, f64),
    hits: u32,
}

/// Watches the rows of all joints together.
#[derive(Debug, Clone, Default)]
pub(crate) struct ReplayDetector {
    /// Number of the row that first had these numbers behind those of the row before.
    seen: HashMap<u64, u64>,
    /// A row is remembered where these bits of its sum are 0.
    mask: u64,
    /// Sums of the positions and of all numbers of the row before.
    before: [u64; 2],
    rows: u64,
    run: Option<RepeatedStretch>,
    found: Vec<RepeatedStretch>,
}

/// A sum of numbers by their bits (the multiplier is that of Knuth's Fibonacci hashing).
fn sum(numbers: &[f64], begin: u64) -> u64 {
    let mix =
        |sum: u64, x: &f64| (sum.rotate_left(5) ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    numbers.iter().fold(begin, mix)
}

impl ReplayDetector {
    /// Takes the positions of the next row, and its torques and velocities.
    #[inline]
    pub(crate) fn take(&mut self, t: f64, positions: &[f64], others: &[f64]) {
        self.rows += 1;
        if others.is_empty() {
            return;
        }
        let place = sum(positions, 1);
        let own = sum(others, place);
        let [place_before, own_before] = self.before;
        self.before = [place, own];
        // what stands still repeats itself
        if place == place_before {
            return;
        }
        let pair = own_before.rotate_left(32) ^ own;
        // the low bits of a product depend on few bits of its factors
        if (pair >> 40) & self.mask == 0 {
            self.look_up(t, pair);
        }
    }

    fn look_up(&mut self, t: f64, pair: u64) {
        let Some(row) = self.seen.get(&pair) else {
            self.part();
            self.seen.insert(pair, self.rows);
            if self.seen.len() > MAX_REMEMBERED {
                self.mask = 2 * self.mask + 1;
                let mask = self.mask;
                self.seen.retain(|pair, _| (pair >> 40) & mask == 0);
            }
            return;
        };
        let (distance, here) = (self.rows - row, (self.rows, t));
        match &mut self.run {
            Some(run) if run.distance == distance => {
                run.last = here;
                run.hits += 1;
            }
            _ => {
                self.part();
                self.run = Some(RepeatedStretch {
                    distance,
                    first: here,
                    last: here,
                    hits: 1,
                });
            }
        }
    }

    pub(crate) fn part(&mut self) {
        let long =
            |run: &RepeatedStretch| run.hits >= MIN_HITS && run.last.0 - run.first.0 >= MIN_ROWS;
        self.found.extend(self.run.take().filter(long));
    }

    /// Stretches that stand in the log before them, those that have ended.
    pub(crate) fn found(&self) -> FaultEpisodes {
        let mut episodes = FaultEpisodes::default();
        for run in &self.found {
            let rows = run.last.0 - run.first.0 + 1;
            episodes.add(run.first.1, run.last.1, rows, 0.0);
        }
        episodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stretches found in a log whose row k holds the numbers of row `of(k)` of a noisy motion.
    fn found(rows: u64, of: impl Fn(u64) -> u64) -> Vec<(f64, f64, u64)> {
        let mut replays = ReplayDetector::default();
        for k in 0..rows {
            let row = of(k);
            let x = row as f64;
            // a coarse position, and a torque with noise
            let torque = (row.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64;
            let position = (0.3 * x).sin().mul_add(1e3, 0.5).floor();
            replays.take(k as f64, &[position], &[torque]);
        }
        replays.part();
        let found = replays.found().list.into_iter();
        found.map(|e| (e.from, e.to, e.rows)).collect()
    }

    #[test]
    fn a_stretch_that_stands_twice_is_found_where_it_stands_again() {
        let again = found(3000, |k| if k < 2000 { k } else { k - 1500 });
        assert_eq!(again, [(2001.0, 2999.0, 999)]);
        assert_eq!(found(3000, |k| k), []);
    }

    #[test]
    fn of_a_long_log_a_part_of_the_rows_is_remembered() {
        let rows = 40 * MAX_REMEMBERED as u64;
        let again = found(rows + 30_000, |k| if k < rows { k } else { k - rows + 700 });
        assert_eq!(again.len(), 1);
        let (from, to, _) = again[0];
        let late = from - rows as f64;
        assert!(late < 1000.0 && to > (rows + 29_000) as f64, "{again:?}");
    }

    #[test]
    fn a_rest_and_a_log_without_torques_repeat_nothing() {
        assert_eq!(found(3000, |k| k.min(1000)), []);
    }
}
