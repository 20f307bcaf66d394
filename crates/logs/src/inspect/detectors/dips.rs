//! How a size comes down to zero and up again: in an edge where a signed number passed through zero, rounded where a
//! number turned back.

/// Heights of a dip that are near zero, over the greatest size so far.
const DOWN_TO_ZERO: f64 = 0.02;

/// Dips of the sizes of numbers that follow one another.
#[derive(Debug, Clone, Default)]
pub(crate) struct ZeroDips {
    last: [f64; 4],
    rows: usize,
    most: f64,
    /// Dips near zero at which the numbers go on as they came.
    rounded: u64,
    /// Dips near zero at which they would go on as they came with the other sign.
    edged: u64,
}

/// Part of the greatest size by which sums of numbers are off.
const EXACT: f64 = 1e-12;
/// Dips by which a sign is known to be lost. Half: one that grazes zero is taken for it; twice: slow motions are passed
/// over.
const MIN_DIPS: u64 = 4;
/// Edged dips for each rounded one.
const MIN_RATIO: u64 = 3;

impl ZeroDips {
    pub(crate) fn take(&mut self, value: f64) {
        let size = value.abs();
        let [far, before, a, b] = self.last;
        // a number that is held is one
        if self.rows > 0 && size == b {
            return;
        }
        self.most = self.most.max(size);
        self.rows += 1;
        self.last = [before, a, b, size];
        if self.rows < 5 || b >= a || b >= size || b > DOWN_TO_ZERO * self.most {
            return;
        }
        // between two rows zero is nearer to one of them than half of the way
        if b > 0.5 * (a.max(size) - b) {
            return;
        }
        // the parabola through the three before either number goes on below zero, or turns back with the numbers
        let next = [3.0 * a - 3.0 * before + far, 3.0 * b - 3.0 * a + before];
        let edged = next.iter().any(|next| *next < -EXACT * self.most);
        self.edged += u64::from(edged);
        self.rounded += u64::from(!edged);
    }

    /// Whether the numbers have lost their sign.
    pub(crate) fn lost_their_sign(&self) -> bool {
        self.edged >= MIN_DIPS && self.edged >= MIN_RATIO * self.rounded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lost(of: impl Fn(f64) -> f64) -> bool {
        let mut dips = ZeroDips::default();
        (0..2000).for_each(|k| dips.take(of(0.004 * f64::from(k))));
        dips.lost_their_sign()
    }

    #[test]
    fn sizes_of_signed_numbers_are_told_from_numbers_that_stay_on_one_side() {
        let torque = |t: f64| 3.0 * (4.1 * t).sin() + (9.3 * t).cos();
        let coulomb = |t: f64| torque(t) + (4.1 * t).cos().signum();
        assert!(lost(|t| torque(t).abs()) && lost(|t| coulomb(t).abs()));
        assert!(lost(|t| (100.0 * coulomb(t).abs()).round()));
        // a load that is let down to nothing again and again
        for least in [0.0, 0.001, 0.02] {
            assert!(!lost(|t| 2.0 + least - 2.0 * (4.1 * t).sin()), "{least}");
        }
        assert!(!lost(|t| 5.0 + torque(t)));
        // noise close above zero
        let noise = |t: f64| ((t * 1e4).sin() * 1e4).fract().abs();
        assert!(!lost(|t| 0.02 + 0.05 * noise(t) + (0.4 * t).sin().powi(2)));
    }
}
