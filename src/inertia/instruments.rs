//! Instrumental variables: the regressor along simulated positions weighs the torque equations.
//!
//! Noise in measured positions is in the regressor too, and least squares is then biased. The
//! regressor Z along positions that the direct dynamics of the last estimate gives in closed loop
//! knows nothing of that noise: theta = (Z' W X)^-1 Z' W b (IDIM-IV: Janot, Vandanjon and Gautier
//! 2014, IEEE Trans. Control Systems Technology 22). Simulation and fit repeat until theta settles.
//!
//! A log is read twice at once: a first pass smooths the reference and simulates, a second one
//! computes X from the measured and Z from the simulated positions, filtered alike.

use schemars::JsonSchema;
use serde::Serialize;
use std::sync::mpsc::sync_channel;

use nalgebra::{DMatrix, DVector};

use super::BLOCK_SECONDS;
use super::accumulate::{Accumulator, BlockFactors};
use super::closed_loop::{ClosedLoop, Gains};
use super::columns::{GRADIENT, RegressorColumns};
use super::covariance::{at_least, bandwidth};
use super::encoder::next;
use super::solve::{Fit, FitError, weights_of};
use crate::log::Block;
use crate::math::descent::Ending;
use crate::math::long_run::long_run;
use crate::math::rank;
use crate::motion::{self, FilterSettings, ParallelFilter, RunError, Summary};
use crate::robot::Robot;

/// The reference that no log gives is the measured position below this share of the rows' cut-off.
pub const REFERENCE_SHARE: f64 = 0.5;
/// Largest change of a parameter, in its standard deviations, of an iteration that has settled.
const SETTLED: f64 = 0.05;
/// Most iterations.
const MOST: usize = 12;
/// Blocks that wait between the two passes.
const WAITING: usize = 4;
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
    let twice = |own: &Vec<super::columns::Own>| own.iter().chain(own).copied().collect();
    RegressorColumns {
        joints: columns.joints,
        shared: 2 * columns.shared,
        own: columns.own.iter().map(twice).collect(),
        known: columns.known.clone(),
    }
}

/// What one reading gives.
pub struct InstrumentReading {
    pub factors: BlockFactors,
    pub summary: Summary,
    pub gains: Gains,
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
    let (sender, receiver) = sync_channel::<Block>(WAITING);
    let (width, share) = match reference {
        ReferenceSource::Logged => (2 * n, ABOVE),
        ReferenceSource::Smoothed => (n, REFERENCE_SHARE),
    };
    let first_settings = FilterSettings {
        cutoff_hz: (share * settings.cutoff_hz).min(HIGHEST_SHARE / step),
        filter: ParallelFilter::Butterworth { order: 4 },
        decimation: Some(1),
        q_order: 0,
        q_trim_s: None,
        trim_s: None,
        ..settings.clone()
    };
    std::thread::scope(|scope| {
        let first = scope.spawn(move || {
            let mut block = Block::default();
            let mut state: Option<(ClosedLoop, usize, f64)> = None;
            let mut steps = 0u64;
            // a pool of its own: a worker of the shared one may be waiting for these very blocks
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
            let from = width - n;
            let theta = theta.as_slice().to_vec();
            let mut ran = || {
                motion::run(
                    source,
                    width,
                    &first_settings,
                    None,
                    3 * n,
                    &|s, out| {
                        out[..n].copy_from_slice(&s.q[from..]);
                        out[n..2 * n].copy_from_slice(&s.v[from..]);
                        out[2 * n..].copy_from_slice(&s.tau[..n]);
                    },
                    &mut |row| {
                        let (q_ref, v_ref) = (&row.filtered[..n], &row.filtered[n..2 * n]);
                        steps += 1;
                        let at = block.q.len();
                        block.t.push(row.t);
                        block.q.extend_from_slice(&row.q[..n]);
                        match &mut state {
                            Some((run, segment, before)) if *segment == row.segment => {
                                let h = row.t - *before;
                                block.q.extend_from_slice(run.step(h, q_ref, v_ref));
                                *before = row.t;
                            }
                            Some((run, segment, before)) => {
                                run.place(q_ref, v_ref);
                                (*segment, *before) = (row.segment, row.t);
                                block.q.extend_from_slice(q_ref);
                            }
                            none => {
                                let mut run = ClosedLoop::new(
                                    robot,
                                    columns,
                                    theta.clone(),
                                    q_ref,
                                    settings.cutoff_hz,
                                    step,
                                );
                                run.place(q_ref, v_ref);
                                block.q.extend_from_slice(q_ref);
                                *none = Some((run, row.segment, row.t));
                            }
                        }
                        debug_assert_eq!(block.q.len(), at + 2 * n);
                        block.tau.extend_from_slice(&row.raw[2 * n..]);
                        // the simulated half has no torque
                        block.tau.extend(std::iter::repeat_n(0.0, n));
                        if block.len() == Block::ROWS {
                            // a receiver that is gone has failed, and says so itself
                            let _ = sender.send(std::mem::take(&mut block));
                        }
                    },
                )
            };
            let ran = match &pool {
                Ok(pool) => pool.install(ran),
                Err(_) => ran(),
            };
            let _ = sender.send(block);
            ran.map(|summary| {
                (
                    summary,
                    state.map(|(run, ..)| (run.gains, run.indefinite)),
                    steps,
                )
            })
        });
        let mut factors = Accumulator::new(wide.clone(), BLOCK_SECONDS);
        let second = motion::run(
            &mut next(&receiver),
            2 * n,
            settings,
            None,
            wide.channels(),
            &|s, out| fill(robot, columns, &wide, s, out),
            &mut |row| factors.add(row.segment, row.t, row.filtered),
        );
        drop(receiver);
        let (ran, steps) = match first.join() {
            Ok(Err(error)) => return Err(error),
            Ok(Ok((_, ran, steps))) => (ran, steps),
            Err(panic) => std::panic::resume_unwind(panic),
        };
        let summary = match second {
            Ok(summary) => summary,
            Err(RunError::Motion(error)) => return Err(RunError::Motion(error)),
            Err(RunError::Source(never)) => match never {},
        };
        let (gains, indefinite) = ran.unwrap_or((
            Gains {
                frequency: 0.0,
                proportional: Vec::new(),
                derivative: Vec::new(),
            },
            0,
        ));
        Ok(InstrumentReading {
            factors: factors.finish(),
            summary,
            gains,
            indefinite: indefinite as f64 / steps.max(1) as f64,
        })
    })
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
    let half = columns.channels();
    let mut buffer = [0.0; MOST_CHANNELS];
    let (z, rest) = buffer.split_at_mut(half);
    let x = &mut rest[..half];
    columns.fill(robot, &s.q[n..], &s.v[n..], &s.a[n..], &s.tau[n..], z);
    columns.fill(robot, &s.q[..n], &s.v[..n], &s.a[..n], &s.tau[..n], x);
    for j in 0..n {
        let own = columns.shared + columns.own[j].len();
        let (from, whole) = (columns.offset(j), columns.row_width(j));
        let at = wide.offset(j);
        out[at..at + own].copy_from_slice(&z[from..from + own]);
        out[at + own..at + own + whole].copy_from_slice(&x[from..from + whole]);
    }
    let last = out.len() - n;
    out[last..].copy_from_slice(&s.tau[..n]);
}

/// Twice the channels of the largest robot: 8 joints with 104 columns and 9 of their own.
const MOST_CHANNELS: usize = 2 * 8 * 115;

/// The fit with instruments.
///
/// # Errors
/// [`FitError`].
fn solve(factors: &BlockFactors, columns: &RegressorColumns, plain: &Fit) -> Result<Fit, FitError> {
    let (n, u) = (columns.joints, columns.unknowns());
    let weights = weights_of(factors, &plain.residual_std);
    let own = |j: usize| columns.shared + columns.own[j].len();
    let joints: Vec<DMatrix<f64>> = (0..n).map(|j| factors.joint(j)).collect();
    let mut normal: DMatrix<f64> = DMatrix::zeros(u, u);
    let mut square = DMatrix::zeros(u, u);
    let mut target = DVector::zeros(u);
    let mut scale = [DVector::<f64>::zeros(u), DVector::<f64>::zeros(u)];
    for (j, r) in joints.iter().enumerate() {
        let (c, w) = (own(j), weights[j] * weights[j]);
        let (z, x) = (r.columns(0, c), r.columns(c, c));
        let zx = z.tr_mul(&x) * w;
        let zz = z.tr_mul(&z) * w * w * plain.residual_std[j].powi(2);
        let zb = z.tr_mul(&r.column(r.ncols() - 1)) * w;
        for a in 0..c {
            let row = columns.unknown(j, a);
            target[row] += zb[a];
            scale[0][row] += w * z.column(a).norm_squared();
            scale[1][row] += w * x.column(a).norm_squared();
            for b in 0..c {
                normal[(row, columns.unknown(j, b))] += zx[(a, b)];
                square[(row, columns.unknown(j, b))] += zz[(a, b)];
            }
        }
    }
    let inverse_root = |x: f64| if x > 0.0 { 1.0 / x.sqrt() } else { 0.0 };
    let [left, right] = scale.map(|s| s.map(inverse_root));
    let scaled = DMatrix::from_fn(u, u, |a, b| normal[(a, b)] * left[a] * right[b]);
    let svd = rank::svd(&scaled)?;
    let mut inverse = DMatrix::zeros(u, u);
    for k in (0..u).filter(|k| svd.s[*k] > OPEN * svd.s[0]) {
        inverse += svd.v.column(k) * svd.u.column(k).transpose() / svd.s[k];
    }
    let inverse = DMatrix::from_fn(u, u, |a, b| inverse[(a, b)] * right[a] * left[b]);
    let theta = &inverse * target;
    let of = |j: usize| DVector::from_fn(own(j), |c, _| theta[columns.unknown(j, c)]);
    let rows = factors.rows as f64;
    let mut fit = plain.clone();
    for (j, r) in joints.iter().enumerate() {
        let left = r.column(r.ncols() - 1) - r.columns(own(j), own(j)) * of(j);
        fit.residual_std[j] = left.norm() / rows.sqrt();
        fit.relative_error[j] = match fit.torque_rms[j] {
            rms if rms > 0.0 => fit.residual_std[j] / rms,
            _ => f64::NAN,
        };
    }
    let scores: Vec<(usize, DVector<f64>)> = factors
        .blocks
        .iter()
        .map(|block| {
            let mut g = DVector::zeros(u);
            for (j, r) in block.r.iter().enumerate() {
                let left = r.column(r.ncols() - 1) - r.columns(own(j), own(j)) * of(j);
                let score = r.columns(0, own(j)).tr_mul(&left);
                for (c, s) in score.iter().enumerate() {
                    g[columns.unknown(j, c)] += weights[j] * weights[j] * s;
                }
            }
            (block.stretch, g)
        })
        .collect();
    let freedom = rows / (rows - u as f64 / n as f64).max(1.0);
    let about = |middle: DMatrix<f64>| &inverse * middle * inverse.transpose() * freedom;
    fit.textbook = about(square);
    let long = about(long_run(&scores, u, bandwidth(&scores, u)));
    fit.covariance = at_least(long, &fit.textbook);
    for (j, r) in joints.iter().enumerate() {
        fit.friction_sensitivity[j] = None;
        let Some(known) = &columns.known[j] else {
            continue;
        };
        let zg = r
            .columns(0, own(j))
            .tr_mul(&r.columns(2 * own(j), GRADIENT));
        let mut global = DMatrix::zeros(u, GRADIENT);
        for c in 0..own(j) {
            for k in 0..GRADIENT {
                global[(columns.unknown(j, c), k)] = weights[j] * weights[j] * zg[(c, k)];
            }
        }
        let s = -(&inverse * global);
        let covariance = DMatrix::from_fn(GRADIENT, GRADIENT, |a, b| known.covariance[a][b]);
        fit.covariance += &s * covariance * s.transpose();
        fit.friction_sensitivity[j] = Some(s);
    }
    fit.theta = theta;
    Ok(fit)
}

/// A fit with instruments.
#[derive(Debug, Clone)]
pub struct Instrumental {
    pub fit: Fit,
    pub ending: Ending,
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
) -> Result<Instrumental, E> {
    let mut fit = plain.clone();
    for iterations in 1..=MOST {
        let next = solve(&pass(&fit.theta)?, columns, &fit)?;
        let moved = |i: usize| {
            let std = next.covariance[(i, i)].max(0.0).sqrt();
            next.determined[i] && (next.theta[i] - fit.theta[i]).abs() > SETTLED * std
        };
        let settled = !(0..next.theta.len()).any(moved);
        fit = next;
        if settled || iterations == MOST {
            return Ok(Instrumental {
                fit,
                ending: if settled {
                    Ending::Converged
                } else {
                    Ending::IterationLimit
                },
                iterations,
            });
        }
    }
    Ok(Instrumental {
        fit,
        ending: Ending::IterationLimit,
        iterations: MOST,
    })
}

/// The fit of one more reading, with weights from `fit`.
///
/// # Errors
/// [`FitError`].
pub fn again(
    columns: &RegressorColumns,
    fit: &Fit,
    factors: &BlockFactors,
) -> Result<Fit, FitError> {
    solve(factors, columns, fit)
}

#[cfg(test)]
mod tests {
    use super::super::columns::Own;
    use super::super::solve::{Weighting, fit};
    use super::*;
    use crate::robot::JointKind;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const TRUTH: [f64; 3] = [95.0, 200.0, 20.0];
    const STEP: f64 = 0.002;
    const FORCE_NOISE: f64 = 2.0;

    fn columns() -> RegressorColumns {
        RegressorColumns {
            joints: 1,
            shared: 1,
            own: vec![vec![Own::Viscous, Own::Offset]],
            known: vec![None],
        }
    }

    fn settings() -> FilterSettings {
        FilterSettings {
            cutoff_hz: 30.0,
            // raw positions, so that their noise reaches the regressor
            q_order: 0,
            decimation: Some(5),
            ..FilterSettings::default()
        }
    }

    /// Ten seconds of a sliding joint: noise on position and force, and the reference beside it.
    fn log(noise: f64, seed: u64, with_reference: bool) -> Block {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
        let mut block = Block::default();
        for k in 0..5000 {
            let t = f64::from(k) * STEP;
            let parts = [(0.05, 5.0, 0.0), (0.02, 11.0, 1.0), (0.004, 29.0, 2.0)];
            let q: f64 = parts.iter().map(|(a, w, p)| a * (w * t + p).sin()).sum();
            let v: f64 = parts
                .iter()
                .map(|(a, w, p)| a * w * (w * t + p).cos())
                .sum();
            let a: f64 = parts
                .iter()
                .map(|(a, w, p)| -a * w * w * (w * t + p).sin())
                .sum();
            let tau = TRUTH[0] * a + TRUTH[1] * v + TRUTH[2];
            block.t.push(t);
            block.q.push(q + noise * draw());
            block.tau.push(tau + FORCE_NOISE * draw());
            if with_reference {
                block.q.push(q);
                block.tau.push(0.0);
            }
        }
        block
    }

    fn once(block: Block) -> impl FnMut(&mut Block) -> Result<bool, FitError> + Send {
        let mut left = Some(block);
        move |out| {
            Ok(match left.take() {
                Some(block) => {
                    *out = block;
                    true
                }
                None => false,
            })
        }
    }

    fn failed(error: RunError<FitError>) -> FitError {
        panic!("{error}")
    }

    fn plain(noise: f64, seed: u64) -> Fit {
        let robot = Robot::single_joint("q1", JointKind::Prismatic);
        let mut source = once(log(noise, seed, false));
        let (factors, _) =
            super::super::accumulate(&robot, &columns(), &settings(), &mut source).unwrap();
        fit(&factors, Weighting::Wls).unwrap()
    }

    fn instrumental(noise: f64, seed: u64, reference: ReferenceSource) -> Instrumental {
        let robot = Robot::single_joint("q1", JointKind::Prismatic);
        let start = plain(noise, seed);
        iterate(&columns(), &start, &mut |theta| {
            let mut source = once(log(noise, seed, reference == ReferenceSource::Logged));
            accumulate(
                &robot,
                &columns(),
                theta,
                reference,
                &settings(),
                STEP,
                &mut source,
            )
            .map(|read| read.factors)
            .map_err(failed)
        })
        .unwrap()
    }

    #[test]
    fn without_noise_in_position_instruments_change_nothing() {
        let (plain, found) = (plain(0.0, 1), instrumental(0.0, 1, ReferenceSource::Logged));
        assert_eq!(found.ending, Ending::Converged);
        for i in 0..3 {
            let std = plain.covariance[(i, i)].sqrt();
            assert!((plain.theta[i] - found.fit.theta[i]).abs() < std, "{i}");
        }
    }

    #[test]
    fn noisy_positions_bias_least_squares_and_not_instruments() {
        let noise = 1.5e-4;
        let (mut covered, mut mean, runs) = ([0; 3], [0.0; 2], 100);
        for seed in 0..runs {
            let found = instrumental(noise, seed, ReferenceSource::Logged).fit;
            mean[0] += plain(noise, seed).theta[0] / runs as f64;
            mean[1] += found.theta[0] / runs as f64;
            for (i, truth) in TRUTH.into_iter().enumerate() {
                let std = found.covariance[(i, i)].sqrt();
                covered[i] += u32::from((found.theta[i] - truth).abs() < 1.96 * std);
            }
        }
        assert!(mean[0] < 0.97 * TRUTH[0], "least squares: {}", mean[0]);
        assert!(
            (mean[1] / TRUTH[0] - 1.0).abs() < 0.003,
            "instruments: {}",
            mean[1]
        );
        // of 100 draws of 0.95 fewer than 87 come in 0.1 % of all tests
        assert!(covered.iter().all(|c| *c >= 87), "{covered:?}");
    }

    #[test]
    fn a_smoothed_reference_removes_most_of_the_bias() {
        let found = instrumental(1.5e-4, 3, ReferenceSource::Smoothed).fit;
        let (off, before) = (
            found.theta[0] - TRUTH[0],
            plain(1.5e-4, 3).theta[0] - TRUTH[0],
        );
        assert!(off.abs() < 0.3 * before.abs(), "{off} {before}");
    }
}
