//! Residuals that repeat with the motion.
//!
//! Where a motion is driven in periods, the residual of a law that is not quite right comes back in each of them. Ten
//! periods then say no more of the parameters than one, though within a period the residual looks like noise: its
//! correlation at whole periods says how much of it comes back.

use nalgebra::{DMatrix, DVector};

/// When a residual repeats.
struct Limits {
    /// Correlation of the scores at the period, over all parameters, from which on they repeat. Half of it finds periods
    /// in noise, which changes variances by some per cent; twice of it misses what repeats by half.
    correlation: f64,
    /// Share of the greatest correlation from which on a lag counts as a period.
    near: f64,
    /// Least periods of a record.
    periods: usize,
}

const LIMITS: Limits = Limits {
    correlation: 0.25,
    near: 0.9,
    periods: 3,
};

/// Factors of the variances of parameters from the scores of blocks with their stretches; `spread` is the inverse of the
/// normal matrix, and `shortest` the time in blocks over which residuals are correlated anyhow.
pub(super) fn repeats(
    scores: &[(usize, DVector<f64>)],
    spread: &DMatrix<f64>,
    shortest: f64,
) -> Vec<f64> {
    let u = spread.nrows();
    let longest = longest_stretch(scores);
    // what each block moves each parameter by
    let moved: Vec<(usize, DVector<f64>)> = scores
        .iter()
        .map(|(stretch, score)| (*stretch, spread * score))
        .collect();
    let square = products(&moved, 0, u);
    let correlation = |lag: usize| -> (f64, Vec<f64>) {
        let product = products(&moved, lag, u);
        let of = |i: usize| {
            if square[i] > 0.0 {
                product[i] / square[i]
            } else {
                0.0
            }
        };
        let each: Vec<f64> = (0..u).map(of).collect();
        (each.iter().sum::<f64>() / u.max(1) as f64, each)
    };
    let from = (2.0 * shortest).ceil().max(2.0) as usize;
    let most = longest / LIMITS.periods;
    let tried: Vec<(usize, f64)> = (from..=most).map(|lag| (lag, correlation(lag).0)).collect();
    let best = tried.iter().map(|(_, r)| *r).fold(0.0, f64::max);
    // whole multiples of the period correlate as it does
    let first = tried.iter().find(|(_, r)| *r >= LIMITS.near * best);
    let mut factors = vec![1.0; u];
    let Some(&(period, _)) = first.filter(|_| best > LIMITS.correlation) else {
        return factors;
    };
    let count = longest as f64 / period as f64;
    for k in 1..longest / period {
        // a period need not be whole blocks
        let near = (k * period).saturating_sub(k / 2 + 1)..=k * period + k / 2 + 1;
        let peak = near.map(correlation).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, each)) = peak else { continue };
        let weight = 2.0 * (1.0 - k as f64 / count);
        factors
            .iter_mut()
            .zip(&each)
            .for_each(|(f, r)| *f += weight * r);
    }
    factors.iter_mut().for_each(|f| *f = f.max(1.0));
    factors
}

fn longest_stretch(scores: &[(usize, DVector<f64>)]) -> usize {
    let stretches = scores.chunk_by(|a, b| a.0 == b.0);
    stretches.map(<[_]>::len).max().unwrap_or(0)
}

/// Mean product of each component with itself `lag` blocks later in the same stretch.
fn products(moved: &[(usize, DVector<f64>)], lag: usize, u: usize) -> DVector<f64> {
    let mut sum = DVector::zeros(u);
    let mut count = 0.0;
    for (a, b) in moved.iter().zip(moved.iter().skip(lag)) {
        if a.0 == b.0 {
            sum += a.1.component_mul(&b.1);
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { sum }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn factor(mut score: impl FnMut(usize) -> f64) -> f64 {
        let scores: Vec<_> = (0..400)
            .map(|k| (0, DVector::from_element(1, score(k))))
            .collect();
        repeats(&scores, &DMatrix::identity(1, 1), 4.0)[0]
    }

    #[test]
    fn ten_periods_of_a_residual_that_comes_back_are_one() {
        let mut chance = ChaCha8Rng::seed_from_u64(1);
        let period: Vec<f64> = (0..40).map(|_| chance.random_range(-1.0..1.0)).collect();
        let found = factor(|k| period[k % 40]);
        assert!((8.0..=10.5).contains(&found), "{found}");
    }

    #[test]
    fn noise_repeats_nothing() {
        let mut chance = ChaCha8Rng::seed_from_u64(2);
        let found = factor(|_| chance.random_range(-1.0..1.0));
        assert_eq!(found, 1.0);
    }
}
