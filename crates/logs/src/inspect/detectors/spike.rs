//! Single rows that are far off their neighbours.
//!
//! A row is compared with the median of the seven rows about it (Hampel 1974): on a slope or a step
//! that difference is nothing, at a spike of one to three rows it is the spike's height. At a turn
//! of smooth motion it is small but not nothing: what stands out there as well must also be off the
//! cubic through the rows four and five away, or through the next ones that do not stand out
//! themselves.
//!
//! A peak of a torque is none where the speed of its joint changes at the same rows by more than the position's noise:
//! an inertia explains it.

use super::histogram::Histogram;
use super::ring::RowRing;

const MEDIAN_ROWS: usize = 7;
const HALF_WIDTH: usize = MEDIAN_ROWS / 2;
/// Rows to each side that are remembered of a spike.
const REACH_ROWS: usize = 5;
/// Rows to each side in which a spike must stand alone.
const AROUND: usize = 25;
/// Rows to each side by which a change of the speed is seen.
const CHANGE: usize = 9;
/// Spikes that are kept, the highest.
const MAX_SPIKES: usize = 16_384;
/// A row may be a spike where it is off by so many times what nine rows of ten are.
const SUSPECT_FACTOR: f64 = 3.0;
const SUSPECT_QUANTILE: f64 = 0.9;
/// Share of the rows by which a spike is measured.
const SPIKE_QUANTILE: f64 = 0.995;
/// A spike is so many times what nearly all other rows differ from their neighbours.
pub(crate) const SPIKE: f64 = 8.0;
/// One of a torque, and one of many, has at least this share of the channel's deviation.
pub(crate) const SPIKE_SHARE: f64 = 0.1;
/// A speed changes where it does by so many usual changes, and by so many times the largest of the rows beside.
const MIN_RATIO_TO_USUAL: f64 = 6.0;
const MIN_RATIO_TO_NEIGHBOURS: f64 = 3.0;

/// Rows of two sources by turns: the squared steps over two rows are less than this share of those over one.
const MAX_TWO_ROW_SHARE: f64 = 0.5;

/// A row that stands out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SampleSpike {
    pub(crate) t: f64,
    /// Difference from the median of its neighbours.
    pub(crate) height: f64,
    /// Times and numbers of the rows about, itself in the middle.
    around: [[f64; 2]; 2 * REACH_ROWS + 1],
}

impl SampleSpike {
    /// The number of the cubic through the two nearest rows on each side that are not `bad`, where there are any.
    pub(crate) fn bridge(&self, bad: &dyn Fn(f64) -> bool) -> Option<f64> {
        let good = |row: &&[f64; 2]| !bad(row[0]);
        let before = self.around[..REACH_ROWS].iter().rev().filter(good).take(2);
        let after = self.around[REACH_ROWS + 1..].iter().filter(good).take(2);
        let nodes: Vec<[f64; 2]> = before.chain(after).copied().collect();
        cubic(&nodes, self.t)
    }
}

/// The cubic through two points on each side of a place, there; `None` where there are fewer.
fn cubic(nodes: &[[f64; 2]], at: f64) -> Option<f64> {
    let before = nodes.iter().filter(|node| node[0] < at).count();
    if (before, nodes.len()) != (2, 4) {
        return None;
    }
    let weight = |i: usize| -> f64 {
        let others = (0..4).filter(|j| *j != i);
        others
            .map(|j| (at - nodes[j][0]) / (nodes[i][0] - nodes[j][0]))
            .product()
    };
    Some((0..4).map(|i| weight(i) * nodes[i][1]).sum())
}

/// Finds rows that stand out between those before and behind them, row after row.
#[derive(Debug, Clone, Default)]
pub(crate) struct SpikeDetector {
    values: RowRing,
    times: RowRing,
    differences: RowRing,
    /// Positions of the joint.
    positions: RowRing,
    /// How far its speed changes over three rows, but for what it does as steadily beside them [positions per two rows].
    changes_seen: Histogram,
    /// Rows since the stretch began.
    count: usize,
    /// Rows whose difference was looked at as a spike.
    judged: usize,
    pub(crate) differences_seen: Histogram,
    /// A difference above it may be a spike.
    suspect: f64,
    /// Those that may be spikes, in the order of time.
    pub(crate) found: Vec<SampleSpike>,
    /// Height of the lowest spike that is kept, once there are too many.
    lowest: f64,
    /// Sums over the rows: of each step times the one before, of the squared steps, of the squared steps over two rows.
    steps: [f64; 3],
}

impl SpikeDetector {
    /// Takes the next row of a channel, and the position of its joint where the channel is none itself.
    #[inline]
    pub(crate) fn take(&mut self, t: f64, value: f64, position: f64) {
        let k = self.count;
        self.values[k] = value;
        self.times[k] = t;
        self.positions[k] = position;
        self.count += 1;
        if self.count < MEDIAN_ROWS {
            return;
        }
        let [before, last] = [k - 2, k - 1].map(|k| self.values[k]);
        let step = value - last;
        let sums = [
            step * (last - before),
            step * step,
            (value - before).powi(2),
        ];
        (self.steps.iter_mut().zip(sums)).for_each(|(sum, x)| *sum += x);
        let centre = k - HALF_WIDTH;
        let window = std::array::from_fn(|i| self.values[k - i]);
        let difference = self.values[centre] - median(window);
        self.differences[centre] = difference;
        self.differences_seen.add(difference);
        if position.is_finite() && k >= 2 * CHANGE {
            let change = self.change(k - CHANGE);
            if change.is_finite() {
                self.changes_seen.add(change);
            }
        }
        if centre >= HALF_WIDTH + AROUND {
            self.judge(centre - AROUND, centre);
        }
    }

    pub(crate) fn part(&mut self) {
        if self.count >= MEDIAN_ROWS {
            let last = self.count - 1 - HALF_WIDTH;
            for row in self.judged.max(HALF_WIDTH)..=last {
                self.judge(row, last);
            }
        }
        self.count = 0;
        self.judged = 0;
    }

    /// Brings the suspicion up to date with what was seen so far.
    pub(crate) fn settle(&mut self) {
        self.suspect = SUSPECT_FACTOR * self.differences_seen.quantile(SUSPECT_QUANTILE);
    }

    /// What nearly all rows differ from their neighbours.
    pub(crate) fn nearly_all(&self) -> f64 {
        self.differences_seen.quantile(SPIKE_QUANTILE)
    }

    /// The same, but where more rows are spikes than that leaves out, those are set aside first (Rosner 1983).
    pub(crate) fn usual(&self, deviation: f64) -> f64 {
        // they hide each other where they are counted among the rest
        let rows = self.differences_seen.total.max(1) as f64;
        let apart = |aside: usize| {
            let rest = 1.0 - aside as f64 / rows;
            self.differences_seen.quantile(SPIKE_QUANTILE * rest)
        };
        let mut aside = self.found.len();
        loop {
            let least = (SPIKE * apart(aside)).max(SPIKE_SHARE * deviation);
            let spikes = self.found.iter();
            let higher = spikes.filter(|s| s.height.abs() > least).count();
            if higher >= aside {
                break;
            }
            aside = higher;
        }
        let hidden = aside as f64 > (1.0 - SPIKE_QUANTILE) * rows;
        apart(if hidden { aside } else { 0 })
    }

    /// Whether steps mostly take back the step before, as noise does and no motion.
    pub(crate) fn goes_to_and_fro(&self) -> bool {
        self.steps[0] < 0.0
    }

    /// Whether every other row belongs together more than neighbours do: of noise, both differ alike.
    pub(crate) fn alternates(&self) -> bool {
        self.steps[2] < MAX_TWO_ROW_SHARE * self.steps[1]
    }

    /// Change of the joint's speed at a row, less half of those six rows before and after.
    fn change(&self, row: usize) -> f64 {
        let q = |k: usize| self.positions[k];
        let at = |k: usize| (q(k + 3) - q(k + 1)) - (q(k - 1) - q(k - 3));
        at(row) - 0.5 * (at(row - 6) + at(row + 6))
    }

    /// Whether a row beside it stands out as well: no machine changes its speed within a single row.
    fn lasts(&self, row: usize, height: f64) -> bool {
        let beside = [row.wrapping_sub(1), row + 1];
        let mut beside = beside.iter().map(|k| self.differences[*k]);
        beside.any(|other| other * height > 0.25 * height * height)
    }

    /// Whether the joint's speed changes at a row.
    fn moves(&self, row: usize) -> bool {
        let usual = self.changes_seen.quantile_not_zero(0.5);
        if row < CHANGE || row + CHANGE >= self.count || usual <= 0.0 {
            return false;
        }
        let reach = CHANGE + HALF_WIDTH + 1;
        let from = row.saturating_sub(AROUND).max(CHANGE);
        let to = (row + AROUND).min(self.count - 1 - CHANGE);
        let beside = (from..=to).filter(|k| k.abs_diff(row) >= reach);
        let largest = beside.map(|k| self.change(k).abs()).fold(0.0, f64::max);
        self.change(row).abs() > (MIN_RATIO_TO_USUAL * usual).max(MIN_RATIO_TO_NEIGHBOURS * largest)
    }

    /// Looks whether a row stands alone among those up to `last`.
    #[inline]
    fn judge(&mut self, row: usize, last: usize) {
        self.judged = row + 1;
        let height = self.differences[row];
        if height.abs() > self.suspect.max(self.lowest) {
            self.judge_closely(row, last, height);
        }
    }

    #[cold]
    fn judge_closely(&mut self, row: usize, last: usize, height: f64) {
        let from = row.saturating_sub(AROUND).max(HALF_WIDTH);
        let others = (from..=last.min(row + AROUND)).filter(|k| k.abs_diff(row) > HALF_WIDTH);
        let high = others.filter(|k| self.differences[*k].abs() > 0.25 * height.abs());
        // A second spike may be near, a rough stretch may not.
        if high.count() > 3 {
            return;
        }
        let Some(height) = self.off_cubic(row, height) else {
            return;
        };
        if self.lasts(row, height) && self.moves(row) {
            return;
        }
        if self.found.len() == MAX_SPIKES {
            let mut heights: Vec<f64> = self.found.iter().map(|s| s.height.abs()).collect();
            heights.sort_by(f64::total_cmp);
            self.lowest = heights[MAX_SPIKES / 2];
            self.found.retain(|spike| spike.height.abs() > self.lowest);
        }
        // as far as the cubic reaches, there are rows
        let around = std::array::from_fn(|i| {
            let at = row + i - REACH_ROWS;
            [self.times[at], self.values[at]]
        });
        self.found.push(SampleSpike {
            t: self.times[row],
            height,
            around,
        });
    }

    /// How far a row is off the cubic through rows beside it, `height` at most; `None` on it, and where rows are missing.
    fn off_cubic(&self, row: usize, height: f64) -> Option<f64> {
        let quiet = |k: &usize| self.differences[*k].abs() <= 0.25 * height.abs();
        let before = (row.saturating_sub(AROUND)..(row + 1).saturating_sub(REACH_ROWS - 1)).rev();
        let after = row + REACH_ROWS - 1..self.count.min(row + AROUND);
        let before = before.filter(quiet).take(2);
        let nodes = before.chain(after.filter(quiet).take(2));
        let node = |k: usize| [k as f64 - row as f64, self.values[k]];
        let nodes: Vec<[f64; 2]> = nodes.map(node).collect();
        let off = self.values[row] - cubic(&nodes, 0.0)?;
        let agrees = off * height > 0.0 && off.abs() > 0.5 * height.abs();
        agrees.then(|| off.abs().min(height.abs()).copysign(height))
    }
}

#[inline]
fn median(mut x: [f64; MEDIAN_ROWS]) -> f64 {
    // Exchanges that leave the middle one in its place (Devillard 1998).
    const EXCHANGES: [(usize, usize); 13] = [
        (0, 5),
        (0, 3),
        (1, 6),
        (2, 4),
        (0, 1),
        (3, 5),
        (2, 6),
        (2, 3),
        (3, 6),
        (4, 5),
        (1, 4),
        (1, 3),
        (3, 4),
    ];
    for (a, b) in EXCHANGES {
        let (low, high) = (x[a].min(x[b]), x[a].max(x[b]));
        x[a] = low;
        x[b] = high;
    }
    x[HALF_WIDTH]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn fed(values: &[f64]) -> SpikeDetector {
        let mut spikes = SpikeDetector::default();
        for (k, value) in values.iter().enumerate() {
            if k % 256 == 0 {
                spikes.settle();
            }
            spikes.take(k as f64, *value, f64::NAN);
        }
        spikes.part();
        spikes
    }

    proptest! {
        #[test]
        fn the_median_is_the_middle_of_the_sorted_numbers(x in prop::array::uniform7(-10i32..10)) {
            let x = x.map(f64::from);
            let mut sorted = x;
            sorted.sort_by(f64::total_cmp);
            prop_assert_eq!(median(x), sorted[3]);
        }
    }

    #[test]
    fn spikes_of_one_to_three_rows_are_found_at_their_rows_near_the_end_too() {
        let mut values: Vec<f64> = (0..3000).map(|k| (f64::from(k) * 0.01).sin()).collect();
        for k in [500, 1200, 1201, 1202, 2990] {
            values[k] += 0.5;
        }
        let spikes = fed(&values);
        let high = spikes.found.iter().filter(|s| s.height > 0.3);
        let found: Vec<f64> = high.map(|s| s.t).collect();
        assert_eq!(found, [500.0, 1200.0, 1201.0, 1202.0, 2990.0]);
    }

    #[test]
    fn a_spike_is_bridged_by_the_cubic_through_its_neighbours() {
        let smooth = |k: f64| (k * 0.02).sin();
        let mut values: Vec<f64> = (0..3000).map(|k| smooth(f64::from(k))).collect();
        for k in [500, 1200, 1201, 1202] {
            values[k] += 0.5;
        }
        let spikes = fed(&values);
        let high: Vec<&SampleSpike> = spikes.found.iter().filter(|s| s.height > 0.3).collect();
        let bad = |t: f64| high.iter().any(|spike| spike.t == t);
        assert_eq!(high.len(), 4);
        for spike in &high {
            let off = spike.bridge(&bad).unwrap() - smooth(spike.t);
            assert!(off.abs() < 1e-5, "{} {off}", spike.t);
        }
        assert_eq!(high[0].bridge(&|_| true), None);
    }

    #[test]
    fn a_peak_of_a_torque_is_none_where_the_speed_of_its_joint_changes_and_one_where_it_only_turns()
    {
        let found = |peak: usize| -> usize {
            let mut spikes = SpikeDetector::default();
            for k in 0..3000 {
                if k % 256 == 0 {
                    spikes.settle();
                }
                let t = k as f64 * 1e-3;
                // a wave in counts, and a step of the speed at row 1000
                let step = 0.8 * (t - 1.0).max(0.0);
                let position = (((5.0 * t).sin() + step) * 1e5).round() * 1e-5;
                let noise = f64::from((k as u32 * 7919) % 1000) * 1e-5;
                let pulse = if [peak, peak + 1].contains(&k) {
                    20.0
                } else {
                    0.0
                };
                spikes.take(t, (5.0 * t).cos() + noise + pulse, position);
            }
            spikes.part();
            let found = spikes.found.iter();
            found.filter(|s| s.height.abs() > 10.0).count()
        };
        assert_eq!(found(1000), 0);
        assert_eq!(found(314), 2);
    }

    #[test]
    fn a_step_and_a_rough_stretch_are_no_spikes() {
        let step = |k: i32| if k < 1000 { 0.0 } else { 5.0 };
        let mut values: Vec<f64> = (0..3000).map(step).collect();
        for k in (2000..2500).step_by(9) {
            values[k] += 3.0;
        }
        let spikes = fed(&values);
        for spike in spikes.found {
            let inside = (2030.0..=2470.0).contains(&spike.t);
            assert!(spike.height.abs() < 1e-9 || !inside, "{spike:?}");
            assert!(spike.t >= 1990.0, "{spike:?}");
        }
    }
}
