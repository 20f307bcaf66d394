//! Samples that a logger took twice because the robot had no new ones: found while the robot moves.
//!
//! A row whose positions are those of the row before may be a robot at rest, or an encoder between
//! two counts. It is stale where it repeats all else as well and the motion goes on over it: some
//! joint moves by several of its smallest steps right before and right after, in the same direction
//! and about as fast. Then its time is wrong, and differentiating it would make a standstill where
//! there is none. In a log with many such rows, those count too whose positions alone are repeated:
//! there the torque was read a moment later.

use super::mend::longest_hold;

/// Rows in succession that may be stale; a longer standstill is one.
const MAX_STALE_ROWS: usize = 20;
/// Steps of a joint's resolution that a motion takes from row to row, at least.
const MIN_STEPS_IN_MOTION: f64 = 4.0;
/// Stale rows from which a log is known to have them.
const KNOWN: u64 = 10;
/// Steps of a motion from which it is known whether samples were held.
const MIN_MOTION_STEPS: u64 = 50;
/// Speeds before and after are the same motion where neither is more than this many times the other.
const MAX_SPEED_RATIO: f64 = 3.0;
/// Share by which rounded times may bring a ratio off: rounded positions and times lie just on the bound here and there,
/// and another zero of the clock must not decide.
const ROUNDING: f64 = 1e-6;

/// The motion right before the current row.
#[derive(Debug, Default)]
pub(super) struct StaleDetector {
    /// Time and positions of the last row that moved.
    t: Option<f64>,
    q: Vec<f64>,
    /// Step to it from the last one before, and its duration.
    step: Vec<f64>,
    duration: f64,
    /// Smallest step other than 0 of each joint.
    resolution: Vec<f64>,
    /// Rows since then that repeat its positions.
    run: usize,
    /// All of them repeat everything.
    whole: bool,
    /// Rows so far that repeat the positions of the row before, and those of them that are stale.
    pub(super) repeated: u64,
    pub(super) dropped: u64,
    pub(super) keep: bool,
    /// Steps of a motion that goes on, by the rows before them that repeat everything.
    held: [u64; MAX_STALE_ROWS + 1],
}

impl StaleDetector {
    pub(super) fn new(joints: usize) -> Self {
        Self {
            q: vec![0.0; joints],
            step: vec![0.0; joints],
            resolution: vec![f64::INFINITY; joints],
            whole: true,
            ..Self::default()
        }
    }

    /// Rows for which a sample was held at most, where at least every other row of the motion is one that was held.
    pub(super) fn hold(&self) -> Option<usize> {
        let runs = || self.held.iter().enumerate();
        let steps: u64 = self.held.iter().sum();
        let held: u64 = runs().map(|(rows, steps)| rows as u64 * steps).sum();
        let mean = 1.0 + held as f64 / steps.max(1) as f64;
        let each = runs().filter(|(_, steps)| **steps > 0);
        let longest = longest_hold(mean, each.map(|(rows, _)| 1 + rows));
        (steps >= MIN_MOTION_STEPS && 2 * held >= steps).then_some(longest)
    }

    /// Takes the next row; `same`: all but its positions repeats too. How many rows before it turn out to be stale.
    #[inline]
    pub(super) fn judge(&mut self, t: f64, q: &[f64], same: impl FnOnce() -> bool) -> usize {
        if self.q == q && self.t.is_some() && !q.is_empty() {
            self.run += 1;
            self.repeated += 1;
            self.whole &= same();
            return 0;
        }
        let stale = match self.t {
            Some(before) => self.moved(t - before, q),
            None => 0,
        };
        self.q.copy_from_slice(q);
        self.t = Some(t);
        self.run = 0;
        self.whole = true;
        stale
    }

    #[inline]
    fn moved(&mut self, duration: f64, q: &[f64]) -> usize {
        let goes_on = self.run <= MAX_STALE_ROWS && self.goes_on(duration, q);
        if goes_on {
            self.held[if self.whole { self.run } else { 0 }] += 1;
        }
        let stale = goes_on && self.run > 0 && (self.whole || self.dropped >= KNOWN) && !self.keep;
        let joints = self.step.iter_mut().zip(&mut self.resolution);
        for ((step, resolution), (to, from)) in joints.zip(q.iter().zip(&self.q)) {
            *step = to - from;
            if *step != 0.0 {
                *resolution = resolution.min(step.abs());
            }
        }
        self.duration = duration;
        if !stale {
            return 0;
        }
        self.dropped += self.run as u64;
        self.run
    }

    /// Whether the motion before the run goes on in the step after it.
    fn goes_on(&self, duration: f64, q: &[f64]) -> bool {
        (0..q.len()).any(|joint| {
            let after = q[joint] - self.q[joint];
            let before = self.step[joint];
            let enough = MIN_STEPS_IN_MOTION * self.resolution[joint];
            if before.abs() < enough || after.abs() < enough || (before > 0.0) != (after > 0.0) {
                return false;
            }
            let ratio = (after / duration) / (before / self.duration);
            let most = MAX_SPEED_RATIO * (1.0 + ROUNDING);
            (1.0 / most..=most).contains(&ratio)
        })
    }

    /// Rows at the end of which it is not known yet whether they are stale.
    pub(super) fn undecided(&self) -> usize {
        match self.run <= MAX_STALE_ROWS {
            true => self.run,
            false => 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dropped(rows: &[f64]) -> Vec<usize> {
        let mut stale = StaleDetector::new(1);
        let rows = rows.iter().enumerate();
        rows.filter_map(|(i, q)| match stale.judge(i as f64, &[*q], || true) {
            0 => None,
            rows => Some(i - rows),
        })
        .collect()
    }

    #[test]
    fn a_repeated_sample_inside_a_fast_motion_is_stale() {
        assert_eq!(dropped(&[0.0, 1.0, 9.0, 17.0, 17.0, 33.0, 41.0]), [4]);
        assert_eq!(dropped(&[0.0, 1.0, 9.0, 17.0, 17.0, 17.0, 33.0, 41.0]), [4]);
    }

    #[test]
    fn an_encoder_between_two_counts_a_reversal_and_a_rest_are_not_stale() {
        assert!(dropped(&[0.0, 1.0, 1.0, 2.0, 2.0, 3.0, 4.0, 4.0, 6.0]).is_empty());
        assert!(dropped(&[0.0, 1.0, 9.0, 17.0, 17.0, 9.0, 0.0]).is_empty());
        let mut rest = vec![0.0, 1.0, 9.0, 17.0];
        rest.extend([17.0; MAX_STALE_ROWS + 1]);
        rest.extend([25.0, 33.0]);
        assert!(dropped(&rest).is_empty());
    }
}
