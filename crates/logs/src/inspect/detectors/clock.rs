//! The clock of a log: its step, how even it is, and where it stands still, runs back or leaps.

use super::histogram::Histogram;
use crate::inspect::fault::FaultEpisodes;

/// A step longer than this many median ones is a gap (as `motion::FilterSettings::gap_factor`).
pub(crate) const GAP: f64 = 2.5;
/// A step within this share of the median is even.
const EVEN_STEP_TOLERANCE: f64 = 0.10;
/// Rounds in which the mean step and what is near it are found.
const MEAN_ROUNDS: usize = 3;
/// Long steps that are kept until the median is known.
const MAX_LONG_STEPS: usize = 1 << 16;

/// What a row's time is to the row before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RowStep {
    /// The next row of the same stretch.
    Next,
    /// The first row of a stretch: the first at all, after a gap, or after time ran back.
    Apart,
    /// No row to go on with: its time is that of the row before, or no number.
    Unusable,
    /// A row that was not read: its numbers are none.
    Unread,
}

impl RowStep {
    pub(crate) fn is_usable(self) -> bool {
        !matches!(self, Self::Unusable | Self::Unread)
    }
}

/// The times of a log, seen one after the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct LogClock {
    pub(crate) rows: u64,
    pub(crate) first: Option<f64>,
    /// Time of the last row that had one [s].
    pub(crate) last: f64,
    steps: Histogram,
    /// Steps from, to [s] that may be gaps.
    long: Vec<[f64; 2]>,
    /// What is long for now.
    long_from: f64,
    pub(crate) repeated: FaultEpisodes,
    pub(crate) backward: FaultEpisodes,
    pub(crate) without_time: u64,
    /// Times at which runs begin that one table holds: no row is lost before them [s].
    pub(crate) seams: Vec<f64>,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ClockFacts {
    /// Median step [s], to about a percent; 0 where there is none.
    pub(crate) dt: f64,
    /// Mean of the steps that are neither lost rows nor repeats [s]: jitter puts the median off, and leaves the mean.
    pub(crate) mean: f64,
    /// Half the range that the middle 90 % of the steps take, over the median.
    pub(crate) jitter: f64,
    /// Share of the steps that are off the median by more than a tenth, gaps aside.
    pub(crate) uneven: f64,
    /// From, to [s].
    pub(crate) gaps: Vec<[f64; 2]>,
    pub(crate) least: f64,
    pub(crate) largest: f64,
    /// Step that one in fifty exceeds [s]: long where rows come in bursts, and not for a gap here and there.
    pub(crate) long: f64,
}

impl LogClock {
    /// Takes the times of some rows, and says for each what it is to the row before.
    pub(crate) fn take(&mut self, times: &[f64]) -> Vec<RowStep> {
        self.long_from = GAP
            * match self.rows {
                0 => typical_step(times),
                _ => self.steps.quantile_not_zero(0.5),
            };
        self.rows += times.len() as u64;
        times.iter().map(|t| self.step(*t)).collect()
    }

    fn step(&mut self, t: f64) -> RowStep {
        if !t.is_finite() {
            self.without_time += 1;
            return RowStep::Unusable;
        }
        if self.first.is_none() {
            self.first = Some(t);
            self.last = t;
            return RowStep::Apart;
        }
        let before = self.last;
        let step = t - before;
        if step == 0.0 {
            self.repeated.add(t, t, 1, 0.0);
            return RowStep::Unusable;
        }
        self.last = t;
        if step < 0.0 {
            self.backward.add(t, before, 1, -1.0);
            return RowStep::Apart;
        }
        self.steps.add(step);
        if step > self.long_from && self.long_from > 0.0 {
            self.note_long(before, t);
            return RowStep::Apart;
        }
        RowStep::Next
    }

    #[cold]
    fn note_long(&mut self, from: f64, to: f64) {
        if self.long.len() == MAX_LONG_STEPS {
            // The shorter half is the less likely to be gaps once the median is known.
            let mut lengths: Vec<f64> = self.long.iter().map(|[a, b]| b - a).collect();
            lengths.sort_by(f64::total_cmp);
            let middle = lengths[MAX_LONG_STEPS / 2];
            self.long.retain(|[a, b]| b - a > middle);
        }
        if self.long.len() < MAX_LONG_STEPS {
            self.long.push([from, to]);
        }
    }

    pub(crate) fn step_so_far(&self) -> f64 {
        self.steps.quantile(0.5)
    }

    /// Time from the first to the last row [s].
    pub(crate) fn duration(&self) -> f64 {
        self.first.map_or(0.0, |first| self.last - first)
    }

    pub(crate) fn facts(&self) -> ClockFacts {
        let dt = self.steps.quantile(0.5);
        if dt <= 0.0 {
            return ClockFacts::default();
        }
        let seam = |t: f64| self.seams.iter().any(|seam| (t - seam).abs() < 0.5 * dt);
        let gaps = self
            .long
            .iter()
            .filter(|[a, b]| b - a > GAP * dt && !seam(*b));
        let (low, high) = (self.steps.quantile(0.05), self.steps.quantile(0.95));
        let even = |side: f64| (1.0 + side * EVEN_STEP_TOLERANCE) * dt;
        let mut mean = dt;
        for _ in 0..MEAN_ROUNDS {
            mean = self
                .steps
                .mean_within(0.25 * mean, 1.75 * mean)
                .unwrap_or(mean);
        }
        ClockFacts {
            dt,
            mean,
            jitter: 0.5 * (high - low) / dt,
            uneven: (self.steps).share_outside(even(-1.0), even(1.0)),
            gaps: gaps.copied().collect(),
            least: self.steps.quantile(0.0),
            largest: self.steps.quantile(1.0),
            long: self.steps.quantile(0.98),
        }
    }
}

/// Median of the steps forward between some times [s]; 0 where there is none.
pub(crate) fn typical_step(times: &[f64]) -> f64 {
    let pairs = times.windows(2).map(|pair| pair[1] - pair[0]);
    let mut steps: Vec<f64> = pairs.filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// Mean of the steps between some times that are neither lost rows nor repeats \[s\]: jitter puts the median off, and
/// leaves the mean.
pub(crate) fn mean_step(times: &[f64]) -> f64 {
    let mut mean = typical_step(times);
    for _ in 0..MEAN_ROUNDS {
        let near = 0.25 * mean..=1.75 * mean;
        let steps = times.windows(2).map(|pair| pair[1] - pair[0]);
        let steps = steps.filter(|step| *step > 0.0 && near.contains(step));
        let [sum, count] = steps.fold([0.0; 2], |[sum, count], step| [sum + step, count + 1.0]);
        if count == 0.0 {
            break;
        }
        mean = sum / count;
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_repeats_and_steps_back_are_set_apart_and_placed() {
        let mut clock = LogClock::default();
        let mut times: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.001).collect();
        times.drain(500..550);
        times[100] = times[99];
        times[200] = 0.15;
        times[300] = f64::NAN;
        let steps = clock.take(&times);
        let facts = clock.facts();
        assert!((facts.dt - 0.001).abs() < 1e-6, "{facts:?}");
        assert_eq!((steps[0], steps[1]), (RowStep::Apart, RowStep::Next));
        assert_eq!([steps[100], steps[300]], [RowStep::Unusable; 2]);
        assert_eq!([steps[200], steps[500]], [RowStep::Apart; 2]);
        assert_eq!(clock.repeated.rows(), 1);
        assert_eq!(clock.backward.rows(), 1);
        // from 0.15 back up to 0.201, and over the rows that are gone
        assert_eq!(facts.gaps, [[0.15, 0.201], [0.499, 0.55]]);
        assert!(facts.jitter < 0.01, "{facts:?}");
    }

    #[test]
    fn the_mean_step_of_stamps_that_jitter_is_that_of_the_rows() {
        let off = [0.0, 0.2e-3, -0.1e-3, 0.3e-3, -0.2e-3];
        let mut times: Vec<f64> = (0..2000_u32)
            .map(|k| 1e-3 * f64::from(k) + off[k as usize * 7 % 5])
            .collect();
        times.drain(700..750);
        assert!((typical_step(&times) - 1e-3).abs() > 0.05e-3);
        assert!((mean_step(&times) - 1e-3).abs() < 0.005e-3);
    }

    #[test]
    fn an_uneven_clock_has_its_spread_over_the_step_as_jitter() {
        let mut clock = LogClock::default();
        let times: Vec<f64> = (0..20_000)
            .map(|k| f64::from(k) * 0.01 + if k % 2 == 0 { 0.001 } else { -0.001 })
            .collect();
        clock.take(&times);
        let facts = clock.facts();
        let jitter = 0.2 / facts.dt * 0.01;
        assert!((facts.jitter - jitter).abs() < 0.02, "{facts:?}");
        let off = (facts.dt - 0.01).abs() > 0.001;
        assert!(facts.uneven > 0.9 || off, "{facts:?}");
        assert!(facts.gaps.is_empty());
    }
}
