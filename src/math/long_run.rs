//! Long-run covariance of scores that are correlated from block to block.

use nalgebra::{DMatrix, DVector};

/// Sum of the covariances of scores up to `lag` blocks apart, with Bartlett's weights (Newey and West
/// 1987, Econometrica 55), `size x size`. Each score comes with the number of its stretch; pairs that
/// lie in different stretches do not count.
pub fn long_run(scores: &[(usize, DVector<f64>)], size: usize, lag: usize) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(size, size);
    for l in 0..=lag {
        let weight = 1.0 - l as f64 / (lag + 1) as f64;
        for pair in scores.windows(l + 1) {
            let (first, last) = (&pair[0], &pair[l]);
            if first.0 != last.0 {
                continue;
            }
            if l == 0 {
                sum.ger(1.0, &first.1, &first.1, 1.0);
            } else {
                sum.ger(weight, &first.1, &last.1, 1.0);
                sum.ger(weight, &last.1, &first.1, 1.0);
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_count_by_bartlett_s_weights_and_not_across_stretches() {
        let score = |stretch, x| (stretch, DVector::from_element(1, x));
        let scores = [score(0, 1.0), score(0, 2.0), score(1, 3.0)];
        assert_eq!(long_run(&scores, 1, 0)[(0, 0)], 14.0);
        // and twice half of 1 x 2; 2 x 3 lie in different stretches
        assert_eq!(long_run(&scores, 1, 1)[(0, 0)], 16.0);
    }
}
