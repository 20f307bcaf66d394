//! The fit itself: column-normalised least squares (41) on the block factors, weighted by each joint's
//! noise, with rank, condition numbers and a covariance that correlated residuals do not break.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Serialize;

use super::accumulate::{BlockFactors, JointRows, RelativeResidual};
use super::covariance::{FitCovariances, covariance};
use super::solution::{
    ConditionNumbers, ConfoundedUnknowns, FitError, FitInputs, WeightedSolution, conditions,
    joints, residual_std, solve, stacked,
};

/// Which rows count how much.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "Weighting")]
pub enum RowWeighting {
    /// Rows weighted by each joint's residual of an ordinary fit (two steps).
    #[default]
    Wls,
    /// Eq. (41) as it stands.
    Ols,
}

/// Result of the fit, unknowns in the order of `RegressorColumns`.
#[derive(Debug, Clone)]
pub struct Fit {
    pub theta: DVector<f64>,
    /// Covariance of theta: correlated residuals and the known friction's own covariance.
    pub covariance: DMatrix<f64>,
    /// Textbook covariance, for the comparison only.
    pub textbook: DMatrix<f64>,
    /// d theta / d(known friction parameters) per joint, unknowns x 5.
    pub friction_sensitivity: Vec<Option<DMatrix<f64>>>,
    /// False where the unknown has a part in a combination that the data leave open.
    pub determined: Vec<bool>,
    pub confounded: Vec<ConfoundedUnknowns>,
    pub condition: ConditionNumbers,
    pub rank: usize,
    /// Standard deviation of each joint's residual [N or Nm], filtered.
    pub residual_std: Vec<f64>,
    /// Relative residual per joint.
    pub relative_error: Vec<RelativeResidual>,
    /// Root mean square of the filtered torque per joint.
    pub torque_rms: Vec<f64>,
    /// Root mean square of each unknown's column per joint, joints x unknowns.
    pub column_rms: DMatrix<f64>,
    /// Rows of a joint that are fitted, on average over the joints.
    pub rows: u64,
    /// Rows that independent residuals of the same certainty would number.
    pub effective_rows: f64,
}

/// Fits all unknowns of the block factors.
///
/// # Errors
/// [`FitError`].
pub fn fit(factors: &BlockFactors, estimator: RowWeighting) -> Result<Fit, FitError> {
    let joints = joints(factors)?;
    let weights = match estimator {
        RowWeighting::Wls => settled_weights(factors, &joints)?,
        RowWeighting::Ols => vec![1.0; factors.columns.joints],
    };
    let inputs = FitInputs::weighted(&weights, None);
    finish(factors, &joints, inputs)
}

/// The unknowns of a weighted fit and their covariance, and nothing of what its columns are like.
pub(super) fn weighted_unknowns(
    factors: &BlockFactors,
) -> Result<(DVector<f64>, DMatrix<f64>), FitError> {
    let joints = joints(factors)?;
    let weights = settled_weights(factors, &joints)?;
    let found = SolvedRows::new(factors, &joints, FitInputs::weighted(&weights, None))?;
    Ok((found.solution.theta, found.covariances.total))
}

/// Weight of each joint's rows by the noise of the step before; two steps settle it.
fn settled_weights(factors: &BlockFactors, joints: &[DMatrix<f64>]) -> Result<Vec<f64>, FitError> {
    let mut weights = vec![1.0; factors.columns.joints];
    for _ in 0..2 {
        let theta = solve(factors, joints, &weights, None)?.theta;
        weights = weights_of(factors, &residual_std(factors, joints, &theta));
    }
    Ok(weights)
}

/// Fits all unknowns of the block factors with weights and prior given.
pub(super) fn fit_with(factors: &BlockFactors, inputs: FitInputs) -> Result<Fit, FitError> {
    finish(factors, &joints(factors)?, inputs)
}

/// Weight of each joint's rows from the standard deviation of its residual [N or Nm].
pub fn weights_of(factors: &BlockFactors, residual: &[f64]) -> Vec<f64> {
    let of = |(s, t): (&f64, &JointRows)| {
        let floor = 1e-9 * t.torque_rms();
        match s.max(floor) {
            0.0 => 0.0,
            s => 1.0 / s,
        }
    };
    residual.iter().zip(&factors.moving).map(of).collect()
}

/// Lowest weighted sum of squares that any values of the unknowns reach, prior included.
pub(super) fn least_square(factors: &BlockFactors, inputs: FitInputs) -> Result<f64, FitError> {
    let r = stacked(factors, &joints(factors)?, inputs.weights, inputs.prior);
    let u = r.ncols() - 1;
    Ok(r[(u, u)] * r[(u, u)])
}

/// R factor of all joints' rows, unknowns and target, each joint times its weight.
///
/// # Errors
/// [`FitError::TooFewRows`].
pub fn factor(factors: &BlockFactors, weights: &[f64]) -> Result<DMatrix<f64>, FitError> {
    Ok(stacked(factors, &joints(factors)?, weights, None))
}

/// Residual of each joint under other values of the unknowns [N or Nm].
pub fn residual_of(factors: &BlockFactors, theta: &DVector<f64>) -> Result<Vec<f64>, FitError> {
    Ok(residual_std(factors, &joints(factors)?, theta))
}

/// The solution of weighted rows, what it leaves of each joint, and how sure it is.
struct SolvedRows {
    solution: WeightedSolution,
    /// Standard deviation of each joint's residual [N or Nm].
    residual: Vec<f64>,
    covariances: FitCovariances,
}

impl SolvedRows {
    fn new(
        factors: &BlockFactors,
        joints: &[DMatrix<f64>],
        inputs: FitInputs,
    ) -> Result<Self, FitError> {
        let mut solution = solve(factors, joints, inputs.weights, inputs.prior)?;
        let residual = residual_std(factors, joints, &solution.theta);
        if let Some(slope) = inputs.slope {
            let bread = inputs.weights.iter().zip(slope);
            let bread: Vec<f64> = bread.map(|(w, s)| w * s.sqrt()).collect();
            solution.inverse = solve(factors, joints, &bread, inputs.prior)?.inverse;
        }
        Ok(Self {
            covariances: covariance(factors, joints, &solution, inputs, &residual),
            solution,
            residual,
        })
    }
}

fn finish(
    factors: &BlockFactors,
    joints: &[DMatrix<f64>],
    inputs: FitInputs,
) -> Result<Fit, FitError> {
    let columns = &factors.columns;
    let (n, u) = (columns.joints, columns.unknowns());
    let whole = stacked(factors, joints, &vec![1.0; n], None);
    let (condition, rank) = conditions(&whole.columns(0, u).into_owned())?;
    let SolvedRows {
        solution,
        residual,
        covariances,
    } = SolvedRows::new(factors, joints, inputs)?;
    let rows = factors.rows_per_joint();
    let error = |j: usize| {
        let moving = residual[j].powi(2) * factors.moving[j].count as f64;
        factors.relative_residual(j, [moving, factors.square_at_rest(&solution.theta, j)])
    };
    let relative_error = (0..n).map(error).collect();
    let mut column_rms = DMatrix::zeros(n, u);
    for (j, r) in joints.iter().enumerate() {
        let of_joint = factors.moving[j].count.max(1) as f64;
        for c in 0..columns.unknowns_of(j) {
            column_rms[(j, columns.unknown(j, c))] = r.column(c).norm() / of_joint.sqrt();
        }
    }
    let FitCovariances {
        sandwich, textbook, ..
    } = &covariances;
    let sure = (0..u).filter(|&i| solution.determined[i] && sandwich[(i, i)] > 0.0);
    let effective: Vec<f64> = sure.map(|i| textbook[(i, i)] / sandwich[(i, i)]).collect();
    let effective_rows = match effective.len() {
        0 => rows,
        n => (rows * effective.iter().sum::<f64>() / n as f64).min(rows),
    };
    Ok(Fit {
        theta: solution.theta,
        covariance: covariances.total,
        textbook: covariances.textbook,
        friction_sensitivity: covariances.sensitivity,
        determined: solution.determined,
        confounded: solution.confounded,
        condition,
        rank,
        residual_std: residual,
        relative_error,
        torque_rms: factors.moving.iter().map(JointRows::torque_rms).collect(),
        column_rms,
        rows: rows.round() as u64,
        effective_rows,
    })
}

#[cfg(test)]
mod tests {
    use super::super::BLOCK_SECONDS;
    use super::super::columns::{JointTerm, KnownFriction, RegressorColumns};
    use super::*;
    use crate::robot::friction::DoubleTanh;

    /// Chance that needs no crate: uniform in (-1, 1).
    struct Chance(u64);
    impl Chance {
        fn next(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    fn viscous_and_coulomb() -> RegressorColumns {
        RegressorColumns::of_one(&[JointTerm::Viscous, JointTerm::Coulomb], None)
    }

    /// Speed, acceleration and force of a joint with inertia 3 and a friction, and noise of a correlation.
    fn rows(
        friction: impl Fn(f64) -> f64,
        count: usize,
        [noise, correlation]: [f64; 2],
        seed: u64,
    ) -> impl Iterator<Item = [f64; 3]> {
        let (mut chance, mut e) = (Chance(seed * 2 + 12345), 0.0);
        (0..count).map(move |k| {
            let t = k as f64 * 0.01;
            let (v, a) = ((0.9 * t).sin() + 0.4 * (2.3 * t).cos(), chance.next());
            e = correlation * e + (1.0 - correlation * correlation).sqrt() * noise * chance.next();
            [v, a, 3.0 * a + friction(v) + e]
        })
    }

    /// Those of Fv 2 and Fc 0.7 in blocks.
    fn in_blocks(block: f64, count: usize, noise: [f64; 2], seed: u64) -> BlockFactors {
        let friction = |v: f64| 2.0 * v + 0.7 * v.signum();
        viscous_and_coulomb().rows_of_one(block, rows(friction, count, noise, seed))
    }

    fn factors(count: usize, noise: [f64; 2], seed: u64) -> BlockFactors {
        in_blocks(BLOCK_SECONDS, count, noise, seed)
    }

    #[test]
    fn exact_rows_give_the_exact_parameters() {
        let fit = fit(&factors(3000, [0.0; 2], 1), RowWeighting::Ols).unwrap();
        for (found, truth) in fit.theta.iter().zip([3.0, 2.0, 0.7]) {
            assert!((found - truth).abs() < 1e-12, "{found} {truth}");
        }
        assert_eq!(fit.rank, 3);
        assert!(fit.relative_error[0].all < 1e-13);
    }

    #[test]
    fn blocks_that_merge_change_neither_fit_nor_score() {
        let many = factors(60_000, [0.1, 0.9], 2);
        assert!(many.blocks.len() <= 512);
        assert_eq!(many.blocks.iter().map(|b| b.rows).sum::<u64>(), 60_000);
        let halved = fit(&many, RowWeighting::Ols).unwrap();
        let whole = fit(&in_blocks(1e9, 60_000, [0.1, 0.9], 2), RowWeighting::Ols).unwrap();
        assert!((&halved.theta - &whole.theta).amax() < 1e-12);
        let mut merged = many.clone();
        merged.merge(factors(500, [0.1, 0.9], 3));
        assert_eq!(merged.rows, 60_500);
        // of two logs the second begins a stretch of its own
        assert!(merged.blocks.last().unwrap().stretch > many.blocks.last().unwrap().stretch);
    }

    #[test]
    fn intervals_cover_under_white_and_under_correlated_residuals() {
        for correlation in [0.0, 0.95] {
            let (mut covered, mut textbook, runs) = ([0; 3], [0; 3], 200);
            for seed in 0..runs {
                let s = factors(4000, [0.3, correlation], 10 + seed);
                let fit = fit(&s, RowWeighting::Wls).unwrap();
                for (i, truth) in [3.0, 2.0, 0.7].into_iter().enumerate() {
                    let off = (fit.theta[i] - truth).abs();
                    covered[i] += u64::from(off < 1.96 * fit.covariance[(i, i)].sqrt());
                    textbook[i] += u64::from(off < 1.96 * fit.textbook[(i, i)].sqrt());
                }
            }
            for (i, n) in covered.iter().enumerate() {
                // 200 draws of 0.95 stay above 178 in 99.9 % of all tests; 40 correlated seconds
                // leave a few per cent to the asymptotics
                let least = if correlation > 0.0 { 170 } else { 178 };
                assert!(*n >= least, "correlation {correlation}, unknown {i}: {n}");
            }
            if correlation > 0.0 {
                // the count of rows as if they were independent does not cover: friction's
                // columns change as slowly as the residual
                assert!(textbook[2] < 120, "{textbook:?}");
            }
        }
    }

    #[test]
    fn columns_that_the_motion_cannot_part_are_named_and_not_numbered() {
        let columns = RegressorColumns::of_one(
            &[JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset],
            None,
        );
        let mut chance = Chance(99);
        let rows = (0..2000).map(|_| {
            // always forward: Coulomb friction and offset are one column
            let (v, a) = (1.0 + 0.5 * chance.next(), chance.next());
            [v, a, 3.0 * a + 2.0 * v + 0.7]
        });
        let fit = fit(&columns.rows_of_one(BLOCK_SECONDS, rows), RowWeighting::Wls).unwrap();
        assert_eq!(fit.rank, 3);
        assert_eq!(fit.determined, [true, true, false, false]);
        assert_eq!(fit.condition.raw, None);
        assert_eq!(fit.confounded.len(), 1);
        let mut named: Vec<usize> = fit.confounded[0].terms.iter().map(|t| t.0).collect();
        named.sort_unstable();
        assert_eq!(named, [2, 3]);
        assert!((fit.theta[0] - 3.0).abs() < 1e-9);
    }

    #[test]
    fn the_known_friction_s_uncertainty_reaches_the_inertia() {
        let law = DoubleTanh::from_parameters([2.0, 0.7, -0.2, 40.0, 5.0]);
        let mut covariance = [[0.0; 5]; 5];
        for (i, row) in covariance.iter_mut().enumerate() {
            row[i] = (0.05 * law.parameters()[i]).powi(2);
        }
        // the torque of this law, read with another one
        let read = |as_law: DoubleTanh| {
            let known = KnownFriction {
                law: as_law,
                covariance,
                held: [false; 5],
            };
            let rows = rows(|v| law.torque(v), 3000, [0.0; 2], 4);
            let rows = RegressorColumns::of_one(&[], Some(known)).rows_of_one(BLOCK_SECONDS, rows);
            fit(&rows, RowWeighting::Ols).unwrap()
        };
        let base = read(law);
        let s = base.friction_sensitivity[0].clone().unwrap();
        for k in 0..5 {
            let mut p = law.parameters();
            let step = 1e-5 * p[k].abs();
            p[k] += step;
            let moved = read(DoubleTanh::from_parameters(p));
            let difference = (moved.theta[0] - base.theta[0]) / step;
            let off = (difference - s[(0, k)]).abs();
            assert!(
                off < 1e-3 * s[(0, k)].abs().max(1e-6),
                "{k}: {difference} {s}"
            );
        }
        let variance: f64 = (0..5)
            .map(|k| (s[(0, k)] * 0.05 * law.parameters()[k]).powi(2))
            .sum();
        assert!((base.covariance[(0, 0)] / variance - 1.0).abs() < 1e-6);
    }
}
