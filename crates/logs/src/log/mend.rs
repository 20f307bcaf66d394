//! What a first look at a log found, and a second one mends as it reads: positions that begin anew
//! after their range, samples that were held for several rows, single numbers far off the others.

use std::sync::Arc;

use super::even::EvenSpacing;

/// The number that differs from another one by whole ranges and is nearest to 0.
pub(crate) fn signed(number: f64, range: f64) -> f64 {
    number - range * (number / range).round()
}

/// Follows one position that begins anew after its range, through its turns.
#[derive(Debug)]
pub(crate) struct PositionUnwrap {
    range: f64,
    last: Option<f64>,
    turns: f64,
}

impl PositionUnwrap {
    /// For a range in the unit of the position; finite and more than 0.
    pub(crate) fn new(range: f64) -> Self {
        Self {
            range,
            last: None,
            turns: 0.0,
        }
    }

    /// The next position with the turns that it went through; a step of more than half the range is one through its end.
    #[inline]
    pub(crate) fn take(&mut self, position: f64) -> f64 {
        if !position.is_finite() {
            return position;
        }
        if let Some(last) = self.last {
            self.turns -= ((position - last) / self.range).round();
        }
        self.last = Some(position);
        position + self.turns * self.range
    }
}

/// A number that is put in the place of a logged one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgedSample {
    /// Time of its row [s].
    pub t: f64,
    /// Channel: the positions in joint order, then the torques.
    pub channel: usize,
    /// What stands there instead, as logged, in SI units.
    pub value: f64,
}

/// What is mended while a log is read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MendingSettings {
    /// Range of each position that begins anew [m or rad], where the robot file names none.
    pub wraps: Vec<Option<f64>>,
    /// Rows for which each sample was held: only fresh ones are handed out.
    pub held: Option<usize>,
    /// The even clock of rows whose stamps jitter.
    pub even: Option<EvenSpacing>,
    /// Whether rows that repeat others in the middle of a motion stay.
    pub keep_repeats: bool,
    /// Numbers to replace, in the order of time.
    pub bridges: Arc<[BridgedSample]>,
    /// Times of rows that were not read and are left out, in order [s].
    pub failed: Arc<[f64]>,
}

/// Leaves out rows by their times, row after row.
#[derive(Debug, Default)]
pub(super) struct RowRemover {
    all: Arc<[f64]>,
    next: usize,
    pub(super) dropped: u64,
}

impl RowRemover {
    pub(super) fn new(all: Arc<[f64]>) -> Self {
        Self {
            all,
            ..Self::default()
        }
    }

    /// Whether the row at time `t` was not read [s].
    #[inline]
    pub(super) fn has(&mut self, t: f64) -> bool {
        while self.all.get(self.next).is_some_and(|failed| *failed < t) {
            self.next += 1;
        }
        let failed = self.all.get(self.next) == Some(&t);
        self.dropped += u64::from(failed);
        failed
    }
}

/// Rows for which a sample is held at most, by those of each that was: two clocks hold some longer than others, and from
/// half as long again as the mean on it is two.
pub(crate) fn longest_hold(mean: f64, each: impl Iterator<Item = usize>) -> usize {
    let one = each.filter(|rows| *rows as f64 <= 1.5 * mean);
    one.fold(mean.round() as usize, usize::max)
}

/// Finds rows that repeat the one before, in a log that holds its samples.
#[derive(Debug, Default)]
pub(super) struct HeldRowFilter {
    /// Rows for which a sample is held; 0 where none is.
    rows: usize,
    /// Positions, torques and velocities of the last fresh row.
    last: Vec<f64>,
    /// Rows since then.
    since: usize,
    pub(super) dropped: u64,
}

impl HeldRowFilter {
    pub(super) fn new(rows: Option<usize>) -> Self {
        Self {
            rows: rows.unwrap_or(0),
            ..Self::default()
        }
    }

    /// Whether a row holds a sample that is there already; of equal samples one is kept every so many rows.
    #[inline]
    pub(super) fn repeats(&mut self, parts: [&[f64]; 3]) -> bool {
        if self.rows < 2 {
            return false;
        }
        let mut last = self.last.as_slice();
        let mut same = self.last.len() == parts.iter().map(|part| part.len()).sum::<usize>();
        for part in parts {
            let (before, rest) = last.split_at(part.len().min(last.len()));
            same &= before == part;
            last = rest;
        }
        self.since += 1;
        if same && self.since < self.rows {
            self.dropped += 1;
            return true;
        }
        self.since = 0;
        self.last.clear();
        parts.iter().for_each(|part| self.last.extend(*part));
        false
    }
}

/// Puts numbers in the place of others, row after row.
#[derive(Debug, Default)]
pub(super) struct BridgeInserter {
    all: Arc<[BridgedSample]>,
    next: usize,
}

impl BridgeInserter {
    pub(super) fn new(all: Arc<[BridgedSample]>) -> Self {
        Self { all, next: 0 }
    }

    /// Mends the row at time `t` [s].
    #[inline]
    pub(super) fn mend(&mut self, t: f64, positions: &mut [f64], torques: &mut [f64]) {
        while let Some(bridge) = self.all.get(self.next)
            && bridge.t <= t
        {
            self.next += 1;
            if bridge.t < t {
                continue;
            }
            let place = match bridge.channel.checked_sub(positions.len()) {
                None => positions.get_mut(bridge.channel),
                Some(torque) => torques.get_mut(torque),
            };
            if let Some(place) = place {
                *place = bridge.value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_is_followed_through_its_turns_in_both_directions() {
        let range = 360.0;
        let mut unwrap = PositionUnwrap::new(range);
        for k in 0..4000 {
            let q = 900.0 * (f64::from(k) * 0.003).sin();
            let logged = (q + 180.0).rem_euclid(range) - 180.0;
            assert!((unwrap.take(logged) - q).abs() < 1e-9, "{q}");
        }
        assert!(unwrap.take(f64::NAN).is_nan());
    }

    #[test]
    fn of_held_samples_the_fresh_one_is_kept_and_at_rest_one_in_so_many_rows() {
        let rows = [1, 1, 1, 2, 2, 2, 3, 3, 3, 3, 3, 3, 4].map(f64::from);
        let mut held = HeldRowFilter::new(Some(3));
        let fresh: Vec<usize> = (0..rows.len())
            .filter(|k| !held.repeats([&rows[*k..=*k], &[7.0], &[]]))
            .collect();
        assert_eq!((fresh, held.dropped), (vec![0, 3, 6, 9, 12], 8));
        let mut none = HeldRowFilter::new(None);
        assert!(rows.iter().all(|x| !none.repeats([&[*x], &[], &[]])));
    }

    #[test]
    fn numbers_are_replaced_at_their_rows_and_nowhere_else() {
        let all = [(0.0, 0, 5.0), (0.2, 1, 6.0), (0.2, 2, 7.0)];
        let all = all.map(|(t, channel, value)| BridgedSample { t, channel, value });
        let mut bridging = BridgeInserter::new(all.into());
        let as_logged = [1.0, 2.0, 3.0];
        for (t, expected) in [(0.1, as_logged), (0.2, [1.0, 6.0, 7.0]), (0.3, as_logged)] {
            let (mut q, mut tau) = ([1.0, 2.0], [3.0]);
            bridging.mend(t, &mut q, &mut tau);
            assert_eq!([q[0], q[1], tau[0]], expected);
        }
    }
}
