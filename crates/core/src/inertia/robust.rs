//! Robust regression: rows whose residual is large count less, or not at all.
//!
//! Iteratively reweighted least squares (Holland and Welsch 1977). A row is one joint's filtered
//! torque equation at one instant; its weight comes from its residual over the joint's scale, which
//! is the median absolute residual times 1.4826 (Rousseeuw and Croux 1993). Huber's loss, convex,
//! finds the neighbourhood from the weighted least-squares fit; Tukey's bisquare, which gives
//! gross errors no weight, finishes from there (Maronna, Martin, Yohai and Salibian-Barrera 2019,
//! section 2.7). Each pass streams over the logs: medians come from histograms of fixed size.

use nalgebra::DVector;

use super::accumulate::BlockFactors;
use super::columns::RegressorColumns;
use super::solution::{FitError, FitInputs};
use super::solve::{Fit, RowWeighting, fit, fit_with};
use crate::math::descent::IterationEnding;

/// Tuning of Huber's loss: 95 % efficiency where residuals are normal.
const HUBER: f64 = 1.345;
/// Tuning of the bisquare: 95 % efficiency where residuals are normal.
const BISQUARE: f64 = 4.685;
/// From the median absolute deviation to the standard deviation of a normal law.
const NORMAL: f64 = 1.4826;
/// A row below this weight counts as weighted down: 1.1 % of normal residuals under the bisquare.
const LIGHT_WEIGHT: f64 = 0.5;
/// Largest change of a parameter, in its standard deviations, of an iteration that has settled.
const SETTLED: f64 = 0.03;
/// Most iterations under each loss.
const MAX_ITERATIONS: usize = 30;
/// Bins of a histogram of absolute residuals, each 1 % wider than the one before.
const BINS: usize = 2400;
const RATIO: f64 = 1.01;
/// Lowest bin, in parts of the residual's rms.
const LOWEST: f64 = 1e-6;

/// How a residual of u scales counts.
#[derive(Debug, Clone, Copy)]
enum RobustLoss {
    /// All rows alike.
    Square,
    /// Huber 1964: square within 1.345 scales, linear beyond.
    Huber,
    /// Tukey's bisquare: nothing beyond 4.685 scales.
    Bisquare,
}

impl RobustLoss {
    /// psi(u)/u, the weight of a row.
    fn weight(self, u: f64) -> f64 {
        match self {
            RobustLoss::Square => 1.0,
            RobustLoss::Huber if u.abs() <= HUBER => 1.0,
            RobustLoss::Huber => HUBER / u.abs(),
            RobustLoss::Bisquare => {
                let rest = 1.0 - (u / BISQUARE).powi(2);
                if rest > 0.0 { rest * rest } else { 0.0 }
            }
        }
    }

    /// psi'(u).
    fn slope(self, u: f64) -> f64 {
        match self {
            RobustLoss::Square => 1.0,
            RobustLoss::Huber => f64::from(u8::from(u.abs() <= HUBER)),
            RobustLoss::Bisquare => match (u / BISQUARE).powi(2) {
                x if x < 1.0 => (1.0 - x) * (1.0 - 5.0 * x),
                _ => 0.0,
            },
        }
    }
}

/// Counts of absolute residuals of one joint, and what their weights sum up to.
#[derive(Debug, Clone, Default)]
struct ResidualTally {
    /// Residual of the first bin's upper edge [N or Nm].
    lowest: f64,
    bins: Vec<u64>,
    rows: u64,
    down: u64,
    weight: f64,
    slope: f64,
    /// Sum of squares, unweighted.
    square: f64,
}

impl ResidualTally {
    fn new(rms: f64) -> Self {
        ResidualTally {
            lowest: LOWEST * rms,
            bins: vec![0; BINS],
            ..ResidualTally::default()
        }
    }

    fn add(&mut self, residual: f64, weight: f64, slope: f64) {
        let size = residual.abs();
        let bin = match size > self.lowest && self.lowest > 0.0 {
            true => ((size / self.lowest).ln() / RATIO.ln()) as usize + 1,
            false => 0,
        };
        self.bins[bin.min(BINS - 1)] += 1;
        self.rows += 1;
        self.down += u64::from(weight < LIGHT_WEIGHT);
        self.weight += weight;
        self.slope += slope;
        self.square += residual * residual;
    }

    /// Median of the absolute residuals [N or Nm], to half a per cent.
    fn median(&self) -> f64 {
        let half = self.rows as f64 / 2.0;
        let mut below = 0.0;
        for (bin, count) in self.bins.iter().enumerate() {
            let count = *count as f64;
            if below + count >= half && count > 0.0 {
                if bin == 0 {
                    return self.lowest;
                }
                let within = (half - below) / count;
                return self.lowest * RATIO.powf(bin as f64 - 1.0 + within);
            }
            below += count;
        }
        0.0
    }
}

/// Weighs rows by their residuals under a fit, and counts what it sees.
#[derive(Debug, Clone)]
pub struct RowWeigher {
    loss: RobustLoss,
    theta: DVector<f64>,
    /// Per joint [N or Nm].
    scale: Vec<f64>,
    tally: Vec<ResidualTally>,
    row: Vec<f64>,
}

impl RowWeigher {
    /// Weights by the residuals of `theta`, in `scale` per joint; `rms` is about the size of a joint's residuals.
    fn new(loss: RobustLoss, theta: DVector<f64>, scale: Vec<f64>, rms: &[f64]) -> Self {
        RowWeigher {
            loss,
            theta,
            scale,
            tally: rms.iter().map(|rms| ResidualTally::new(*rms)).collect(),
            row: Vec::new(),
        }
    }

    /// The weigher with its counts at zero, for another reading of the same logs.
    #[must_use]
    pub fn afresh(&self) -> Self {
        let mut new = self.clone();
        for tally in &mut new.tally {
            *tally = ResidualTally::new(tally.lowest / LOWEST);
        }
        new
    }

    /// The channels of one instant with each joint's row times the root of its weight.
    pub(super) fn weigh(&mut self, columns: &RegressorColumns, channels: &[f64]) -> &[f64] {
        self.row.clear();
        self.row.extend_from_slice(channels);
        let mut rest = self.row.as_mut_slice();
        for j in 0..columns.joints {
            let (row, after) = std::mem::take(&mut rest).split_at_mut(columns.row_width(j));
            rest = after;
            if columns.rests(channels, j) {
                continue;
            }
            let mut residual = row.last().copied().unwrap_or_default();
            for (c, x) in row[..columns.unknowns_of(j)].iter().enumerate() {
                residual -= x * self.theta[columns.unknown(j, c)];
            }
            let u = match self.scale[j] {
                scale if scale > 0.0 => residual / scale,
                _ => 0.0,
            };
            let weight = self.loss.weight(u);
            self.tally[j].add(residual, weight, self.loss.slope(u));
            let root = weight.sqrt();
            for x in row {
                *x *= root;
            }
        }
        &self.row
    }

    /// Scale of each joint's residuals, not below `floor` [N or Nm].
    fn scales(&self, floor: &[f64]) -> Vec<f64> {
        let scale = |(t, f): (&ResidualTally, &f64)| (NORMAL * t.median()).max(*f);
        self.tally.iter().zip(floor).map(scale).collect()
    }

    /// The fit of block factors that this weigher has weighted.
    ///
    /// # Errors
    /// [`FitError`].
    pub fn solve(&self, factors: &BlockFactors) -> Result<Fit, FitError> {
        let inverse = |s: &f64| if *s > 0.0 { 1.0 / s } else { 0.0 };
        let weights: Vec<f64> = self.scale.iter().map(inverse).collect();
        let share = |t: &ResidualTally| match t.weight > 0.0 {
            true => (t.slope / t.weight).max(LEAST_SLOPE),
            false => 1.0,
        };
        let slope: Vec<f64> = self.tally.iter().map(share).collect();
        let inputs = FitInputs {
            weights: &weights,
            slope: Some(&slope),
            prior: None,
        };
        let mut fit = fit_with(factors, inputs)?;
        // the residual of all rows as they are, outliers among them
        for (j, tally) in self.tally.iter().enumerate() {
            fit.residual_std[j] = (tally.square / tally.rows.max(1) as f64).sqrt();
            let at_rest = factors.square_at_rest(&fit.theta, j);
            fit.relative_error[j] = factors.relative_residual(j, [tally.square, at_rest]);
        }
        Ok(fit)
    }
}

/// The mean of psi' over that of the weights is at least this; it is near 1 but for wild residuals.
const LEAST_SLOPE: f64 = 0.1;

/// A robust fit.
#[derive(Debug, Clone)]
pub struct RobustFit {
    pub fit: Fit,
    /// The weighted rows of the last pass.
    pub factors: BlockFactors,
    /// Gives other readings of the logs the weights of the fit.
    pub weigher: RowWeigher,
    pub ending: IterationEnding,
    /// Passes over the logs with weights.
    pub iterations: usize,
    /// Scale of each joint's residuals [N or Nm].
    pub scale: Vec<f64>,
    /// Share of each joint's rows that count less than half.
    pub down_weighted: Vec<f64>,
}

/// Fits robustly. `pass` reads the logs once, rows weighted by the weigher where one is given.
///
/// # Errors
/// Those of `pass`, and [`FitError`].
pub fn irls<E: From<FitError>>(
    pass: &mut dyn FnMut(Option<&mut RowWeigher>) -> Result<BlockFactors, E>,
) -> Result<RobustFit, E> {
    let mut fit = fit(&pass(None)?, RowWeighting::Wls)?;
    let rms: Vec<f64> = fit.residual_std.clone();
    let floor: Vec<f64> = fit.torque_rms.iter().map(|rms| 1e-9 * rms).collect();
    let mut seen = RowWeigher::new(RobustLoss::Square, fit.theta.clone(), rms.clone(), &rms);
    pass(Some(&mut seen))?;
    let mut scale = seen.scales(&floor);
    let mut iterations = 1;
    let mut ending = IterationEnding::IterationLimit;
    let mut last = None;
    for loss in [RobustLoss::Huber, RobustLoss::Bisquare] {
        ending = IterationEnding::IterationLimit;
        for _ in 0..MAX_ITERATIONS {
            seen = RowWeigher::new(loss, fit.theta.clone(), scale, &rms);
            let factors = pass(Some(&mut seen))?;
            let next = seen.solve(&factors)?;
            iterations += 1;
            scale = seen.scales(&floor);
            let moved = |i: usize| {
                let std = next.covariance[(i, i)].sqrt();
                let step = (next.theta[i] - fit.theta[i]).abs();
                next.determined[i] && step > SETTLED * std && step > 1e-9 * next.theta[i].abs()
            };
            let settled = !(0..next.theta.len()).any(moved);
            fit = next;
            last = Some(factors);
            if settled {
                ending = IterationEnding::Converged;
                break;
            }
        }
    }
    let share = |t: &ResidualTally| t.down as f64 / t.rows.max(1) as f64;
    let factors = last.ok_or(FitError::NothingExcited)?;
    Ok(RobustFit {
        factors,
        down_weighted: seen.tally.iter().map(share).collect(),
        scale: seen.scale.clone(),
        weigher: seen,
        fit,
        ending,
        iterations,
    })
}

#[cfg(test)]
mod tests {
    use super::super::BLOCK_SECONDS;
    use super::super::accumulate::RowAccumulator;
    use super::super::columns::JointTerm;
    use super::*;
    use crate::robot::{JointKind, Robot};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const TRUTH: [f64; 3] = [3.0, 2.0, 0.7];

    /// Rows of a joint with inertia 3, Fv 2 and Fc 0.7; a share of them is hit by a force of 40 that pushes forward.
    fn read(
        hit: f64,
        seed: u64,
        mut weigher: Option<&mut RowWeigher>,
    ) -> Result<BlockFactors, FitError> {
        let robot = Robot::single_joint("q1", JointKind::Prismatic);
        let columns = RegressorColumns::of_one(&[JointTerm::Viscous, JointTerm::Coulomb], None);
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
        let mut all = RowAccumulator::new(columns.clone(), BLOCK_SECONDS);
        let mut channels = vec![0.0; columns.channels()];
        let mut pick = ChaCha8Rng::seed_from_u64(seed + 1000);
        for k in 0..4000 {
            let t = f64::from(k) * 0.01;
            let (v, a): (f64, f64) = ((0.9 * t).sin() + 0.4 * (2.3 * t).cos(), draw());
            let mut tau = 3.0 * a + 2.0 * v + 0.7 * v.signum() + 0.1 * draw();
            if pick.random::<f64>() < hit {
                tau += 40.0 * v.signum();
            }
            columns.fill(&robot, &[0.0], &[v], &[a], &[tau], &mut channels);
            match &mut weigher {
                Some(weigher) => all.add(0, 0.01, weigher.weigh(&columns, &channels)),
                None => all.add(0, 0.01, &channels),
            }
        }
        Ok(all.finish())
    }

    #[test]
    fn two_per_cent_of_spikes_ruin_least_squares_and_not_the_robust_fit() {
        let plain = fit(&read(0.02, 3, None).unwrap(), RowWeighting::Wls).unwrap();
        assert!((plain.theta[2] - 0.7).abs() > 0.4, "{}", plain.theta);
        let robust = irls(&mut |w| read(0.02, 3, w)).unwrap();
        assert_eq!(robust.ending, IterationEnding::Converged);
        for (i, truth) in TRUTH.into_iter().enumerate() {
            let std = robust.fit.covariance[(i, i)].sqrt();
            let off = (robust.fit.theta[i] - truth).abs();
            assert!(off < 3.0 * std && std < 0.02, "{i}: {off} {std}");
        }
        // the spikes and 1.1 % of the others
        let share = robust.down_weighted[0];
        assert!((0.025..0.037).contains(&share), "{share}");
        let scale = robust.scale[0];
        assert!((scale / 0.1 - 1.0).abs() < 0.06, "{scale}");
        // the rms that is reported is that of all rows
        assert!(robust.fit.residual_std[0] > 5.0);
    }

    #[test]
    fn on_clean_rows_both_agree_and_the_robust_intervals_cover() {
        let mut covered = [0; 3];
        for seed in 0..100 {
            let plain = fit(&read(0.0, seed, None).unwrap(), RowWeighting::Wls).unwrap();
            let robust = irls(&mut |w| read(0.0, seed, w)).unwrap();
            for (i, truth) in TRUTH.into_iter().enumerate() {
                let [std, of_plain] =
                    [&robust.fit, &plain].map(|fit| fit.covariance[(i, i)].sqrt());
                let found = robust.fit.theta[i];
                assert!((found - plain.theta[i]).abs() < 1.5 * of_plain);
                assert!(std < 1.3 * of_plain);
                covered[i] += u32::from((found - truth).abs() < 1.96 * std);
            }
        }
        // of 100 draws of 0.95 fewer than 87 come in 0.1 % of all tests
        assert!(covered.iter().all(|c| *c >= 87), "{covered:?}");
    }

    #[test]
    fn slopes_of_the_losses_are_their_derivatives() {
        for loss in [RobustLoss::Square, RobustLoss::Huber, RobustLoss::Bisquare] {
            for u in [-5.0, -3.1, -1.0, 0.3, 1.2, 2.0, 4.5] {
                let psi = |u: f64| u * loss.weight(u);
                let difference = (psi(u + 1e-5) - psi(u - 1e-5)) / 2e-5;
                assert!((difference - loss.slope(u)).abs() < 1e-8, "{loss:?} {u}");
            }
        }
    }

    #[test]
    fn the_histogram_s_median_is_the_sorted_one() {
        let mut tally = ResidualTally::new(1.0);
        let mut chance = ChaCha8Rng::seed_from_u64(4);
        let mut draw = || chance.random::<f64>().powi(3) * 7.0;
        let mut all: Vec<f64> = (0..5001).map(|_| draw()).collect();
        for x in &all {
            tally.add(-*x, 1.0, 1.0);
        }
        all.sort_by(f64::total_cmp);
        assert!((tally.median() / all[2500] - 1.0).abs() < 0.01);
    }
}
