//! When numbers that were fitted are no chance: their deviation by the jackknife, and how far beyond it they stand.
//!
//! With x the fit to all rows and x_b that without block b of n: V = (n - 1)/n sum_b (x_b - x)(x_b - x)' (Tukey
//! 1958), and F = a' V^-1 a / k of the k numbers a that are asked about (Hotelling 1931).

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

use super::NUMBERS;

/// Covariance of estimates by the jackknife; one vector of `left_out` per block.
pub fn jackknife(all: &DVector<f64>, left_out: &[DVector<f64>]) -> DMatrix<f64> {
    let n = left_out.len() as f64;
    let mut sum = DMatrix::zeros(all.len(), all.len());
    for without in left_out {
        let off = without - all;
        sum.ger(1.0, &off, &off, 1.0);
    }
    sum * ((n - 1.0) / n.max(1.0))
}

/// Half width of a 95 % interval in standard deviations, where a deviation rests on `blocks` blocks.
pub fn width_95(blocks: usize) -> f64 {
    let freedom = blocks.saturating_sub(1).max(1) as f64;
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
}

/// The F that `k` numbers whose deviation rests on `n` blocks must exceed: as rare by chance as
/// [`NUMBERS`]`.deviations` of one number by [`NUMBERS`]`.blocks`. Infinite where the blocks are too few.
pub fn hotelling_floor(k: usize, n: usize) -> f64 {
    let (Some(rest), true) = (n.checked_sub(k).filter(|rest| *rest > 0), k > 0) else {
        return f64::INFINITY;
    };
    let usual = FisherSnedecor::new(1.0, NUMBERS.blocks as f64 - 1.0);
    let rarity = usual.map(|f| f.sf(NUMBERS.deviations.powi(2)));
    let law = FisherSnedecor::new(k as f64, rest as f64);
    match (rarity, law) {
        (Ok(rarity), Ok(law)) => (n - 1) as f64 / rest as f64 * law.inverse_cdf(1.0 - rarity),
        _ => f64::INFINITY,
    }
}

/// F = a' V^-1 a / k; 0 where V has no inverse.
pub fn hotelling(a: &DVector<f64>, v: &DMatrix<f64>) -> f64 {
    // numbers of different units: each by its own deviation
    let scale = v.diagonal().map(|x| x.sqrt());
    if scale.iter().any(|s| *s <= 0.0 || !s.is_finite()) {
        return 0.0;
    }
    let scaled = DMatrix::from_fn(a.len(), a.len(), |i, j| v[(i, j)] / (scale[i] * scale[j]));
    let a = a.component_div(&scale);
    let solved = scaled.cholesky().map(|factor| factor.solve(&a));
    solved.map_or(0.0, |x| a.dot(&x) / a.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_by_24_blocks_needs_five_deviations_and_more_numbers_are_as_rare() {
        let shown = |k, n| hotelling_floor(k, n).round();
        assert_eq!([1, 2, 3, 4].map(|k| shown(k, 24)), [25.0, 17.0, 14.0, 13.0]);
        assert_eq!([1, 2, 3, 4].map(|k| shown(k, 12)), [42.0, 35.0, 38.0, 46.0]);
        assert!(hotelling_floor(24, 24).is_infinite() && hotelling_floor(0, 24).is_infinite());
    }

    #[test]
    fn the_jackknife_of_a_mean_is_the_deviation_of_the_mean() {
        let x = [1.0, 4.0, 2.0, 7.0, 3.0];
        let mean = x.iter().sum::<f64>() / 5.0;
        let without = |k: usize| (5.0 * mean - x[k]) / 4.0;
        let left: Vec<_> = (0..5)
            .map(|k| DVector::from_element(1, without(k)))
            .collect();
        let v = jackknife(&DVector::from_element(1, mean), &left)[(0, 0)];
        let expected = x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 20.0;
        assert!((v - expected).abs() < 1e-12);
    }
}
