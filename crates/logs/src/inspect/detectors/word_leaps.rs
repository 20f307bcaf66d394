//! Leaps of a power of two, by which words that lost their sign are known.

use crate::log::signed;

/// Bits of numbers that begin anew.
const WIDTHS: [i32; 3] = [8, 16, 32];
/// Bits that drives say a sign with.
const SIGN_BITS: [i32; 4] = [10, 11, 12, 15];
/// Part of a power of two within which a leap is one of it.
const NEAR: f64 = 0.125;

/// Leaps of whole numbers, row after row.
#[derive(Debug, Clone, Default)]
pub(crate) struct WordLeaps {
    last: Option<f64>,
    fractions: bool,
    /// For each of [`WIDTHS`]: leaps that are none between signed numbers, others of that size, numbers in the
    /// middle, where a signed one is large, and leaps among the first that are of a larger power of two.
    anew: [[u64; 4]; WIDTHS.len()],
    /// For each of [`SIGN_BITS`]: leaps by the bit, and leaps of that size at all.
    by_bit: [[u64; 2]; SIGN_BITS.len()],
    /// The greatest number.
    pub(in crate::inspect) most: f64,
}

impl WordLeaps {
    /// Takes the number of a row, as its column has it.
    #[inline]
    pub(crate) fn take(&mut self, number: f64) {
        let count = number.round();
        self.fractions |= (number - count).abs() > 1e-6 * count.abs().max(1.0);
        if self.fractions {
            return;
        }
        self.most = self.most.max(count);
        let leap = self.last.replace(count).map_or(0.0, |last| count - last);
        for (bits, [anew, large, middle, wide]) in WIDTHS.iter().zip(&mut self.anew) {
            let range = 2.0_f64.powi(*bits);
            *middle += u64::from(signed(count, range).abs() > 0.375 * range);
            if leap.abs() > range / 2.0 {
                let small = signed(leap, range).abs() < range / 4.0;
                *(if small { anew } else { large }) += 1;
                *wide += u64::from(small && leap.abs() > 1.5 * range);
            }
        }
        let low = count.min(count - leap);
        for (bits, [exact, large]) in SIGN_BITS.iter().zip(&mut self.by_bit) {
            let bit = 2.0_f64.powi(*bits);
            if leap.abs() > bit / 2.0 {
                let near = |x: f64| (0.0..=NEAR * bit).contains(&x);
                *large += 1;
                *exact += u64::from(near(low) && near(low + leap.abs() - bit));
            }
        }
    }

    /// The range after which the numbers begin anew, where they are signed ones of fewer bits than they are logged with.
    pub(crate) fn range(&self) -> Option<f64> {
        // a word above changes now and then, and a sign most of the time
        let of_width = |[anew, large, middle, wide]: &[u64; 4]| {
            *anew > 0 && *large == 0 && *middle == 0 && 2 * wide <= *anew
        };
        let found = self
            .anew
            .iter()
            .position(of_width)
            .filter(|_| !self.fractions)?;
        Some(2.0_f64.powi(WIDTHS[found]))
    }

    /// The bit that says the sign of what the others are the size of.
    pub(in crate::inspect) fn sign_bit(&self) -> Option<f64> {
        let is = |(bits, [exact, large]): (&i32, &[u64; 2])| {
            let bit = 2.0_f64.powi(*bits);
            (self.most >= bit && self.most < 2.0 * bit && *exact > 0 && 10 * exact >= 9 * large)
                .then_some(bit)
        };
        let mut all = SIGN_BITS.iter().zip(&self.by_bit);
        all.find_map(is).filter(|_| !self.fractions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaps(of: impl Fn(f64) -> f64) -> WordLeaps {
        let mut leaps = WordLeaps::default();
        (0..2000).for_each(|k| leaps.take(of((150.0 * (0.01 * f64::from(k)).sin()).round())));
        leaps
    }

    #[test]
    fn signed_numbers_of_sixteen_bits_are_found_whatever_stands_above_them() {
        let neighbour = |x: f64| 655_360.0 + x.rem_euclid(65_536.0);
        for of in [|x: f64| x.rem_euclid(65_536.0), neighbour] {
            assert_eq!(leaps(of).range(), Some(65_536.0));
        }
        assert_eq!(leaps(|x| x).range(), None);
        assert_eq!(leaps(|x| 0.1 * x.rem_euclid(65_536.0)).range(), None);
        let by_bit = leaps(|x| if x < 0.0 { 1024.0 - x } else { x });
        assert_eq!((by_bit.range(), by_bit.sign_bit()), (None, Some(1024.0)));
        assert_eq!(signed(720_890.0, 65_536.0), -6.0);
        // small numbers leap by multiples of smaller words too
        let small = |x: f64| (0.2 * x).round();
        assert_eq!(
            leaps(|x| small(x).rem_euclid(65_536.0)).range(),
            Some(65_536.0)
        );
        assert_eq!(leaps(|x| small(x).rem_euclid(256.0)).range(), Some(256.0));
        let by_bit = leaps(|x| {
            if small(x) < 0.0 {
                1024.0 - small(x)
            } else {
                small(x)
            }
        });
        assert_eq!((by_bit.range(), by_bit.sign_bit()), (None, Some(1024.0)));
    }
}
