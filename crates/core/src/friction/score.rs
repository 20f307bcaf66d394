//! The same filter at fixed parameters: likelihood, score and information.
//!
//! An extended filter that learns its parameters on the way linearises early samples at wrong
//! ones, and is surer than it may be. Here the parameters stand still; the states are filtered,
//! their sensitivities to the parameters are carried along (the prediction-error method: Ljung
//! 1979, IEEE TAC 24, "Asymptotic behavior of the extended Kalman filter"), and score and Gauss-
//! Newton information are summed over innovations. At the maximum the inverse information is the
//! covariance of the augmented filter linearised there; sums over blocks of the score give what a
//! coloured residual adds to it.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::problem::{FRICTION, FrictionProblem, JointRecord, NoiseLevels};
use super::propagate::{
    SampleInterval, ScaledLaw, StateTransition, known, state, with_sensitivities,
};

/// Result of a pass at fixed parameters.
#[derive(Debug, Clone)]
pub struct LikelihoodScore {
    /// Gaussian log-likelihood of the innovations (less the constant).
    pub log_likelihood: f64,
    /// Gradient of the log-likelihood.
    pub gradient: DVector<f64>,
    /// Gauss-Newton information matrix.
    pub information: DMatrix<f64>,
    /// Sum over blocks of the outer product of the block's gradient.
    pub outer: DMatrix<f64>,
    /// Number of blocks in `outer`.
    pub blocks: usize,
    pub mean_nis: f64,
    /// Share of innovations inside their 95 % bound.
    pub share_inside: f64,
    /// Mean normalised square of innovations summed over windows, and the number of windows.
    pub window_nis: f64,
    pub windows: usize,
}

/// Two-state covariance (qq, qv, vv) at the first sample of a record.
fn first_covariance(
    problem: &FrictionProblem,
    record: &JointRecord,
    noise: NoiseLevels,
) -> [f64; 3] {
    let speed = 0.1 * problem.velocity_scale;
    [record.r[0] * noise.position_factor, 0.0, speed.powi(2)]
}

/// Two-state covariance (qq, qv, vv), predicted over one interval by dq/dv, dv/dv, dq/dtau and dv/dtau.
#[inline(always)]
fn predict(p: [f64; 3], [q_v, v_v, n_q, n_v]: [f64; 4], s2: f64) -> [f64; 3] {
    [
        p[0] + 2.0 * q_v * p[1] + q_v * q_v * p[2] + s2 * n_q * n_q,
        v_v * (p[1] + q_v * p[2]) + s2 * n_q * n_v,
        v_v * v_v * p[2] + s2 * n_v * n_v,
    ]
}

/// Innovation update of the two-state covariance; returns the gains.
#[inline(always)]
fn update(p: &mut [f64; 3], s: f64) -> (f64, f64) {
    let (kq, kv) = (p[0] / s, p[1] / s);
    // Joseph's form for H = (1, 0)
    let r = s - p[0];
    let c = r / s;
    *p = [
        c * c * p[0] + kq * kq * r,
        c * p[1] - kv * p[0] * c + kq * kv * r,
        p[2] - 2.0 * kv * p[1] + kv * kv * s,
    ];
    (kq, kv)
}

/// Innovations in a window.
const WINDOW: usize = 50;
/// Fewest windows at speed that stand for a log.
const FEWEST: usize = 30;

/// Normalised innovations summed over windows.
// White ones of unit variance sum to a variance of their number; a model that lacks something leaves innovations that
// are alike for many samples, and that the noise levels, being estimated, cannot absorb. Where the joint moves by less
// than an encoder step per sample the rounding error is alike too: such windows count only in a log that has no others.
#[derive(Debug, Clone, Copy, Default)]
struct InnovationWindows {
    sum: f64,
    length: usize,
    slow: bool,
    /// Sum of squares and number of windows: at speed, and of all.
    fast: (f64, usize),
    all: (f64, usize),
}

impl InnovationWindows {
    #[inline(always)]
    fn add(&mut self, normalised: f64, travel: f64, variance: f64) {
        self.sum += normalised;
        self.length += 1;
        // the step of a rounded position is the root of twelve variances
        self.slow |= travel * travel < 12.0 * variance;
        if self.length == WINDOW {
            let square = self.sum * self.sum / WINDOW as f64;
            self.all = (self.all.0 + square, self.all.1 + 1);
            if !self.slow {
                self.fast = (self.fast.0 + square, self.fast.1 + 1);
            }
            (self.sum, self.length, self.slow) = (0.0, 0, false);
        }
    }

    /// Adds the windows that another record closed.
    fn add_counted(&mut self, other: &Self) {
        self.fast = (self.fast.0 + other.fast.0, self.fast.1 + other.fast.1);
        self.all = (self.all.0 + other.all.0, self.all.1 + other.all.1);
    }

    fn mean(&self) -> (f64, usize) {
        let fast = self.fast.1 >= FEWEST;
        let (sum, count) = if fast { self.fast } else { self.all };
        (sum / count as f64, count)
    }
}

/// Derivatives of the states by the parameters.
struct StateSensitivities {
    q: Vec<f64>,
    v: Vec<f64>,
}

impl StateSensitivities {
    #[inline(always)]
    fn propagate(&mut self, t: &StateTransition) {
        let inputs = t.b_q.iter().zip(&t.b_v);
        for ((q, v), (b_q, b_v)) in self.q.iter_mut().zip(&mut self.v).zip(inputs) {
            *q += t.q_v * *v + b_q;
            *v = t.v_v * *v + b_v;
        }
    }

    #[inline(always)]
    fn update(&mut self, kq: f64, kv: f64) {
        for (q, v) in self.q.iter_mut().zip(&mut self.v) {
            let w = *q;
            *q -= kq * w;
            *v -= kv * w;
        }
    }
}

/// Likelihood, score and information of `parameters`. `block` is the number of samples over which
/// the score is summed before its outer product is taken. Records know nothing of one another: they
/// run in parallel, and are added in their order, so that threads change nothing.
pub fn score(
    problem: &FrictionProblem,
    parameters: &[f64],
    noise: NoiseLevels,
    block: usize,
) -> LikelihoodScore {
    let law = ScaledLaw::new(problem, parameters);
    let parts: Vec<RecordScore> = problem
        .records
        .par_iter()
        .map(|record| of_record(problem, record, &law, parameters, noise, block))
        .collect();
    let mut sum = RecordScore::none(problem.parameters());
    for part in &parts {
        sum.add(part);
    }
    sum.whole()
}

/// Sums over one record or several.
struct RecordScore {
    log_likelihood: f64,
    gradient: DVector<f64>,
    outer: DMatrix<f64>,
    blocks: usize,
    innovations: usize,
    windows: InnovationWindows,
    /// Lower triangle of the information, row-major.
    information: Vec<f64>,
    nis: f64,
    inside: usize,
}

impl RecordScore {
    fn none(parameters: usize) -> Self {
        RecordScore {
            log_likelihood: 0.0,
            gradient: DVector::zeros(parameters),
            outer: DMatrix::zeros(parameters, parameters),
            blocks: 0,
            innovations: 0,
            windows: InnovationWindows::default(),
            information: vec![0.0; parameters * parameters],
            nis: 0.0,
            inside: 0,
        }
    }

    fn add(&mut self, other: &Self) {
        self.log_likelihood += other.log_likelihood;
        self.gradient += &other.gradient;
        self.outer += &other.outer;
        self.blocks += other.blocks;
        self.innovations += other.innovations;
        for (a, b) in self.information.iter_mut().zip(&other.information) {
            *a += b;
        }
        self.windows.add_counted(&other.windows);
        self.nis += other.nis;
        self.inside += other.inside;
    }

    /// Takes the gradient of a block, and leaves none.
    fn close_block(&mut self, part: &mut DVector<f64>) {
        self.outer.ger(1.0, part, part, 1.0);
        self.gradient += &*part;
        self.blocks += 1;
        part.fill(0.0);
    }

    fn whole(self) -> LikelihoodScore {
        let np = self.gradient.len();
        let at = |i: usize, j: usize| self.information[i.max(j) * np + i.min(j)];
        let n = self.innovations.max(1) as f64;
        let (window_nis, windows) = self.windows.mean();
        LikelihoodScore {
            log_likelihood: self.log_likelihood,
            gradient: self.gradient,
            information: DMatrix::from_fn(np, np, at),
            outer: self.outer,
            blocks: self.blocks,
            mean_nis: self.nis / n,
            share_inside: self.inside as f64 / n,
            window_nis,
            windows,
        }
    }
}

fn of_record(
    problem: &FrictionProblem,
    record: &JointRecord,
    law: &ScaledLaw,
    parameters: &[f64],
    noise: NoiseLevels,
    block: usize,
) -> RecordScore {
    let np = problem.parameters();
    let mut out = RecordScore::none(np);
    let mut t = StateTransition::new(np);
    let s2 = noise.torque * noise.torque;
    let mut w = StateSensitivities {
        q: vec![0.0; np],
        v: vec![0.0; np],
    };
    let mut part = DVector::zeros(np);
    let (mut q, mut v) = (record.y[0], record.v0);
    let mut p = first_covariance(problem, record, noise);
    for k in 0..record.tau.len() {
        let interval = SampleInterval::of(record, k, problem.nuisance);
        let least = problem.least_inertia;
        (q, v) = with_sensitivities(law, parameters, &interval, least, q, v, &mut t);
        p = predict(p, [t.q_v, t.v_v, t.n_q, t.n_v], s2);
        w.propagate(&t);
        let s = p[0] + record.r[k + 1] * noise.position_factor;
        let innovation = record.y[k + 1] - q;
        let (kq, kv) = update(&mut p, s);
        q += kq * innovation;
        v += kv * innovation;
        let z = innovation * innovation / s;
        out.log_likelihood -= 0.5 * (z + s.ln());
        out.nis += z;
        let travel = v.abs() * interval.dt;
        out.windows
            .add(innovation / s.sqrt(), travel, record.r[k + 1]);
        out.inside += usize::from(z < CHI2_95);
        out.innovations += 1;
        // d(innovation)/dp = -w; score = w nu / s, information = w w' / s
        let g = innovation / s;
        for i in 0..np {
            part[i] += w.q[i] * g;
            let wi = w.q[i] / s;
            let row = &mut out.information[i * np..i * np + i + 1];
            for (a, w) in row.iter_mut().zip(&w.q[..=i]) {
                *a += wi * w;
            }
        }
        w.update(kq, kv);
        if (k + 1) % block.max(1) == 0 {
            out.close_block(&mut part);
        }
    }
    // the last, shorter block
    out.close_block(&mut part);
    out
}

/// 95 % point of chi-squared with one degree of freedom.
const CHI2_95: f64 = 3.841_458_820_694_124;

/// Log-likelihood alone, at a quarter of the cost.
pub(super) fn log_likelihood(
    problem: &FrictionProblem,
    parameters: &[f64],
    noise: NoiseLevels,
) -> f64 {
    let law = ScaledLaw::new(problem, parameters);
    let parts: Vec<f64> = problem
        .records
        .par_iter()
        .map(|record| likelihood_of_record(problem, record, &law, parameters, noise))
        .collect();
    parts.iter().sum()
}

fn likelihood_of_record(
    problem: &FrictionProblem,
    record: &JointRecord,
    law: &ScaledLaw,
    parameters: &[f64],
    noise: NoiseLevels,
) -> f64 {
    let eta = &parameters[FRICTION..];
    let s2 = noise.torque * noise.torque;
    let mut sum = 0.0;
    let (mut q, mut v) = (record.y[0], record.v0);
    let mut p = first_covariance(problem, record, noise);
    for k in 0..record.tau.len() {
        let interval = SampleInterval::of(record, k, problem.nuisance);
        let (start_v, dt) = (v, interval.dt);
        let (minv, _) = known(&interval, eta, problem.least_inertia);
        (q, v) = state(law, eta, &interval, problem.least_inertia, q, v);
        // one mean decay over the interval serves the covariance
        let decay = 0.5 * (law.slope_at(start_v) + law.slope_at(v)) * minv * dt;
        p = predict(p, decayed(decay, dt, minv), s2);
        let s = p[0] + record.r[k + 1] * noise.position_factor;
        let innovation = record.y[k + 1] - q;
        let (kq, kv) = update(&mut p, s);
        q += kq * innovation;
        v += kv * innovation;
        sum -= 0.5 * (innovation * innovation / s + s.ln());
    }
    sum
}

/// (dq/dv, dv/dv, dq/dtau, dv/dtau) of an interval with total decay `x`.
#[inline(always)]
fn decayed(x: f64, dt: f64, minv: f64) -> [f64; 4] {
    let whole = (-x).exp();
    let (a, b) = if x.abs() < 1e-3 {
        (1.0 - x / 2.0 + x * x / 6.0, 0.5 - x / 6.0 + x * x / 24.0)
    } else {
        ((1.0 - whole) / x, (x - 1.0 + whole) / (x * x))
    };
    [dt * a, whole, minv * dt * dt * b, minv * dt * a]
}
