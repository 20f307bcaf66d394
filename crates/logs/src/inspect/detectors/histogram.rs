//! Quantiles of magnitudes in one pass and fixed memory.

const PER_OCTAVE: usize = 32;
/// Magnitudes below 2^LOWEST count as 0.
const LOWEST: i32 = -70;
const OCTAVES: usize = 120;
/// Mantissa bits that number the bins of an octave.
const SHIFT: u32 = 52 - PER_OCTAVE.trailing_zeros();

/// Counts of magnitudes in bins of 1/32 of an octave, so that a quantile is right to about 1 %.
#[derive(Debug, Clone, Default)]
pub(crate) struct Histogram {
    // Taken when the first number comes: most channels of a wide log have none.
    counts: Vec<u64>,
    sums: Vec<f64>,
    zeros: u64,
    /// How many were counted.
    pub(crate) total: u64,
}

impl Histogram {
    /// Counts the magnitude of a finite number.
    #[inline]
    pub(crate) fn add(&mut self, value: f64) {
        let magnitude = value.abs();
        self.total += 1;
        let lowest = ((1023 + LOWEST) as u64) << 52;
        let Some(above) = magnitude.to_bits().checked_sub(lowest) else {
            self.zeros += 1;
            return;
        };
        if self.counts.is_empty() {
            self.counts.resize(PER_OCTAVE * OCTAVES, 0);
            self.sums.resize(PER_OCTAVE * OCTAVES, 0.0);
        }
        let bin = ((above >> SHIFT) as usize).min(self.counts.len() - 1);
        self.counts[bin] += 1;
        self.sums[bin] += magnitude;
    }

    /// The magnitude that `share` (0..=1) of those counted do not exceed; 0 where there are none.
    pub(crate) fn quantile(&self, share: f64) -> f64 {
        self.at(self.zeros, self.total, share)
    }

    /// The same among those that are not 0.
    pub(crate) fn quantile_not_zero(&self, share: f64) -> f64 {
        self.at(0, self.total - self.zeros, share)
    }

    /// Share of those counted that lie below `low` or above `high`, to the width of a bin.
    pub(crate) fn share_outside(&self, low: f64, high: f64) -> f64 {
        if self.total == 0 {
            return 0.0;
        }
        let bins = self.counts.iter().zip(&self.sums);
        let outside: u64 = bins
            .filter(|(count, sum)| {
                let mean = *sum / (**count).max(1) as f64;
                mean < low || mean > high
            })
            .map(|(count, _)| count)
            .sum();
        (outside + if low > 0.0 { self.zeros } else { 0 }) as f64 / self.total as f64
    }

    /// Mean of those counted between two magnitudes, to the width of a bin at both ends.
    pub(crate) fn mean_within(&self, low: f64, high: f64) -> Option<f64> {
        let bins = self.counts.iter().zip(&self.sums);
        let within = bins.filter(|(count, sum)| {
            let mean = *sum / (**count).max(1) as f64;
            mean >= low && mean <= high
        });
        let [count, sum] = within.fold([0.0; 2], |[n, total], (count, sum)| {
            [n + *count as f64, total + sum]
        });
        (count > 0.0).then(|| sum / count)
    }

    fn at(&self, mut below: u64, total: u64, share: f64) -> f64 {
        let wanted = ((share * total as f64).ceil() as u64).clamp(1, total.max(1));
        if below >= wanted || total == 0 {
            return 0.0;
        }
        for (count, sum) in self.counts.iter().zip(&self.sums) {
            below += count;
            if below >= wanted {
                // The mean of a bin's members is exact where they are all alike.
                return sum / *count as f64;
            }
        }
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_many_sizes_are_right_to_two_percent() {
        let mut histogram = Histogram::default();
        for k in 1..=1000 {
            histogram.add(f64::from(k) * -1e-6);
        }
        for share in [0.05, 0.5, 0.99] {
            let found = histogram.quantile(share);
            let off = found / (share * 1e-3) - 1.0;
            assert!(off.abs() < 0.02, "{share}: {found}");
        }
    }

    #[test]
    fn equal_magnitudes_come_back_exactly_and_zeros_are_kept_apart() {
        let mut histogram = Histogram::default();
        for _ in 0..3 {
            histogram.add(0.001);
            histogram.add(0.0);
        }
        assert_eq!(histogram.quantile(0.5), 0.0);
        assert!((histogram.quantile(0.6) - 0.001).abs() < 1e-18);
        assert!((histogram.quantile_not_zero(0.01) - 0.001).abs() < 1e-18);
        assert_eq!((histogram.total, histogram.zeros), (6, 3));
        assert_eq!(Histogram::default().quantile(0.5), 0.0);
    }
}
