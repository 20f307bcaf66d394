//! Instrumental variables: the regressor along simulated positions weighs the torque equations.
//!
//! Noise in measured positions is in the regressor too, and least squares is then biased. The
//! regressor Z along positions that the direct dynamics of the last estimate gives in closed loop
//! knows nothing of that noise: theta = (Z' W X)^-1 Z' W b (IDIM-IV: Janot, Vandanjon and Gautier
//! 2014, IEEE Trans. Control Systems Technology 22). Simulation and fit repeat until theta settles.
//!
//! A log is read twice at once: a first pass smooths the reference and simulates, a second one
//! computes X from the measured and Z from the simulated positions, filtered alike.

use std::cell::RefCell;

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::Serialize;

use super::BLOCK_SECONDS;
use super::accumulate::{BlockFactor, BlockFactors, RowAccumulator};
use super::closed_loop::{ClosedLoop, LoopGains};
use super::columns::{GRADIENT, RegressorColumns};
use super::covariance::{at_least, bandwidth, by_friction};
use super::solution::FitError;
use super::solve::{Fit, weights_of};
use super::two_pass::two_passes;
use crate::block::Block;
use crate::math::descent::IterationEnding;
use crate::math::long_run::long_run;
use crate::math::rank;
use crate::motion::{self, FilterSettings, ParallelFilter, RunError, Summary};
use crate::robot::Robot;

/// The reference that no log gives is the measured position below this share of the rows' cut-off.
const REFERENCE_SHARE: f64 = 0.5;
/// Largest change of a parameter, in its standard deviations, of an iteration that has settled.
const SETTLED: f64 = 0.05;
/// Most iterations.
const MAX_ITERATIONS: usize = 12;
/// Directions of Z'X, columns scaled, below this share of the largest are open.
const OPEN: f64 = 1e-11;

/// Where the reference comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ReferenceSource {
    /// The log: positions of the blocks hold n measured ones and n of the reference.
    Logged,
    /// The measured positions through a narrower zero-phase filter.
    Smoothed,
}

/// Columns that hold the instruments of `columns` before the regressor itself.
fn doubled(columns: &RegressorColumns) -> RegressorColumns {
    RegressorColumns {
        shared: 2 * columns.shared,
        own: columns.own.iter().map(|own| own.repeat(2)).collect(),
        ..columns.clone()
    }
}

/// What one reading gives.
pub struct InstrumentReading {
    pub factors: BlockFactors,
    pub summary: Summary,
    pub gains: LoopGains,
    /// Share of the steps at which the mass matrix was not positive definite, or a joint went astray.
    pub indefinite: f64,
}

/// Reads a log, sampled about every `step` seconds, with instruments from the loop under `theta`.
///
/// # Errors
/// Those of the source and of [`motion::run`].
pub fn accumulate<E: Send>(
    robot: &Robot,
    columns: &RegressorColumns,
    theta: &DVector<f64>,
    reference: ReferenceSource,
    settings: &FilterSettings,
    step: f64,
    source: &mut (dyn FnMut(&mut Block) -> Result<bool, E> + Send),
) -> Result<InstrumentReading, RunError<E>> {
    let n = columns.joints;
    let wide = doubled(columns);
    let settings = &columns.with_rests(settings);
    let (width, share) = match reference {
        ReferenceSource::Logged => (2 * n, ABOVE),
        ReferenceSource::Smoothed => (n, REFERENCE_SHARE),
    };
    // of the reference every row is kept
    let smooth = FilterSettings {
        cutoff_hz: (share * settings.cutoff_hz).min(HIGHEST_SHARE / step),
        filter: ParallelFilter::Butterworth { order: 4 },
        decimation: Some(1),
        q_order: 0,
        q_trim_s: None,
        trim_s: None,
        ..settings.clone()
    };
    let from = width - n;
    let mut simulation = LoopSimulation {
        run: None,
        begin: |q_ref: &[f64]| {
            let theta = theta.as_slice().to_vec();
            ClosedLoop::new(robot, columns, theta, q_ref, settings.cutoff_hz, step)
        },
        steps: 0,
    };
    let mut factors = RowAccumulator::new(wide.clone(), BLOCK_SECONDS);
    let (_, summary) = two_passes(
        |outlet| {
            motion::run(
                source,
                width,
                &smooth,
                None,
                3 * n,
                &|s, out| {
                    out[..n].copy_from_slice(&s.q[from..]);
                    out[n..2 * n].copy_from_slice(&s.v[from..]);
                    out[2 * n..].copy_from_slice(&s.tau[..n]);
                },
                &mut |row| {
                    outlet.row(|block| {
                        block.t.push(row.t);
                        block.q.extend_from_slice(&row.q[..n]);
                        simulation.row(row, n, &mut block.q);
                        block.tau.extend_from_slice(&row.raw[2 * n..]);
                        // the simulated half has no torque
                        block.tau.extend(std::iter::repeat_n(0.0, n));
                    });
                },
            )
        },
        |blocks| {
            motion::run(
                blocks,
                2 * n,
                settings,
                None,
                wide.channels(),
                &|s, out| fill(robot, columns, &wide, s, out),
                &mut |row| factors.add(row.segment, row.step, row.filtered),
            )
        },
    )?;
    let steps = simulation.steps.max(1) as f64;
    let (gains, indefinite) = match simulation.run {
        Some((run, ..)) => (run.gains, run.indefinite),
        None => (LoopGains::default(), 0),
    };
    Ok(InstrumentReading {
        factors: factors.finish(),
        summary,
        gains,
        indefinite: indefinite as f64 / steps,
    })
}

/// The loop along the reference of a log, row by row.
struct LoopSimulation<'a, B> {
    /// The loop, its segment of the log, and the time of its last row [s].
    run: Option<(ClosedLoop<'a>, usize, f64)>,
    /// Begins it at a pose.
    begin: B,
    steps: u64,
}

impl<'a, B: Fn(&[f64]) -> ClosedLoop<'a>> LoopSimulation<'a, B> {
    /// Appends the simulated positions of a row, whose channels are reference and its velocity.
    fn row(&mut self, row: &motion::FilteredRow<'_>, n: usize, out: &mut Vec<f64>) {
        let (q_ref, v_ref) = (&row.filtered[..n], &row.filtered[n..2 * n]);
        self.steps += 1;
        let (run, segment, before) = self
            .run
            .get_or_insert_with(|| ((self.begin)(q_ref), usize::MAX, row.t));
        if *segment == row.segment {
            out.extend_from_slice(run.step(row.t - *before, q_ref, v_ref));
        } else {
            run.place(q_ref, v_ref);
            out.extend_from_slice(q_ref);
        }
        (*segment, *before) = (row.segment, row.t);
    }
}

/// Cut-off of a logged reference over that of the rows.
const ABOVE: f64 = 3.0;
/// The reference's cut-off stays below this share of the sampling rate.
const HIGHEST_SHARE: f64 = 0.4;

/// Writes instruments and regressor of one sample.
fn fill(
    robot: &Robot,
    columns: &RegressorColumns,
    wide: &RegressorColumns,
    s: &motion::MotionSample<'_>,
    out: &mut [f64],
) {
    let n = columns.joints;
    let half = columns.offset(n) + n;
    CHANNELS.with_borrow_mut(|buffer| {
        buffer.resize(2 * half, 0.0);
        let (z, x) = buffer.split_at_mut(half);
        columns.fill(robot, &s.q[n..], &s.v[n..], &s.a[n..], &s.tau[n..], z);
        columns.fill(robot, &s.q[..n], &s.v[..n], &s.a[..n], &s.tau[..n], x);
        for j in 0..n {
            let own = columns.unknowns_of(j);
            let (from, whole) = (columns.offset(j), columns.row_width(j));
            let at = wide.offset(j);
            out[at..at + own].copy_from_slice(&z[from..from + own]);
            out[at + own..at + own + whole].copy_from_slice(&x[from..from + whole]);
        }
        let torques = columns.offset(n);
        out[wide.offset(n)..][..n].copy_from_slice(&x[torques..torques + n]);
    });
    wide.weigh(s, out);
}

thread_local! {
    /// The channels of instruments and of the regressor of one sample, allocated once a thread.
    static CHANNELS: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
}

/// Z'WX theta = Z'Wb, and Z'W^2 Z times the residual's variance.
struct InstrumentSystem {
    normal: DMatrix<f64>,
    square: DMatrix<f64>,
    target: DVector<f64>,
    /// Weighted squared norms of the columns of Z and of X.
    scale: [DVector<f64>; 2],
}

impl InstrumentSystem {
    fn of(
        joints: &[DMatrix<f64>],
        columns: &RegressorColumns,
        weights: &[f64],
        residual_std: &[f64],
    ) -> Self {
        let u = columns.unknowns();
        let mut system = InstrumentSystem {
            normal: DMatrix::zeros(u, u),
            square: DMatrix::zeros(u, u),
            target: DVector::zeros(u),
            scale: [DVector::zeros(u), DVector::zeros(u)],
        };
        for (j, r) in joints.iter().enumerate() {
            let (c, w) = (columns.unknowns_of(j), weights[j] * weights[j]);
            let (z, x) = (r.columns(0, c), r.columns(c, c));
            let zx = z.tr_mul(&x) * w;
            let zz = z.tr_mul(&z) * w * w * residual_std[j].powi(2);
            let zb = z.tr_mul(&r.column(r.ncols() - 1)) * w;
            for a in 0..c {
                let row = columns.unknown(j, a);
                system.target[row] += zb[a];
                system.scale[0][row] += w * z.column(a).norm_squared();
                system.scale[1][row] += w * x.column(a).norm_squared();
                for b in 0..c {
                    system.normal[(row, columns.unknown(j, b))] += zx[(a, b)];
                    system.square[(row, columns.unknown(j, b))] += zz[(a, b)];
                }
            }
        }
        system
    }

    /// (Z'WX)^-1 over the directions that the data leave closed.
    fn inverse(&self) -> Result<DMatrix<f64>, FitError> {
        let u = self.target.len();
        let inverse_root = |x: f64| if x > 0.0 { 1.0 / x.sqrt() } else { 0.0 };
        let [left, right] = self.scale.each_ref().map(|s| s.map(inverse_root));
        let scaled = DMatrix::from_fn(u, u, |a, b| self.normal[(a, b)] * left[a] * right[b]);
        let svd = rank::svd(&scaled)?;
        let mut inverse = DMatrix::zeros(u, u);
        for k in (0..u).filter(|k| svd.s[*k] > OPEN * svd.s[0]) {
            inverse += svd.v.column(k) * svd.u.column(k).transpose() / svd.s[k];
        }
        Ok(DMatrix::from_fn(u, u, |a, b| {
            inverse[(a, b)] * right[a] * left[b]
        }))
    }
}

/// The fit of one more reading, with weights from the fit before.
///
/// # Errors
/// [`FitError`].
pub fn again(
    columns: &RegressorColumns,
    before: &Fit,
    factors: &BlockFactors,
) -> Result<Fit, FitError> {
    let (n, u) = (columns.joints, columns.unknowns());
    let weights = weights_of(factors, &before.residual_std);
    let joints: Vec<DMatrix<f64>> = (0..n).map(|j| factors.joint(j)).collect();
    let system = InstrumentSystem::of(&joints, columns, &weights, &before.residual_std);
    let inverse = system.inverse()?;
    let theta = &inverse * &system.target;
    let own: Vec<DVector<f64>> = (0..n).map(|j| columns.own_unknowns(&theta, j)).collect();
    // b - X theta of a joint's triangle
    let residual = |r: &DMatrix<f64>, j: usize| {
        let c = columns.unknowns_of(j);
        r.column(r.ncols() - 1) - r.columns(c, c) * &own[j]
    };
    let rows = factors.rows_per_joint();
    let mut fit = before.clone();
    for (j, r) in joints.iter().enumerate() {
        let square = residual(r, j).norm_squared();
        fit.residual_std[j] = (square / factors.moving[j].count.max(1) as f64).sqrt();
        let at_rest = residual(&factors.at_rest[j], j).norm_squared();
        fit.relative_error[j] = factors.relative_residual(j, [square, at_rest]);
    }
    let score = |block: &BlockFactor| {
        let mut g = DVector::zeros(u);
        for (j, r) in block.r.iter().enumerate() {
            let c = columns.unknowns_of(j);
            let score = r.columns(0, c).tr_mul(&residual(r, j));
            columns.add_own(j, weights[j] * weights[j], &score, &mut g);
        }
        (block.stretch, g)
    };
    let scores: Vec<(usize, DVector<f64>)> = factors.blocks.iter().map(score).collect();
    let freedom = rows / (rows - u as f64 / n as f64).max(1.0);
    let about = |middle: DMatrix<f64>| &inverse * middle * inverse.transpose() * freedom;
    fit.textbook = about(system.square);
    let long = long_run(&scores, u, bandwidth(&scores, u, factors.block_seconds));
    fit.covariance = at_least(about(long), &fit.textbook);
    for (j, r) in joints.iter().enumerate() {
        fit.friction_sensitivity[j] = None;
        let Some(known) = &columns.known[j] else {
            continue;
        };
        let own = columns.unknowns_of(j);
        let zg = r.columns(0, own).tr_mul(&r.columns(2 * own, GRADIENT));
        let (s, added) = by_friction(columns, known, (j, weights[j]), &inverse, &zg);
        fit.covariance += added;
        fit.friction_sensitivity[j] = Some(s);
    }
    fit.theta = theta;
    Ok(fit)
}

/// A fit with instruments.
#[derive(Debug, Clone)]
pub struct InstrumentalFit {
    pub fit: Fit,
    pub ending: IterationEnding,
    /// Simulations.
    pub iterations: usize,
}

/// Repeats simulation and fit from `plain`, the weighted least-squares fit. `pass` reads the logs
/// with instruments under the parameters it is given.
///
/// # Errors
/// Those of `pass`, and [`FitError`].
pub fn iterate<E: From<FitError>>(
    columns: &RegressorColumns,
    plain: &Fit,
    pass: &mut dyn FnMut(&DVector<f64>) -> Result<BlockFactors, E>,
) -> Result<InstrumentalFit, E> {
    let (mut fit, mut iterations) = (plain.clone(), 0);
    let mut ending = IterationEnding::IterationLimit;
    while iterations < MAX_ITERATIONS && ending == IterationEnding::IterationLimit {
        let next = again(columns, &fit, &pass(&fit.theta)?)?;
        iterations += 1;
        let moved = |i: usize| {
            let std = next.covariance[(i, i)].max(0.0).sqrt();
            next.determined[i] && (next.theta[i] - fit.theta[i]).abs() > SETTLED * std
        };
        if !(0..next.theta.len()).any(moved) {
            ending = IterationEnding::Converged;
        }
        fit = next;
    }
    Ok(InstrumentalFit {
        fit,
        ending,
        iterations,
    })
}

#[cfg(test)]
mod tests;
