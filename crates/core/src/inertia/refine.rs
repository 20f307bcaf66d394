//! All parameters at once, the friction law's slopes among them: least torque prediction error.
//!
//! The model tau = Y theta + F(v; phi) is linear in theta and not in phi, the parameters of law
//! (18). Each pass over the logs gives, at the present phi, the R factor of [Y, dF/dphi, tau - F]:
//! a Gauss-Newton step is a linear fit on it, damped as Levenberg (1944) and Marquardt (1963) do,
//! and the next pass says whether the step was good. theta is solved anew in each, so that only phi
//! is searched (variable projection: Golub and Pereyra 1973). The friction that was known before
//! enters with its covariance, as rows of unit noise.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::accumulate::{BlockFactors, RelativeResidual};
use super::columns::{GRADIENT, JointTerm, KnownFriction, RegressorColumns};
use super::solution::{FitError, FitInputs, PriorRows};
use super::solve::{Fit, RowWeighting, fit, fit_with, least_square, weights_of};
use crate::math::descent::{IterationEnding, StepControl, Trial, descend};
use crate::math::rank;
use crate::robot::friction::DoubleTanh;

/// A step of less than this share of the cost is the last: far less than one independent row is worth.
const SETTLED: f64 = 1e-6;
/// Most passes over the logs.
const MAX_PASSES: usize = 40;
/// Damping of the steps.
const DAMPING: StepControl = StepControl::damping(10.0, 10.0, [1e-9, 1e6]);
/// A slope may change by this factor in one step.
const FARTHEST: f64 = 4.0;
/// No slope is steeper than this over the rms speed: tanh is a sign there.
const STEEPEST: f64 = 1e4;

/// A friction that was known is contradicted where chance moves it that far less often: three deviations. Half of it in
/// deviations: one right file in eight; twice: a law that bends is held to where its slow logs put it.
const CONTRADICTED: f64 = 0.0027;

/// A refined fit.
#[derive(Debug, Clone)]
pub struct RefinedFit {
    /// The columns with the friction as it was refined; its covariance is that of before.
    pub columns: RegressorColumns,
    /// All unknowns in the order of [`RegressorColumns::with_free_friction`].
    pub fit: Fit,
    pub ending: IterationEnding,
    /// Passes over the logs.
    pub iterations: usize,
    /// Relative residual per joint before the refinement.
    pub before: Vec<RelativeResidual>,
    /// The rows of the last pass, the laws' changes among the unknowns.
    pub factors: BlockFactors,
    weights: Vec<f64>,
    prior: Option<PriorRows>,
}

impl RefinedFit {
    /// The fit of other block factors of [`Self::columns`], linear about the refined friction.
    ///
    /// # Errors
    /// [`FitError`].
    pub fn solve(&self, factors: BlockFactors) -> Result<Fit, FitError> {
        let factors = factors.with_free_friction();
        let inputs = FitInputs::weighted(&self.weights, self.prior.as_ref());
        let mut fit = fit_with(&factors, inputs)?;
        add_laws(&self.columns, &mut fit.theta);
        Ok(fit)
    }

    /// The fit of all but the laws, as they were refined, and the rows that it is about.
    ///
    /// # Errors
    /// [`FitError`].
    pub fn without_laws(&self) -> Result<(Fit, BlockFactors), FitError> {
        let rows = without_law(&self.factors);
        Ok((fit(&rows, RowWeighting::Wls)?, rows.in_one_block()))
    }

    /// Joints whose friction the rows move further from where `before` knew it than [`CONTRADICTED`].
    ///
    /// # Errors
    /// [`FitError`].
    pub fn contradicted(&self, before: &RegressorColumns) -> Result<Vec<usize>, FitError> {
        let mut joints = Vec::new();
        for (j, (known, now)) in before.known.iter().zip(&self.columns.known).enumerate() {
            let (Some(known), Some(now)) = (known, now) else {
                continue;
            };
            let [now, old] = [now, known].map(|known| known.law.parameters());
            let directions = whitened(known)?;
            let off = |row: &[f64; GRADIENT]| -> f64 {
                (0..GRADIENT).map(|k| row[k] * (now[k] - old[k])).sum()
            };
            let square: f64 = directions.iter().map(|row| off(row).powi(2)).sum();
            if square > 0.0 && chance(directions.len(), square) < CONTRADICTED {
                joints.push(j);
            }
        }
        Ok(joints)
    }

    /// What the unknowns of [`Self::factors`] lack to those of [`Self::fit`]: the laws as they stand.
    pub fn shift(&self) -> DVector<f64> {
        let mut shift = DVector::zeros(self.fit.theta.len());
        add_laws(&self.columns, &mut shift);
        shift
    }
}

/// Adds the laws' parameters to their changes.
fn add_laws(columns: &RegressorColumns, theta: &mut DVector<f64>) {
    let free = columns.with_free_friction();
    for (j, known) in columns.known.iter().enumerate() {
        if let Some(known) = known {
            let p = known.law.parameters();
            free.law_unknowns(j).for_each(|(i, k)| theta[i] += p[k]);
        }
    }
}

/// How often chance gives as large a sum of so many squares.
fn chance(freedom: usize, square: f64) -> f64 {
    ChiSquared::new(freedom as f64).map_or(1.0, |of| of.sf(square))
}

/// A row of L (phi - phi_0) for each direction that the covariance of a known friction holds, L'L its inverse.
fn whitened(known: &KnownFriction) -> Result<Vec<[f64; GRADIENT]>, FitError> {
    let size: [f64; GRADIENT] = std::array::from_fn(|k| known.covariance[k][k].max(0.0).sqrt());
    // correlations, so that parameters of all units compare
    let scaled = DMatrix::from_fn(GRADIENT, GRADIENT, |a, b| match size[a] * size[b] {
        s if s > 0.0 => known.covariance[a][b] / s,
        _ => 0.0,
    });
    let svd = rank::svd(&scaled)?;
    let row = |(i, s): (usize, &f64)| {
        std::array::from_fn(|k| match size[k] > 0.0 {
            true => svd.v[(k, i)] / (size[k] * s.sqrt()),
            false => 0.0,
        })
    };
    let held = svd.s.iter().enumerate().filter(|(_, s)| **s > 1e-10);
    Ok(held.map(row).collect())
}

/// Rows of the friction that was known before, times root `strength`.
fn prior(
    before: &RegressorColumns,
    now: &RegressorColumns,
    strength: f64,
) -> Result<Option<PriorRows>, FitError> {
    let free = now.with_free_friction();
    let u = free.unknowns();
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (j, known) in before.known.iter().enumerate() {
        let (Some(known), Some(present)) = (known, &now.known[j]) else {
            continue;
        };
        let [now, before] = [present, known].map(|known| known.law.parameters());
        for direction in whitened(known)? {
            let mut row = vec![0.0; u + 1];
            for (at, k) in free.law_unknowns(j) {
                row[at] = strength.sqrt() * direction[k];
                row[u] += row[at] * (before[k] - now[k]);
            }
            rows.push(row);
        }
    }
    Ok((!rows.is_empty()).then(|| PriorRows {
        rows: DMatrix::from_fn(rows.len(), u + 1, |r, c| rows[r][c]),
        variance: strength,
    }))
}

/// Rows that keep the law's parameters where they are: `damping` parts of their own columns.
fn damped(
    factors: &BlockFactors,
    weights: &[f64],
    prior: Option<&PriorRows>,
    damping: f64,
) -> PriorRows {
    let u = factors.columns.unknowns();
    let mut rows = prior.map_or(DMatrix::zeros(0, u + 1), |p| p.rows.clone());
    for (j, own) in factors.columns.own.iter().enumerate() {
        let r = factors.joint(j);
        let of_law = own.iter().enumerate();
        for (k, _) in of_law.filter(|(_, own)| matches!(own, JointTerm::Law(_))) {
            let size = weights[j] * r.column(factors.columns.shared + k).norm();
            let at = rows.nrows();
            rows = rows.insert_row(at, 0.0);
            rows[(at, factors.columns.first_own(j) + k)] = damping.sqrt() * size;
        }
    }
    PriorRows {
        rows,
        variance: 1.0,
    }
}

/// The rows without the terms of laws.
fn without_law(factors: &BlockFactors) -> BlockFactors {
    let linear = |own: &JointTerm| !matches!(own, JointTerm::Law(_));
    factors.with_own(&factors.columns.places(linear))
}

/// Least cost that the linear parameters reach with the law as it stands.
fn cost(
    factors: &BlockFactors,
    weights: &[f64],
    prior: Option<&PriorRows>,
) -> Result<f64, FitError> {
    let u = factors.columns.unknowns();
    let inputs = FitInputs::weighted(weights, None);
    let known = prior.map_or(0.0, |p| p.rows.column(u).norm_squared());
    Ok(least_square(&without_law(factors), inputs)? + known)
}

/// A point of the descent: the friction, the rows about it, and the least cost there.
struct DescentPoint {
    columns: RegressorColumns,
    /// The laws' changes are among the unknowns.
    factors: BlockFactors,
    known: Option<PriorRows>,
    weights: Vec<f64>,
    cost: f64,
}

impl DescentPoint {
    fn of(
        columns: RegressorColumns,
        factors: BlockFactors,
        known: Option<PriorRows>,
        linear: &Fit,
    ) -> Result<Self, FitError> {
        let weights = weights_of(&factors, &linear.residual_std);
        Ok(DescentPoint {
            cost: cost(&factors, &weights, known.as_ref())?,
            columns,
            factors,
            known,
            weights,
        })
    }

    /// The damped step; none where it promises nothing.
    fn step(&self, damping: f64) -> Result<Option<DVector<f64>>, FitError> {
        let damped_rows = damped(&self.factors, &self.weights, self.known.as_ref(), damping);
        let inputs = FitInputs::weighted(&self.weights, Some(&damped_rows));
        let promised = self.cost - least_square(&self.factors, inputs)?;
        // a cost of one a row is one of the noise: far below it there is none
        if promised <= SETTLED * self.cost || self.cost <= 1e-6 * self.factors.rows as f64 {
            return Ok(None);
        }
        Ok(Some(fit_with(&self.factors, inputs)?.theta))
    }

    /// The fit here: values of the last step that was taken, the covariance of the fit about them.
    fn fit(&self) -> Result<Fit, FitError> {
        let (linear, all) = (&self.columns, &self.factors.columns);
        let inputs = FitInputs::weighted(&self.weights, self.known.as_ref());
        let mut fit = fit_with(&self.factors, inputs)?;
        let found = linear_fit(&self.factors)?;
        fit.theta.fill(0.0);
        for j in 0..linear.joints {
            for c in 0..linear.unknowns_of(j) {
                fit.theta[all.unknown(j, c)] = found.theta[linear.unknown(j, c)];
            }
        }
        add_laws(linear, &mut fit.theta);
        fit.residual_std = found.residual_std;
        fit.relative_error = found.relative_error;
        Ok(fit)
    }
}

/// The fit of all but the laws.
fn linear_fit(factors: &BlockFactors) -> Result<Fit, FitError> {
    fit(&without_law(factors), RowWeighting::Wls)
}

/// Rms speed of each joint that has a law; 0 of the others.
fn speeds(factors: &BlockFactors) -> Vec<f64> {
    let place = |own: &Vec<JointTerm>| own.iter().position(|o| *o == JointTerm::Law(0));
    let speed = |(j, own): (usize, &Vec<JointTerm>)| match place(own) {
        Some(k) => {
            let column = factors.columns.shared + k;
            factors.joint(j).column(column).norm() / (factors.moving[j].count.max(1) as f64).sqrt()
        }
        None => 0.0,
    };
    factors.columns.own.iter().enumerate().map(speed).collect()
}

/// Fits all parameters, from the friction in `start` and drawn to it by its covariance. `pass`
/// reads the logs once.
///
/// # Errors
/// Those of `pass`, and [`FitError`].
pub fn refine<E: From<FitError>>(
    start: RegressorColumns,
    pass: &mut dyn FnMut(&RegressorColumns) -> Result<BlockFactors, E>,
) -> Result<RefinedFit, E> {
    let columns = sorted(start.clone());
    let factors = pass(&columns)?.with_free_friction();
    let first = linear_fit(&factors)?;
    // correlated rows hold less than their number says: what was known must not drown among them
    let strength = (first.rows as f64 / first.effective_rows).max(1.0);
    let speed = speeds(&factors);
    let known = prior(&start, &columns, strength)?;
    let begun = DescentPoint::of(columns, factors, known, &first)?;
    let mut iterations = 1;
    let (at, ending, _) = descend(begun, &DAMPING, MAX_PASSES - 1, &mut |at, damping| {
        let Some(step) = at.step(damping)? else {
            return Ok::<_, E>(Trial::Settled);
        };
        let columns = sorted(moved(&at.columns, &step, &speed));
        let factors = pass(&columns)?.with_free_friction();
        iterations += 1;
        let known = prior(&start, &columns, strength)?;
        let gained = at.cost - cost(&factors, &at.weights, known.as_ref())?;
        if gained.is_nan() || gained <= 0.0 {
            return Ok(Trial::Rejected);
        }
        let linear = linear_fit(&factors)?;
        let next = DescentPoint::of(columns, factors, known, &linear)?;
        Ok(match gained <= SETTLED * at.cost {
            true => Trial::Last(next),
            false => Trial::Accepted(next),
        })
    })?;
    Ok(RefinedFit {
        fit: at.fit()?,
        columns: at.columns,
        ending,
        iterations,
        before: first.relative_error,
        factors: at.factors,
        weights: at.weights,
        prior: at.known,
    })
}

/// The steeper part first, where no covariance says which part is which.
fn sorted(mut columns: RegressorColumns) -> RegressorColumns {
    for known in columns.known.iter_mut().flatten() {
        let open =
            !known.held.contains(&true) && (0..GRADIENT).all(|k| known.covariance[k][k] <= 0.0);
        let law = &mut known.law;
        if open && law.slope_1 < law.slope_2 {
            std::mem::swap(&mut law.slope_1, &mut law.slope_2);
            std::mem::swap(&mut law.coulomb_1, &mut law.coulomb_2);
        }
    }
    columns
}

/// The columns with their laws moved by a step of the unknowns; slopes stay positive and in bounds.
fn moved(columns: &RegressorColumns, step: &DVector<f64>, speed: &[f64]) -> RegressorColumns {
    let free = columns.with_free_friction();
    let mut next = columns.clone();
    for (j, known) in next.known.iter_mut().enumerate() {
        let Some(known) = known else { continue };
        let mut p = known.law.parameters();
        for (at, k) in free.law_unknowns(j) {
            let (before, wanted) = (p[k], p[k] + step[at]);
            p[k] = wanted;
            if k >= 3 {
                let steepest = match speed[j] {
                    speed if speed > 0.0 => STEEPEST / speed,
                    _ => f64::MAX,
                };
                let (low, high) = (before / FARTHEST, before * FARTHEST);
                p[k] = wanted.clamp(low.min(high), high.max(low)).min(steepest);
            }
        }
        known.law = DoubleTanh::from_parameters(p);
    }
    next
}

#[cfg(test)]
mod tests {
    use super::super::BLOCK_SECONDS;
    use super::super::law_start::begin;
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const INERTIA: f64 = 3.0;
    const LAW: [f64; 5] = [2.0, 1.4, -0.5, 60.0, 6.0];

    /// Inertia, offset and law: the unknowns of a refined fit.
    const TRUTH: [f64; 7] = [INERTIA, 0.3, LAW[0], LAW[1], LAW[2], LAW[3], LAW[4]];

    fn linear() -> RegressorColumns {
        RegressorColumns::of_one(
            &[JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset],
            None,
        )
    }

    /// Rows of a joint with inertia and law, of which every speed is seen often.
    fn read(columns: &RegressorColumns, noise: f64, seed: u64) -> Result<BlockFactors, FitError> {
        let law = DoubleTanh::from_parameters(LAW);
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
        let rows = (0..6000).map(|k| {
            let t = f64::from(k) * 0.01;
            let v = 0.6 * (0.9 * t).sin() * (0.13 * t).cos();
            let a = draw();
            [v, a, INERTIA * a + law.torque(v) + 0.3 + noise * draw()]
        });
        Ok(columns.rows_of_one(BLOCK_SECONDS, rows))
    }

    #[test]
    fn gradient_columns_are_the_derivatives_of_the_predicted_torque() {
        use num_dual::{DualNum, DualVec64, gradient};
        let law = DoubleTanh::from_parameters(LAW);
        for v in [-0.7, -0.02, 0.003, 0.1, 0.4] {
            let exact = law.gradient(v);
            let torque = |p: nalgebra::SVector<DualVec64<nalgebra::Const<5>>, 5>| {
                let [b, f1, f2, w1, w2] = [0, 1, 2, 3, 4].map(|k| p[k]);
                b * v + f1 * (w1 * v).tanh() + f2 * (w2 * v).tanh()
            };
            let (_, dual) = gradient(torque, &nalgebra::SVector::from(LAW));
            for (k, (exact, dual)) in exact.iter().zip(&dual).enumerate() {
                assert!((exact - dual).abs() < 1e-12, "{k} at {v}: {exact} {dual}");
            }
        }
    }

    #[test]
    fn a_law_without_one_joint_logs_is_found_with_the_inertia() {
        let mut passes = 0;
        let mut pass = |c: &RegressorColumns| {
            passes += 1;
            read(c, 0.0, 1)
        };
        let start = begin(&linear(), &mut pass).unwrap();
        let found = refine(start, &mut pass).unwrap();
        assert_eq!(found.ending, IterationEnding::Converged);
        for (i, truth) in TRUTH.into_iter().enumerate() {
            let off = (found.fit.theta[i] / truth - 1.0).abs();
            assert!(off < 1e-6, "unknown {i}: {} {truth}", found.fit.theta[i]);
        }
        assert!(passes < 25, "{passes}");
    }

    #[test]
    fn intervals_of_a_refined_law_cover() {
        let mut covered = [0; 7];
        for seed in 0..60 {
            let mut pass = |c: &RegressorColumns| read(c, 0.05, seed);
            let start = begin(&linear(), &mut pass).unwrap();
            let found = refine(start, &mut pass).unwrap();
            for (i, truth) in TRUTH.into_iter().enumerate() {
                let std = found.fit.covariance[(i, i)].sqrt();
                covered[i] += u32::from((found.fit.theta[i] - truth).abs() < 1.96 * std);
            }
        }
        // of 60 draws of 0.95 fewer than 50 come in 0.1 % of all tests
        assert!(covered.iter().all(|c| *c >= 50), "{covered:?}");
    }

    #[test]
    fn friction_that_was_known_well_stays_and_friction_known_badly_moves() {
        let mut off = LAW;
        off[0] *= 1.1;
        for (sure, stays) in [(1e-7, true), (0.3, false)] {
            let mut covariance = [[0.0; 5]; 5];
            for (k, row) in covariance.iter_mut().enumerate() {
                row[k] = (sure * LAW[k]).powi(2);
            }
            let known = KnownFriction {
                law: DoubleTanh::from_parameters(off),
                covariance,
                held: [false; GRADIENT],
            };
            let known = RegressorColumns::of_one(&[JointTerm::Offset], Some(known));
            let found = refine(known, &mut |c: &RegressorColumns| read(c, 0.02, 5)).unwrap();
            let viscous = found.fit.theta[2];
            let near = if stays { off[0] } else { LAW[0] };
            assert!((viscous - near).abs() < 0.02, "{sure}: {viscous}");
        }
    }
}
