//! Rows that show the positions of the row before although the robot moves.
//!
//! A recorder that is faster than the robot, or runs beside it on a clock of its own, now and then
//! logs one sample twice and leaves out the next. Differentiated, that is a stop and a leap.

use super::flat::FlatDetector;
use crate::inspect::fault::FaultEpisodes;
use crate::log::longest_hold;

/// Rows of a run that may still be a repetition; longer ones are a stuck channel or a rest.
const MAX_RUN_ROWS: usize = 20;
/// Rows in motion that repeat, from which samples may have been held.
const MIN_HELD_ROWS: u64 = 50;
/// Runs that are kept.
const MAX_RUNS: usize = 1 << 18;
/// Long runs that are kept.
const LONG_RUNS: usize = 4096;
/// Usual smallest steps that a joint goes from row to row where it moves.
pub(crate) const MIN_STEPS_IN_MOTION: f64 = 3.0;
/// An edge is abrupt where its step is so many times the usual bends of the channel.
pub(crate) const ABRUPT_BENDS: f64 = 6.0;

/// Rows that repeat the positions of the row before them.
#[derive(Debug, Clone)]
struct RepeatRun {
    /// Times of its first row, which shows these positions first, its second, its last but one and its last.
    times: [f64; 4],
    rows: u32,
    /// Steps of each joint into the run and out of it.
    steps: Vec<[f32; 2]>,
    /// Whether torques and velocities repeat too.
    identical: bool,
}

/// Watches the positions of all joints together.
#[derive(Debug, Clone, Default)]
pub(crate) struct RepeatDetector {
    previous: Vec<f64>,
    entry: Vec<f64>,
    /// Times of the run's first, second, last but one and last row; rows of it.
    times: [f64; 4],
    rows: usize,
    /// Torques and velocities of the row before, and whether they were the same all through the run.
    others: Vec<f64>,
    identical: bool,
    /// Rows in which positions changed, and those of them in which nothing else did.
    changed: u64,
    coincidences: u64,
    runs: Vec<RepeatRun>,
    /// Longer ones in which all else repeated too.
    frozen: Vec<RepeatRun>,
    /// Rows, and those of them in which torques and velocities were those of the row before.
    seen: u64,
    same: u64,
}

impl RepeatDetector {
    /// For so many positions, and torques and velocities.
    pub(crate) fn new(joints: usize, others: usize) -> Self {
        Self {
            previous: vec![f64::NAN; joints],
            entry: vec![f64::NAN; joints],
            others: vec![f64::NAN; others],
            ..Self::default()
        }
    }

    /// Takes the positions of the next row, and its torques and velocities.
    #[inline]
    pub(crate) fn take(&mut self, t: f64, positions: &[f64], others: &[f64]) {
        let same = others == self.others;
        self.seen += 1;
        self.same += u64::from(same);
        self.others.copy_from_slice(others);
        if self.rows > 0 && positions == self.previous {
            self.rows += 1;
            if self.rows == 2 {
                self.times[1] = t;
            }
            self.times[2] = self.times[3];
            self.times[3] = t;
            self.identical &= same;
            return;
        }
        self.changed += 1;
        self.coincidences += u64::from(same);
        if self.rows > 1 {
            self.end(positions);
        }
        self.identical = true;
        for (joint, position) in positions.iter().enumerate() {
            self.entry[joint] = position - self.previous[joint];
        }
        self.previous.copy_from_slice(positions);
        self.times = [t, t, t, t];
        self.rows = 1;
    }

    pub(crate) fn part(&mut self) {
        if self.rows > MAX_RUN_ROWS {
            self.end(&vec![f64::NAN; self.previous.len()]);
        }
        self.previous.fill(f64::NAN);
        self.entry.fill(f64::NAN);
        self.rows = 0;
    }

    #[cold]
    fn end(&mut self, next: &[f64]) {
        let long = self.rows > MAX_RUN_ROWS;
        let full = match long {
            true => self.frozen.len() == LONG_RUNS || !self.identical,
            false => self.runs.len() == MAX_RUNS,
        };
        if full {
            return;
        }
        let ends = next.iter().zip(&self.previous).zip(&self.entry);
        let steps = ends.map(|((next, last), entry)| [*entry as f32, (next - last) as f32]);
        let run = RepeatRun {
            times: self.times,
            rows: self.rows as u32 - 1,
            steps: steps.collect(),
            identical: self.identical,
        };
        match long {
            true => self.frozen.push(run),
            false => self.runs.push(run),
        }
    }

    /// Stretches in which all channels froze while the robot moved; `channels` are the joints' own.
    pub(crate) fn stalls(&self, channels: &[&FlatDetector]) -> FaultEpisodes {
        // Positions that stand still are a rest. They are frozen where torques and velocities, too, keep their last
        // digit, which they do not elsewhere, and the joints moved right before or after; or where a joint stops or
        // starts at once.
        let rows = |run: &RepeatRun| u64::from(run.rows);
        let held: u64 = self.frozen.iter().map(rows).sum();
        let elsewhere = self.seen.saturating_sub(held);
        let alive = !self.others.is_empty() && 100 * self.same.saturating_sub(held) < elsewhere;
        let frozen = |run: &&RepeatRun| {
            run.steps.iter().zip(channels).any(|(steps, flat)| {
                let largest = steps.iter().filter(|step| step.is_finite());
                let largest = largest.fold(0.0, |most, step| f64::from(step.abs()).max(most));
                let step = flat.steps.quantile_not_zero(0.05);
                let bend = flat.bends.quantile_not_zero(0.99);
                let moves = step > 0.0 && largest > MIN_STEPS_IN_MOTION * step;
                moves && (alive || largest > ABRUPT_BENDS * bend)
            })
        };
        let mut episodes = FaultEpisodes::default();
        for run in self.frozen.iter().filter(frozen) {
            let [first, .., last] = run.times;
            episodes.add(first, last, rows(run) + 1, 0.0);
        }
        episodes
    }

    /// Rows that repeat everything, those of long stretches aside.
    pub(crate) fn repeated(&self) -> u64 {
        let runs = self.runs.iter().filter(|run| run.identical);
        runs.map(|run| u64::from(run.rows)).sum()
    }

    /// Rows for which samples were held, in the mean and the longest: where at least every other row of those that
    /// change is one that was held.
    pub(crate) fn hold(&self, repeated: u64) -> Option<(usize, usize)> {
        let held = self.repeated();
        let holds = repeated >= MIN_HELD_ROWS && 2 * held >= self.changed;
        let mean = 1.0 + held as f64 / self.changed.max(1) as f64;
        let runs = self.runs.iter().filter(|run| run.identical);
        let longest = longest_hold(mean, runs.map(|run| 1 + run.rows as usize));
        holds.then(|| (mean.round() as usize, longest))
    }

    /// What was found; `channels` are the joints' own, in the same order.
    pub(crate) fn judge(&self, channels: &[&FlatDetector]) -> RepeatedRows {
        debug_assert_eq!(channels.len(), self.previous.len());
        let steps = channels.iter().map(|flat| &flat.steps);
        let least: Vec<f64> = steps.map(|steps| steps.quantile_not_zero(0.05)).collect();
        // Whether the robot goes on in the same direction, in steps of so many usual least ones.
        let goes_on = |run: &RepeatRun, factor: f64| {
            run.steps.iter().zip(&least).any(|(&[entry, exit], least)| {
                let (entry, exit) = (f64::from(entry), f64::from(exit));
                let smaller = entry.abs().min(exit.abs());
                entry * exit > 0.0 && *least > 0.0 && smaller >= factor * least
            })
        };
        // A coarse encoder on a slow joint repeats its number for good; but not all that is measured
        // does at once, where it does not do so in motion.
        let telling = !self.others.is_empty() && 100 * self.coincidences < self.changed;
        let certain = |run: &RepeatRun| telling && run.identical && goes_on(run, 0.9);
        let likely = |run: &RepeatRun| goes_on(run, 3.0);
        let count = |which: &dyn Fn(&RepeatRun) -> bool| -> u64 {
            let runs = self.runs.iter().filter(|run| which(run));
            runs.map(|run| u64::from(run.rows)).sum()
        };
        let all = count(&|_| true);
        let sure = count(&certain);
        let mostly = 5 * sure > 4 * all;
        let in_motion =
            |run: &&RepeatRun| certain(run) || ((mostly || self.others.is_empty()) && likely(run));
        let moving = count(&|run| in_motion(&run));
        let mut stale = RepeatedRows {
            // Where most are of that kind, so are those at the slow turns of the motion.
            rows: if mostly { all } else { moving },
            moving,
            ..RepeatedRows::default()
        };
        for run in self.runs.iter().filter(in_motion) {
            let [first, second, before_last, last] = run.times;
            let episodes = &mut stale.episodes;
            episodes.add(first, last, u64::from(run.rows), 0.0);
            // The leap is on the side where a sample is missing: what lies next to it is in time.
            let size = |side: usize| -> f64 {
                let steps = run.steps.iter().zip(&least);
                let shares = steps.map(|(steps, least)| f64::from(steps[side].abs()) / least);
                shares.sum()
            };
            stale.cuts.push(match size(0) > size(1) {
                true => [first, before_last],
                false => [second, last],
            });
        }
        stale
    }
}

#[derive(Debug, Clone, Default)]
pub(crate) struct RepeatedRows {
    /// All of them, and those at whose place the robot certainly moves.
    pub(crate) rows: u64,
    pub(crate) moving: u64,
    pub(crate) episodes: FaultEpisodes,
    /// Rows to be left out: from, to [s].
    pub(crate) cuts: Vec<[f64; 2]>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions alone, or with a torque that is different in every row but the repeated ones.
    fn judged(positions: &[f64], repeated: Option<&[usize]>) -> RepeatedRows {
        let width = usize::from(repeated.is_some());
        let (mut repeats, mut flat) = (RepeatDetector::new(1, width), FlatDetector::default());
        let mut torque = 0.0;
        for (k, q) in positions.iter().enumerate() {
            if repeated.is_none_or(|rows| !rows.contains(&k)) {
                torque += 1.0;
            }
            repeats.take(k as f64, &[*q], &[torque][..width]);
            flat.take(k as f64, *q, f64::NAN);
        }
        repeats.judge(&[&flat])
    }

    #[test]
    fn a_sample_that_is_logged_twice_is_found_and_the_one_out_of_time_is_cut() {
        let mut q: Vec<f64> = (0..500).map(|k| (f64::from(k) * 0.01).sin()).collect();
        q[100] = q[99];
        q[200] = q[201];
        for repeated in [None, Some(&[100, 201][..])] {
            let stale = judged(&q, repeated);
            assert_eq!((stale.rows, stale.moving), (2, 2));
            assert_eq!(stale.cuts, [[100.0, 100.0], [200.0, 200.0]]);
        }
    }

    #[test]
    fn a_coarse_encoder_on_a_slow_joint_repeats_nothing() {
        let slow = (0..5000).map(|k| (f64::from(k) * 0.3).floor() * 1e-4);
        let fast = (0..500).map(|k| 0.15 + f64::from(k) * 5e-4);
        let rest = (0..300).map(|_| 0.4);
        let q: Vec<f64> = slow.chain(fast).chain(rest).collect();
        for repeated in [None, Some(&[][..])] {
            let stale = judged(&q, repeated);
            assert!(stale.rows == 0 && stale.cuts.is_empty(), "{stale:?}");
        }
    }

    #[test]
    fn at_slow_speed_only_what_repeats_in_all_channels_is_a_repetition() {
        let slow = |k: i32| (f64::from(k) * 0.3).floor() * 1e-4;
        let q: Vec<f64> = (0..5000).map(slow).collect();
        let again = |k: &usize| k % 500 == 2 && q[*k] == q[k - 1];
        let repeated: Vec<usize> = (1..5000).filter(again).collect();
        let stale = judged(&q, Some(&repeated));
        let alone = |k: &&usize| q[**k + 1] != q[**k] && q[**k - 2] != q[**k - 1];
        let pairs = repeated.iter().filter(alone);
        assert_eq!(stale.rows as usize, pairs.count());
    }
}
