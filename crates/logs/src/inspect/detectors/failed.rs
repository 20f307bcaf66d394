//! Rows in which every channel reads 0, or another number that is one for all, although the row before was not near it:
//! reads that failed.

/// A position that goes to such a number was no further from it than so many of its steps before, or of its smallest ones.
const USUAL_STEPS: f64 = 10.0;
const MAX_ROWS: usize = 65_536;

#[derive(Debug, Clone, Default)]
pub(crate) struct FailedReads {
    /// Positions of the last row that was read, and how far they went to it.
    before: Vec<f64>,
    steps: Vec<f64>,
    /// Smallest step of each that is not 0.
    grains: Vec<f64>,
    failing: bool,
    /// Times of the rows that failed, in order [s].
    pub(crate) times: Vec<f64>,
    /// What the first of them reads, as it was logged.
    pub(crate) value: f64,
}

impl FailedReads {
    pub(crate) fn new(positions: usize) -> Self {
        Self {
            before: vec![f64::NAN; positions],
            steps: vec![0.0; positions],
            grains: vec![f64::INFINITY; positions],
            ..Self::default()
        }
    }

    /// Whether the next row is none that was read; positions and others as they were logged.
    pub(crate) fn take(&mut self, t: f64, positions: &[f64], others: &[f64]) -> bool {
        let one = positions.first().copied().unwrap_or(f64::NAN);
        let empty = !others.is_empty() && positions.iter().chain(others).all(|x| *x == one);
        if empty && (self.failing || self.far(one)) {
            self.failing = true;
            if self.times.is_empty() {
                // no -0
                self.value = one + 0.0;
            }
            if self.times.len() < MAX_ROWS {
                self.times.push(t);
            }
            return true;
        }
        self.failing = false;
        for (j, q) in positions.iter().enumerate() {
            let step = (q - self.before[j]).abs();
            if step > 0.0 {
                self.grains[j] = self.grains[j].min(step);
            }
            self.steps[j] = step;
            self.before[j] = *q;
        }
        false
    }

    /// Whether a position cannot go to a number from where it was.
    fn far(&self, to: f64) -> bool {
        let mut pairs = self.before.iter().zip(&self.steps).zip(&self.grains);
        pairs.any(|((q, step), grain)| (q - to).abs() > USUAL_STEPS * step.max(*grain))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failed(rows: impl Iterator<Item = [f64; 3]>) -> Vec<f64> {
        let mut reads = FailedReads::new(2);
        for (k, row) in rows.enumerate() {
            reads.take(k as f64, &row[..2], &row[2..]);
        }
        reads.times
    }

    #[test]
    fn rows_of_one_number_between_others_are_reads_that_failed_whatever_it_is() {
        for (sentinel, torque) in [(-1.0, 2.0), (32767.0, 2.0), (0.0, 0.0)] {
            let row = |k: usize| match k {
                7 | 20 | 21 | 39 => [sentinel; 3],
                k => [0.5 + 0.01 * k as f64, (0.1 * k as f64).sin(), torque],
            };
            assert_eq!(failed((0..40).map(row)), [7.0, 20.0, 21.0, 39.0]);
        }
    }

    #[test]
    fn joints_that_come_to_their_zero_without_a_torque_are_read() {
        // through it, to it in counts, and at rest there
        let through = |k: usize| [0.01 * (k as f64 - 20.0), 0.0, 0.0];
        assert!(failed((0..40).map(through)).is_empty());
        let counts = |k: usize| [(20 - k.min(40) / 2) as f64 * 1e-4, 0.0, 0.0];
        assert!(failed((0..90).map(counts)).is_empty());
    }
}
