//! Long-run covariance of scores that are correlated from block to block.

use nalgebra::{DMatrix, DVector};

/// Sum of the covariances of scores up to `lag` blocks apart, with Bartlett's weights (Newey and West
/// 1987, Econometrica 55), `size x size`. Each score comes with the number of its stretch; pairs that
/// lie in different stretches do not count. A lag between two whole numbers lies between their results, so that
/// nothing jumps where an estimated lag passes one.
pub fn long_run(scores: &[(usize, DVector<f64>)], size: usize, lag: f64) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(size, size);
    let reach = lag.ceil() as usize;
    for (first, (stretch, score)) in scores.iter().enumerate() {
        // half of itself, and its followers: what is missing is the transpose
        let mut followers = score * 0.5;
        let later = scores[first + 1..].iter().take(reach).enumerate();
        for (l, (_, other)) in later.take_while(|(_, other)| other.0 == *stretch) {
            let weight = 1.0 - (l + 1) as f64 / (lag + 1.0);
            followers.axpy(weight, other, 1.0);
        }
        sum.ger(1.0, score, &followers, 1.0);
    }
    &sum + sum.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_count_by_bartlett_s_weights_and_not_across_stretches() {
        let score = |stretch, x| (stretch, DVector::from_element(1, x));
        let scores = [score(0, 1.0), score(0, 2.0), score(1, 3.0)];
        assert_eq!(long_run(&scores, 1, 0.0)[(0, 0)], 14.0);
        // and twice half of 1 x 2; 2 x 3 lie in different stretches
        assert_eq!(long_run(&scores, 1, 1.0)[(0, 0)], 16.0);
    }
}
