//! Numbers of a model of one axis by least squares of simulated positions.
//!
//! Windows of one length begin every quarter of it at measured states (multiple shooting, Bock 1983, with the states
//! as measured), so that no choice of where they begin decides the result. Gauss-Newton steps, damped (Levenberg
//! 1944, Marquardt 1963), by differences of simulated positions. Errors of neighbouring windows are alike, so that
//! deviations are those of the sum of their scores (Newey and West 1987).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::abreast::ParallelWindows;
use super::numbers::{Columns, numbers, with_numbers};
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::math::descent::{IterationEnding, StepControl, Trial, descend};
use cft_ident_core::math::long_run::long_run;
use cft_ident_core::math::rank_revealing::RankRevealingInverse;
use cft_ident_core::motion::Stretch;

/// Longest step of the simulation \[s\].
const STEP_S: f64 = 1e-3;
/// Windows that begin within the length of one.
pub(super) const HOPS: usize = 4;
/// Samples that the windows of a fit hold; of longer logs they are spread all along.
const MOST_SAMPLES: usize = 500_000;
/// Positions of a window that count.
pub(super) const POSITIONS: usize = 50;
const MAX_STEPS: usize = 40;
/// Share of the cost below which a step brings nothing.
const MIN_COST_DECREASE: f64 = 1e-4;
const DAMPING: StepControl = StepControl::damping(6.0, 4.0, [1e-6, 1e8]);

/// A span of a stretch: its number, first sample and the one after the last.
pub type RunSpan = (usize, usize, usize);

/// Windows of so many seconds in spans of stretches.
pub(super) fn windows(stretches: &[Stretch], spans: &[RunSpan], length_s: f64) -> Vec<RunSpan> {
    let total: usize = spans.iter().map(|(_, from, to)| to - from).sum();
    let mut all = Vec::new();
    for &(s, from, to) in spans {
        let size = (length_s / stretches[s].dt).round() as usize + 1;
        let Some(room) = (to - from).checked_sub(size) else {
            continue;
        };
        let most = MOST_SAMPLES * (to - from) / (total * size);
        let count = (room / (size / HOPS).max(1)).min(most.max(1));
        // spread, so that the last ends with the span
        all.extend((0..=count).map(|i| {
            let begin = from + (i * room).checked_div(count).unwrap_or(0);
            (s, begin, begin + size)
        }));
    }
    all
}

/// Every how many samples of a window a position counts, from its last one on.
fn every(begin: usize, end: usize, positions: usize) -> usize {
    ((end - begin) / positions).max(1)
}

/// Errors of simulated positions \[m or rad\] in windows, one after the other; none where a motion goes astray.
pub(super) fn errors(
    model: &AugmentedModel,
    stretches: &[Stretch],
    windows: &[RunSpan],
    positions: usize,
) -> Option<Vec<f64>> {
    let alike = windows.chunk_by(|a, b| a.0 == b.0 && a.2 - a.1 == b.2 - b.1);
    let found =
        alike.map(|windows| side_by_side(model, &stretches[windows[0].0], windows, positions));
    Some(found.collect::<Option<Vec<_>>>()?.concat())
}

/// The same of windows of one length in one stretch.
fn side_by_side(
    model: &AugmentedModel,
    stretch: &Stretch,
    windows: &[RunSpan],
    positions: usize,
) -> Option<Vec<f64>> {
    let size = windows[0].2 - windows[0].1;
    let every = every(0, size, positions);
    let parts = (stretch.dt / STEP_S).ceil().max(1.0);
    let begins = windows.iter().map(|w| w.1);
    let mut abreast = ParallelWindows::begin(model, stretch, begins.clone(), stretch.dt / parts);
    let (q, tau) = (&stretch.q[0], &stretch.tau[0]);
    let mut now = vec![0.0; windows.len()];
    let kept = (size - 1) / every + 1;
    let mut out = vec![0.0; kept * windows.len()];
    let mut place = 0;
    for k in 0..size {
        if k > 0 {
            for part in 0..parts as usize {
                let share = (part as f64 + 0.5) / parts;
                for (now, begin) in now.iter_mut().zip(begins.clone()) {
                    let (before, after) = (tau[begin + k - 1], tau[begin + k]);
                    *now = before + share * (after - before);
                }
                if !abreast.step(&now) {
                    return None;
                }
            }
        }
        if (size - 1 - k).is_multiple_of(every) {
            for (i, (found, begin)) in abreast.positions().iter().zip(begins.clone()).enumerate() {
                out[i * kept + place] = found - q[begin + k];
            }
            place += 1;
        }
    }
    Some(out)
}

pub(super) fn rms(e: &[f64]) -> f64 {
    (e.iter().map(|e| e * e).sum::<f64>() / e.len().max(1) as f64).sqrt()
}

/// A model that was fitted to rolled-out windows.
#[derive(Debug, Clone)]
pub(super) struct WindowFit {
    pub model: AugmentedModel,
    /// Root mean square of the positions' errors \[m or rad\].
    pub rms: f64,
    pub ending: IterationEnding,
    pub steps: usize,
    /// Of all numbers, where it is wanted; zero rows of what was not moved.
    pub covariance: DMatrix<f64>,
}

/// A point of the iteration: unknowns, errors there, and their slopes.
struct FitPoint {
    x: Vec<f64>,
    errors: DVector<f64>,
    slopes: DMatrix<f64>,
}

/// Fits the free numbers, from those that the model has; none where the first motion goes astray.
pub(super) fn fit(
    start: &AugmentedModel,
    stretches: &[Stretch],
    windows: &[RunSpan],
    columns: &Columns,
    with_covariance: bool,
) -> Option<WindowFit> {
    let along = |x: &[f64]| errors(&with_numbers(start, x), stretches, windows, POSITIONS);
    let free = &columns.free;
    let slopes = |x: &[f64], at: &DVector<f64>, both: bool| -> Option<DMatrix<f64>> {
        let column = |i: &usize| {
            let beside = |step: f64| {
                let mut x = x.to_vec();
                x[*i] += step;
                along(&x).map(DVector::from_vec)
            };
            let step = columns.steps[*i];
            match both {
                true => Some((beside(step)? - beside(-step)?) / (2.0 * step)),
                false => Some((beside(step)? - at) / step),
            }
        };
        let found: Option<Vec<_>> = free.par_iter().map(column).collect();
        Some(DMatrix::from_columns(&found?))
    };
    let point = |x: Vec<f64>, errors: DVector<f64>| {
        let slopes = slopes(&x, &errors, false)?;
        Some(FitPoint { x, errors, slopes })
    };
    let x = numbers(start);
    let begun = DVector::from_vec(along(&x)?);
    let begun = point(x, begun)?;
    let found = descend(begun, &DAMPING, MAX_STEPS, &mut |at: &FitPoint, damping| {
        let mut normal = at.slopes.tr_mul(&at.slopes);
        let target = at.slopes.tr_mul(&at.errors);
        for i in 0..free.len() {
            normal[(i, i)] *= 1.0 + damping;
        }
        let Some(factor) = normal.cholesky() else {
            return Ok::<_, std::convert::Infallible>(Trial::Rejected);
        };
        let step = factor.solve(&target);
        let mut x = at.x.clone();
        free.iter().zip(step.iter()).for_each(|(i, s)| x[*i] -= s);
        let before = at.errors.norm_squared();
        let Some(errors) = along(&x).map(DVector::from_vec) else {
            return Ok(Trial::Rejected);
        };
        let gain = before - errors.norm_squared();
        if gain.is_nan() || gain <= 0.0 {
            return Ok(Trial::Rejected);
        }
        if gain < MIN_COST_DECREASE * before {
            // nearly those of the point before, and nothing moves by them any more
            let slopes = at.slopes.clone();
            return Ok(Trial::Last(FitPoint { x, errors, slopes }));
        }
        Ok(point(x, errors).map_or(Trial::Rejected, Trial::Accepted))
    });
    let Ok((mut at, ending, steps)) = found;
    let mut of_all = DMatrix::zeros(0, 0);
    if with_covariance {
        // differences to both sides where deviations depend on them
        at.slopes = slopes(&at.x, &at.errors, true)?;
        of_all = covariance(&at, stretches, windows, free);
    }
    Some(WindowFit {
        rms: rms(at.errors.as_slice()),
        model: with_numbers(start, &at.x),
        ending,
        steps,
        covariance: of_all,
    })
}

/// Windows behind one another that spans of stretches hold.
pub(super) fn apart(windows: &[RunSpan], stretches: &[Stretch], length_s: f64) -> f64 {
    let spans = (0..stretches.len()).filter_map(|s| {
        let of = || windows.iter().filter(|w| w.0 == s);
        let (from, to) = (of().map(|w| w.1).min()?, of().map(|w| w.2).max()?);
        Some((to - from) as f64 * stretches[s].dt)
    });
    (spans.sum::<f64>() / length_s).min(windows.len() as f64)
}

/// Covariance of the numbers by the sum of the windows' scores.
fn covariance(
    at: &FitPoint,
    stretches: &[Stretch],
    windows: &[RunSpan],
    free: &[usize],
) -> DMatrix<f64> {
    let normal = at.slopes.tr_mul(&at.slopes);
    let inverse = RankRevealingInverse::of(&normal);
    let mut first = 0;
    let score = |&(s, begin, end): &RunSpan| {
        let size = (end - begin - 1) / every(begin, end, POSITIONS) + 1;
        let rows = at.slopes.rows(first, size);
        let score = rows.tr_mul(&at.errors.rows(first, size));
        first += size;
        (s, score)
    };
    let scores: Vec<(usize, DVector<f64>)> = windows.iter().map(score).collect();
    // windows overlap, and those that do not are still alike where they touch
    let sum = long_run(&scores, free.len(), 2.0 * HOPS as f64);
    let length = windows
        .first()
        .map_or(1.0, |w| (w.2 - w.1 - 1) as f64 * stretches[w.0].dt);
    let independent = apart(windows, stretches, length);
    let spent = independent / (independent - free.len() as f64).max(1.0);
    let of_free = inverse.times(&sum) * inverse.matrix() * spent.max(1.0);
    let mut all = DMatrix::zeros(at.x.len(), at.x.len());
    for (a, i) in free.iter().enumerate() {
        for (b, j) in free.iter().enumerate() {
            all[(*i, *j)] = of_free[(a, b)];
        }
    }
    all
}
