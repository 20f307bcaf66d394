//! Which parameters the data are really about.
//!
//! Parameters leave one by one, that with the largest relative standard deviation first, on the
//! fit's R factor (Khalil and Dombre 2002, section 12.4; Pham and Gautier 1991). What is left, once
//! the largest relative deviation is below ten times the smallest, or once the next one to leave
//! would let the residual grow more than chance does (an F test at 1 %), is essential.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::solution::FitError;
use crate::math::rfactor::RFactor;

/// Ratio of the largest relative standard deviation to the smallest from which on all stay.
const RATIO: f64 = 10.0;
/// A column of which less than this share is its own depends on those before it.
const DEPENDENT: f64 = 1e-8;
/// Level of the F test.
const LEVEL: f64 = 0.01;

/// The essential parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct EssentialParameters {
    /// Per unknown.
    pub essential: Vec<bool>,
    /// Fit of the essential ones alone; the others are 0.
    pub theta: DVector<f64>,
}

/// Chooses the essential unknowns from the R factor of the weighted rows (unknowns, then the
/// target). `rows` is their number, `effective` the effective sample size over it.
///
/// # Errors
/// [`FitError::NothingExcited`] where no column is.
pub fn essential(
    factor: &DMatrix<f64>,
    rows: f64,
    effective: f64,
) -> Result<EssentialParameters, FitError> {
    let u = factor.ncols() - 1;
    // of columns that depend on one another the first stay
    let all: Vec<usize> = (0..u).collect();
    let whole = ReducedFactor::of(factor, &all);
    let own = |c: &usize| whole.r[(*c, *c)].abs() > DEPENDENT * factor.column(*c).norm();
    let mut kept: Vec<usize> = all.iter().copied().filter(own).collect();
    let freedom = (effective * rows - u as f64).max(1.0);
    let whole = ReducedFactor::of(factor, &kept).square;
    // residuals of correlated rows count by their effective sample size
    let variance = whole / freedom;
    let limit = |gone: usize| {
        let law = FisherSnedecor::new(gone as f64, freedom);
        law.map_or(f64::INFINITY, |f| f.inverse_cdf(1.0 - LEVEL))
    };
    let mut gone = 0;
    loop {
        let Some(fit) = ReducedFactor::of(factor, &kept).solved() else {
            return Err(FitError::NothingExcited);
        };
        let (worst, largest) = fit.extreme(|a, b| a > b);
        let (_, smallest) = fit.extreme(|a, b| a < b);
        let stays = |fit: &TrialSolution| {
            let mut theta = DVector::zeros(u);
            let mut essential = vec![false; u];
            for (k, c) in kept.iter().enumerate() {
                theta[*c] = fit.theta[k];
                essential[*c] = true;
            }
            EssentialParameters { essential, theta }
        };
        if kept.len() == 1 || largest < RATIO * smallest {
            return Ok(stays(&fit));
        }
        let mut fewer = kept.clone();
        fewer.remove(worst);
        let square = ReducedFactor::of(factor, &fewer).square;
        let grown = (square - whole) / (gone + 1) as f64;
        if grown > limit(gone + 1) * variance && grown > 1e-12 * square {
            return Ok(stays(&fit));
        }
        gone += 1;
        kept = fewer;
    }
}

/// R factor of some columns, and the square of what they leave.
struct ReducedFactor {
    r: DMatrix<f64>,
    square: f64,
}

/// Parameters of one set of kept columns, with how uncertain they are.
struct TrialSolution {
    theta: DVector<f64>,
    /// Relative standard deviation up to a factor that all share.
    relative: Vec<f64>,
}

impl ReducedFactor {
    fn of(factor: &DMatrix<f64>, kept: &[usize]) -> Self {
        let columns = [kept, &[factor.ncols() - 1]].concat();
        let mut small = RFactor::new(columns.len());
        small.fold(factor.select_columns(&columns).transpose().as_slice());
        let r = small.r();
        let square = r[(kept.len(), kept.len())].powi(2);
        ReducedFactor { r, square }
    }

    /// `None` without a column.
    fn solved(&self) -> Option<TrialSolution> {
        let k = self.r.ncols() - 1;
        if k == 0 {
            return None;
        }
        let square = self.r.view((0, 0), (k, k)).into_owned();
        let right = self.r.view((0, k), (k, 1)).column(0).into_owned();
        let theta = square.solve_upper_triangular(&right)?;
        let inverse = square.solve_upper_triangular(&DMatrix::identity(k, k))?;
        let relative = |i: usize| inverse.row(i).norm() / theta[i].abs();
        let relative = (0..k).map(relative).collect();
        Some(TrialSolution { theta, relative })
    }
}

impl TrialSolution {
    fn extreme(&self, beyond: impl Fn(f64, f64) -> bool) -> (usize, f64) {
        let mut best = (0, self.relative[0]);
        for (i, r) in self.relative.iter().enumerate() {
            if beyond(*r, best.1) {
                best = (i, *r);
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Five columns, the second and fourth without a part in the target, the fifth the sum of the first and third.
    fn factor(noise: f64) -> DMatrix<f64> {
        let mut chance = ChaCha8Rng::seed_from_u64(8);
        let mut draw = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
        let mut all = RFactor::new(6);
        for _ in 0..2000 {
            let (a, b, c, d) = (draw(), draw(), draw(), draw());
            all.fold(&[a, b, c, d, a + c, 3.0 * a - 2.0 * c + noise * draw()]);
        }
        all.r()
    }

    #[test]
    fn parameters_without_a_part_in_the_torque_leave_and_the_others_stay() {
        let found = essential(&factor(0.5), 2000.0, 1.0).unwrap();
        // the last depends on the first and the third
        assert_eq!(found.essential, [true, false, true, false, false]);
    }

    #[test]
    fn what_stays_explains_as_much_as_all_did() {
        let factor = factor(0.5);
        let found = essential(&factor, 2000.0, 1.0).unwrap();
        let left = (factor.column(5) - factor.columns(0, 5) * &found.theta).norm() / 2000f64.sqrt();
        assert!((left - 0.5).abs() < 0.03, "{left}");
    }
}
