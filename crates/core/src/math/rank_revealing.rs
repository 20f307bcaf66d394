//! Inverse of a normal matrix some of whose columns are redundant.

use nalgebra::{DMatrix, DVector};

/// Inverse of a positive semidefinite matrix over the unknowns that it determines, by a Cholesky factor that
/// reveals its rank. Columns are taken in their order: one that depends on those before it is redundant, and
/// its row and column of the inverse are zero.
#[derive(Debug, Clone)]
pub struct RankRevealingInverse {
    matrix: DMatrix<f64>,
    redundant: Vec<bool>,
}

/// Least part of an unknown's squared column that those before it do not explain.
const LEAST_OWN: f64 = 1e-9;

impl RankRevealingInverse {
    pub fn of(normal: &DMatrix<f64>) -> Self {
        let u = normal.nrows();
        let scale: Vec<f64> = (0..u).map(|i| normal[(i, i)].max(0.0).sqrt()).collect();
        // Cholesky factor of the scaled matrix, row by row, without the redundant rows
        let mut factor: DMatrix<f64> = DMatrix::zeros(u, u);
        let mut kept: Vec<usize> = Vec::with_capacity(u);
        for i in (0..u).filter(|i| scale[*i] > 0.0 && scale[*i].is_finite()) {
            let mut own = 1.0;
            for (k, &l) in kept.iter().enumerate() {
                let before: f64 = (0..k).map(|m| factor[(i, m)] * factor[(l, m)]).sum();
                let x = (normal[(i, l)] / (scale[i] * scale[l]) - before) / factor[(l, k)];
                factor[(i, k)] = x;
                own -= x * x;
            }
            if own > LEAST_OWN {
                factor[(i, kept.len())] = own.sqrt();
                kept.push(i);
            }
        }
        let n = kept.len();
        let lower = DMatrix::from_fn(n, n, |a, b| if b <= a { factor[(kept[a], b)] } else { 0.0 });
        let mut matrix = DMatrix::zeros(u, u);
        let mut redundant = vec![true; u];
        if let Some(half) = lower.solve_lower_triangular(&DMatrix::identity(n, n)) {
            let inverse = half.tr_mul(&half);
            for (a, &i) in kept.iter().enumerate() {
                redundant[i] = false;
                for (b, &l) in kept.iter().enumerate() {
                    matrix[(i, l)] = inverse[(a, b)] / (scale[i] * scale[l]);
                }
            }
        }
        RankRevealingInverse { matrix, redundant }
    }

    /// Whether the matrix says nothing of unknown `i` beyond those before it.
    pub fn redundant(&self, i: usize) -> bool {
        self.redundant[i]
    }

    pub fn solve(&self, b: &DVector<f64>) -> DVector<f64> {
        &self.matrix * b
    }

    pub fn times(&self, b: &DMatrix<f64>) -> DMatrix<f64> {
        &self.matrix * b
    }

    pub fn matrix(&self) -> &DMatrix<f64> {
        &self.matrix
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_that_earlier_ones_stand_in_for_is_redundant_and_the_others_are_inverted() {
        // the third column is the first plus twice the second, the fourth is empty
        let x = DMatrix::from_row_slice(
            4,
            5,
            &[
                1.0, 0.2, 1.4, 0.0, 3.0, //
                -1.0, 0.5, 0.0, 0.0, 1.0, //
                2.0, 1.0, 4.0, 0.0, -1.0, //
                0.3, -2.0, -3.7, 0.0, 0.5,
            ],
        );
        let normal = x.tr_mul(&x);
        let inverse = RankRevealingInverse::of(&normal);
        assert_eq!(
            (0..5).map(|i| inverse.redundant(i)).collect::<Vec<_>>(),
            [false, false, true, true, false]
        );
        let kept = [0, 1, 4];
        let small = DMatrix::from_fn(3, 3, |a, b| normal[(kept[a], kept[b])]);
        let wanted = small.try_inverse().unwrap();
        for (a, i) in kept.into_iter().enumerate() {
            for (b, l) in kept.into_iter().enumerate() {
                let off = (inverse.matrix()[(i, l)] - wanted[(a, b)]).abs();
                assert!(off < 1e-12 * wanted[(a, a)].abs().max(1.0), "{i} {l}");
            }
        }
        assert!(inverse.matrix().column(2).iter().all(|x| *x == 0.0));
    }
}
