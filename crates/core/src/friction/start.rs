//! Starts of the filter that come from the log itself.
//!
//! For given slopes `w1, w2` the torque is linear in everything else (Golub and Pereyra 1973, SIAM
//! J. Numer. Anal. 10, variable projection). A ladder of slope pairs is tried and the best are
//! polished. Torque and columns are averaged over short windows, a parallel filter that is the
//! same for both sides.

use crate::math::hyperbolic::tanh;
use nalgebra::{DMatrix, DVector};

use super::prepare::PreparedProblem;
use super::problem::FilterParameters;

/// Slopes of the ladder, geometric over the range.
const LADDER: usize = 14;
/// WindowAverages that the records are averaged into, and most samples of one.
const WINDOWS: usize = 800;
const LONGEST: usize = 20;
/// Rounds of the pattern search that polishes a pair of slopes.
const ROUNDS: usize = 10;

/// A start of the filter.
#[derive(Debug, Clone)]
pub struct FilterStart {
    pub parameters: FilterParameters,
    /// Squared residual of the linear fit; infinite where there was none.
    pub residual: f64,
}

/// The records averaged over windows: what stays the same for every pair of slopes.
struct WindowAverages {
    /// Number of nuisance columns.
    nuisance: usize,
    /// Rows of [nuisance, v, tau], row-major.
    rows: Vec<f64>,
    /// First sample and number of samples of each row's window.
    spans: Vec<(usize, usize)>,
    /// Velocity in the middle of each interval.
    velocity: Vec<f64>,
    torque_scale: f64,
}

impl WindowAverages {
    fn new(prepared: &PreparedProblem) -> Self {
        let problem = &prepared.problem;
        let e = problem.nuisance;
        let (fs, vs) = (problem.torque_scale, problem.velocity_scale);
        let (mut rows, mut spans, mut velocity) = (Vec::new(), Vec::new(), Vec::new());
        let mut first = 0;
        for record in &problem.records {
            let intervals = record.tau.len();
            let window = (intervals / WINDOWS).clamp(1, LONGEST);
            let middle = |x: &[f64], i: usize| 0.5 * (x[first + i] + x[first + i + 1]);
            let begin = velocity.len();
            velocity.extend((0..intervals).map(|i| middle(&prepared.velocity, i)));
            for k in (0..intervals / window).map(|w| w * window) {
                let at = rows.len();
                rows.resize(at + e + 2, 0.0);
                let row = &mut rows[at..];
                for i in k..k + window {
                    let a = middle(&prepared.acceleration, i);
                    let at = i * e..(i + 1) * e;
                    for ((x, m), h) in row.iter_mut().zip(&record.m[at.clone()]).zip(&record.h[at])
                    {
                        *x += m * a + h;
                    }
                    row[e] += velocity[begin + i] * fs / vs;
                    row[e + 1] += record.tau[i];
                }
                spans.push((begin + k, window));
            }
            first += record.t.len();
        }
        WindowAverages {
            nuisance: e,
            rows,
            spans,
            velocity,
            torque_scale: fs,
        }
    }

    /// Averages of tanh(w v) over the windows.
    fn tanh(&self, slope: f64) -> Vec<f64> {
        let of = |&(k, n): &(usize, usize)| {
            let each = self.velocity[k..k + n].iter().map(|v| tanh(slope * v));
            self.torque_scale * each.sum::<f64>()
        };
        self.spans.iter().map(of).collect()
    }

    /// Linear part for a pair of tanh columns, [nuisance, viscous, coulomb_1, coulomb_2], and the squared residual.
    fn solve(&self, one: &[f64], two: &[f64]) -> Option<(DVector<f64>, f64)> {
        let (e, n) = (self.nuisance, self.nuisance + 3);
        let mut gram = vec![0.0; (n + 1) * (n + 1)];
        let mut row = vec![0.0; n + 1];
        for (i, given) in self.rows.chunks_exact(e + 2).enumerate() {
            row[..=e].copy_from_slice(&given[..=e]);
            row[e + 1] = one[i];
            row[e + 2] = two[i];
            row[n] = given[e + 1];
            for (a, x) in row.iter().enumerate() {
                for (g, y) in gram[a * (n + 1)..].iter_mut().zip(&row[..=a]) {
                    *g += x * y;
                }
            }
        }
        let at = |i: usize, j: usize| gram[i.max(j) * (n + 1) + i.min(j)];
        let mut normal = DMatrix::from_fn(n, n, at);
        // against directions that the pair leaves open
        let ridge = 1e-9 * normal.diagonal().max();
        for i in 0..n {
            normal[(i, i)] += ridge;
        }
        let right = DVector::from_fn(n, |i, _| at(i, n));
        let x = normal.cholesky()?.solve(&right);
        let residual = at(n, n) - x.dot(&right);
        residual.is_finite().then_some((x, residual))
    }

    fn pair(&self, slopes: [f64; 2]) -> Option<(DVector<f64>, f64)> {
        self.solve(&self.tanh(slopes[0]), &self.tanh(slopes[1]))
    }
}

/// The best `most` pairs of slopes with their linear fits, pairs apart from one another.
pub(super) fn from_log(prepared: &PreparedProblem, most: usize) -> Vec<FilterStart> {
    let problem = &prepared.problem;
    let windows = WindowAverages::new(prepared);
    let (lo, hi) = problem.slope_range;
    // far beyond the inverse speed a slope is a sign function to averages over windows
    let hi = hi.min(300.0 / problem.velocity_scale).max(10.0 * lo);
    let rung = |i: usize| lo * (hi / lo).powf(i as f64 / (LADDER - 1) as f64);
    let ladder: Vec<f64> = (0..LADDER).map(rung).collect();
    let columns: Vec<Vec<f64>> = ladder.iter().map(|w| windows.tanh(*w)).collect();
    let mut pairs: Vec<(usize, usize, f64)> = (0..LADDER)
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .filter_map(|(i, j)| Some((i, j, windows.solve(&columns[i], &columns[j])?.1)))
        .collect();
    pairs.sort_by(|a, b| a.2.total_cmp(&b.2));
    let mut kept: Vec<(usize, usize)> = Vec::new();
    for (i, j, _) in pairs {
        let apart = |o: &(usize, usize)| o.0.abs_diff(i) + o.1.abs_diff(j) >= 3;
        if kept.len() < most && kept.iter().all(apart) {
            kept.push((i, j));
        }
    }
    let polished = |(i, j)| polish(prepared, &windows, [ladder[i], ladder[j]]);
    kept.into_iter().filter_map(polished).collect()
}

/// Pattern search over the logarithms of the slopes.
fn polish(
    prepared: &PreparedProblem,
    windows: &WindowAverages,
    slopes: [f64; 2],
) -> Option<FilterStart> {
    let problem = &prepared.problem;
    let (lo, hi) = problem.slope_range;
    let mut at = slopes;
    let mut best = windows.pair(at)?;
    let mut step = 1.35f64;
    for _ in 0..ROUNDS {
        let mut moved = false;
        for i in 0..2 {
            for factor in [step, 1.0 / step] {
                let mut trial = at;
                trial[i] = (trial[i] * factor).clamp(lo, hi);
                if let Some(found) = windows.pair(trial)
                    && found.1 < best.1
                {
                    (at, best, moved) = (trial, found, true);
                    break;
                }
            }
        }
        if !moved {
            step = step.sqrt();
        }
    }
    let e = problem.nuisance;
    let (eta, linear) = best.0.as_slice().split_at(e);
    let slopes = at.map(|slope| (slope * problem.velocity_scale).ln());
    Some(FilterStart {
        parameters: [linear, &slopes, eta].concat(),
        residual: best.1,
    })
}

/// Nuisance that gives a constant inertia as nearly as this motion's columns can, and no gravity.
pub(super) fn constant_inertia(prepared: &PreparedProblem, inertia: f64) -> Vec<f64> {
    let e = prepared.problem.nuisance;
    let mut normal = DMatrix::<f64>::zeros(e, e);
    let mut right = DVector::<f64>::zeros(e);
    let mut count = 0.0;
    for record in &prepared.problem.records {
        for m in record.m.chunks_exact(e).step_by(8) {
            let m = DVector::from_column_slice(m);
            normal.ger(1.0, &m, &m, 1.0);
            right.axpy(inertia, &m, 1.0);
            count += 1.0;
        }
    }
    let ridge = 1e-6 * (normal.diagonal().max() + count * f64::MIN_POSITIVE);
    for i in 0..e {
        normal[(i, i)] += ridge;
    }
    match normal.cholesky() {
        Some(c) => c.solve(&right).as_slice().to_vec(),
        None => vec![0.0; e],
    }
}
