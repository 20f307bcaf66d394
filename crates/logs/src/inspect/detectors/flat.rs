//! Values that do not change: flat tops of a clipped channel, and channels that stick.
//!
//! A channel may stand still for good reasons: the joint is stationary, the motor is off, the encoder is
//! coarse. What a recorder or sensor does shows at the edges (the channel is moving, and stops from
//! one row to the next), or in what happens meanwhile (the joint travels, its torque does not
//! change in the last digit).

use super::histogram::Histogram;

/// Rows of one value from which a run is looked at.
const MIN_RUN_ROWS: u64 = 3;
/// Runs that are kept, the longest.
const MAX_RUNS: usize = 4096;
/// Values next to an extreme that are counted.
const LEVELS: usize = 8;

/// Rows in which a channel kept one value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FlatRun {
    pub(crate) value: f64,
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) rows: u64,
    /// Change from the row before, and to the row after it; NaN where there is none.
    pub(crate) entry: f64,
    pub(crate) exit: f64,
    /// How far the joint's position went meanwhile.
    pub(crate) travel: f64,
}

impl FlatRun {
    /// Whether it is the same run: edges may be no numbers.
    pub(crate) fn is(&self, other: &Self) -> bool {
        (self.from, self.to) == (other.from, other.to)
    }
}

/// Finds the runs of rows in which a channel stands still, row after row.
#[derive(Debug, Clone, Default)]
pub(crate) struct FlatDetector {
    current: Option<OpenFlatRun>,
    /// The runs of three rows and more, in the order of time.
    pub(crate) runs: Vec<FlatRun>,
    /// Rows of the shortest run that is kept, once there are too many.
    shortest: u64,
    /// Lengths of all runs, runs of one row too.
    pub(crate) lengths: Histogram,
    /// Sizes of the steps from row to row, and of their changes, where the channel moves.
    pub(crate) steps: Histogram,
    pub(crate) bends: Histogram,
    pub(crate) top: LargestLevels,
    pub(crate) bottom: LargestLevels,
}

/// The run that has not ended yet, with the least and the greatest value in it.
#[derive(Debug, Clone, Copy)]
struct OpenFlatRun {
    run: FlatRun,
    low: f64,
    high: f64,
    /// Step into the row before this one.
    step: f64,
}

impl FlatDetector {
    /// Takes the next row: `position` is the joint's, where it is known and not this channel.
    #[inline]
    pub(crate) fn take(&mut self, t: f64, value: f64, position: f64) {
        self.top.take(value);
        self.bottom.take(-value);
        let Some(current) = &mut self.current else {
            return self.begin(t, value, position, f64::NAN);
        };
        let step = value - current.run.value;
        if step == 0.0 {
            current.run.to = t;
            current.run.rows += 1;
            // a NaN changes nothing
            current.low = current.low.min(position);
            current.high = current.high.max(position);
            current.step = 0.0;
            return;
        }
        self.steps.add(step);
        let bend = step - current.step;
        if bend.is_finite() {
            self.bends.add(bend);
        }
        self.end(step);
        self.begin(t, value, position, step);
    }

    pub(crate) fn part(&mut self) {
        self.end(f64::NAN);
        self.current = None;
    }

    fn begin(&mut self, t: f64, value: f64, position: f64, step: f64) {
        self.current = Some(OpenFlatRun {
            run: FlatRun {
                value,
                from: t,
                to: t,
                rows: 1,
                entry: step,
                exit: f64::NAN,
                travel: 0.0,
            },
            low: position,
            high: position,
            step,
        });
    }

    fn end(&mut self, exit: f64) {
        let Some(current) = &self.current else {
            return;
        };
        let mut run = current.run;
        self.lengths.add(run.rows as f64);
        if run.rows < MIN_RUN_ROWS.max(self.shortest) {
            return;
        }
        run.exit = exit;
        run.travel = (current.high - current.low).max(0.0);
        if self.runs.len() == MAX_RUNS {
            let mut rows: Vec<u64> = self.runs.iter().map(|run| run.rows).collect();
            rows.sort_unstable();
            self.shortest = rows[MAX_RUNS / 2] + 1;
            self.runs.retain(|run| run.rows >= self.shortest);
        }
        self.runs.push(run);
    }
}

/// The largest values of a channel, and how often each was there.
#[derive(Debug, Clone, Default)]
pub(crate) struct LargestLevels {
    /// Falling values.
    list: Vec<(f64, u64)>,
}

impl LargestLevels {
    #[inline]
    fn take(&mut self, value: f64) {
        let full = self.list.len() == LEVELS;
        if !full || self.list.last().is_none_or(|(least, _)| value >= *least) {
            self.insert(value);
        }
    }

    fn insert(&mut self, value: f64) {
        let at = self.list.partition_point(|(level, _)| *level > value);
        match self.list.get_mut(at) {
            Some((level, count)) if *level == value => *count += 1,
            _ => {
                if self.list.len() == LEVELS {
                    self.list.pop();
                }
                self.list.insert(at, (value, 1));
            }
        }
    }

    /// The largest value; NaN where there is none.
    pub(crate) fn extreme(&self) -> f64 {
        self.list.first().map_or(f64::NAN, |(value, _)| *value)
    }

    /// Whether the largest value is there so much more often than those next to it that something ends there.
    pub(crate) fn piles_up(&self) -> bool {
        let Some(((_, count), others)) = self.list.split_first() else {
            return false;
        };
        let next = others.iter().map(|(_, count)| *count).max().unwrap_or(0);
        *count >= 5 && *count >= 4 * next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fed(values: impl Iterator<Item = f64>) -> FlatDetector {
        let mut flat = FlatDetector::default();
        for (k, value) in values.enumerate() {
            let t = k as f64 * 0.001;
            flat.take(t, value, t);
        }
        flat.part();
        flat
    }

    #[test]
    fn a_run_knows_its_rows_its_edges_and_how_far_the_joint_went() {
        let values = (0..100).map(|k| f64::from(k.clamp(20, 50)));
        let flat = fed(values);
        assert_eq!(flat.runs.len(), 2);
        let [first, second] = [flat.runs[0], flat.runs[1]];
        assert_eq!((first.rows, first.from, first.exit), (21, 0.0, 1.0));
        assert!(first.entry.is_nan());
        assert_eq!((second.value, second.rows, second.entry), (50.0, 50, 1.0));
        assert!((second.travel - 0.049).abs() < 1e-12 && second.exit.is_nan());
        assert!((flat.steps.quantile(0.0) - 1.0).abs() < 1e-12);
        assert!(flat.top.piles_up() && flat.bottom.piles_up());
        assert_eq!((flat.top.extreme(), -flat.bottom.extreme()), (50.0, 20.0));
    }

    #[test]
    fn the_crest_of_a_coarse_sine_does_not_pile_up() {
        let sine = (0..5000).map(|k| (f64::from(k) * 0.01).sin());
        let flat = fed(sine.map(|x| (x * 1000.0).round()));
        assert!(!flat.top.piles_up(), "{:?}", flat.top);
        let clipped = (0..5000).map(|k| (f64::from(k) * 0.01).sin().min(0.8));
        assert!(fed(clipped).top.piles_up());
    }

    #[test]
    fn the_longest_runs_are_kept_where_there_are_too_many() {
        let values = (0..60_000).map(|k| f64::from(k / if k < 30_000 { 3 } else { 6 }));
        let flat = fed(values);
        assert!(flat.runs.len() <= MAX_RUNS);
        let all = flat.runs.iter().all(|run| run.rows == 6);
        assert!(all, "{:?}", flat.shortest);
    }
}
