//! What no machine does: friction that drives a joint, and an inertia below zero that a joint's drive feels.

use nalgebra::{DMatrix, DVector};

use super::LIMITS;
use super::channels::Carried;
use super::problem::{Problem, own_column};
use super::trial::Trial;
use cft_ident_core::inertia::columns::Own;

/// Rows whose poses stand for all of them.
const POSES: usize = 60;

/// A joint whose friction drives it in all blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    pub joint: usize,
    /// Mean power \[W\], and its standard error.
    pub power: f64,
    pub std: f64,
}

/// What breaks physics in a fit.
#[derive(Debug, Clone, Default)]
pub(super) struct Broken {
    pub friction: Vec<Driven>,
    /// Joints whose inertia is below zero without any of the blocks.
    pub inertia: Vec<usize>,
}

impl Broken {
    /// Of a trial over these rows.
    pub fn of(problem: &Problem, trial: &Trial, rows: &[usize]) -> Self {
        let moving = |j: &usize| problem.moving()[*j];
        let joints: Vec<usize> = (0..trial.power.len()).filter(moving).collect();
        let inertia = inertias(problem, trial);
        let below = |j: &usize| is_below(trial, &inertia[*j]);
        Self {
            inertia: joints.iter().copied().filter(below).collect(),
            friction: (joints.iter())
                .filter_map(|j| driven(problem, trial, *j, rows))
                .collect(),
        }
    }

    /// Joints that are broken in both ways: a turned sign turns inertia and friction.
    pub fn turned(&self) -> Vec<usize> {
        let both = self.friction.iter().map(|d| d.joint);
        both.filter(|j| self.inertia.contains(j)).collect()
    }

    /// Whether nothing is broken that `other` has whole.
    pub fn is_within(&self, other: &Broken) -> bool {
        let friction = |d: &Driven| other.friction.iter().any(|o| o.joint == d.joint);
        self.friction.iter().all(friction) && self.inertia.iter().all(|j| other.inertia.contains(j))
    }
}

/// The mean inertia that each joint's drive feels, as weights of the unknowns.
fn inertias(problem: &Problem, trial: &Trial) -> Vec<DVector<f64>> {
    let robot = &trial.robot;
    let (n, p) = (robot.joints(), robot.parameters().len());
    let mut carried = Carried::new(n);
    let mut out = vec![DVector::zeros(trial.theta.len()); n];
    let (mut unit, still) = (vec![0.0; n], vec![0.0; n]);
    let (mut y, mut at_rest) = (vec![0.0; n * p], vec![0.0; n * p]);
    for k in problem.sample.spread(POSES) {
        if !(problem.channels).carry(robot, problem.sample.row(k), &trial.by, &mut carried) {
            continue;
        }
        robot.regressor(&carried.q, &still, &still, &mut at_rest);
        for j in 0..n {
            unit[j] = 1.0;
            robot.regressor(&carried.q, &still, &unit, &mut y);
            unit[j] = 0.0;
            for c in 0..p {
                out[j][c] += (y[j * p + c] - at_rest[j * p + c]) / POSES as f64;
            }
        }
    }
    out
}

/// Whether f' theta is below zero without any block, and beyond doubt by their scatter.
fn is_below(trial: &Trial, f: &DVector<f64>) -> bool {
    let values: Vec<f64> = trial.without.iter().map(|theta| f.dot(theta)).collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let scatter: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    let se = (scatter * (count - 1.0) / count).sqrt();
    values.iter().all(|x| *x < 0.0) && mean < -LIMITS.sure * se
}

/// Friction that drives a joint in every block: its terms fitted in each anew, all else held.
fn driven(problem: &Problem, trial: &Trial, j: usize, rows: &[usize]) -> Option<Driven> {
    let places = trial.places(j);
    let own = &problem.columns.own[j];
    let shared = places.len() - own.len();
    let blocks = trial.sums.len();
    let mut powers = Vec::new();
    for (b, sums) in trial.sums.iter().enumerate() {
        let rows = &rows[b * rows.len() / blocks..(b + 1) * rows.len() / blocks];
        let Some(weights) = power_of(problem, trial, j, rows) else { continue };
        let gram = &sums[j];
        let tau = places.len();
        let mut normal = DMatrix::from_fn(own.len(), own.len(), |i, k| gram[(shared + i, shared + k)]);
        for i in 0..own.len() {
            normal[(i, i)] *= 1.0 + 1e-6;
        }
        let right = DVector::from_fn(own.len(), |i, _| {
            let held: f64 = (0..shared).map(|c| gram[(shared + i, c)] * trial.theta[places[c]]).sum();
            gram[(shared + i, tau)] - held
        });
        if let Some(factor) = normal.cholesky() {
            powers.push(weights.dot(&factor.solve(&right)));
        }
    }
    let count = powers.len() as f64;
    let power = powers.iter().sum::<f64>() / count;
    let scatter: f64 = powers.iter().map(|x| (x - power).powi(2)).sum();
    let std = (scatter / (count - 1.0) / count).sqrt();
    let all = 2 * powers.len() >= blocks && powers.iter().all(|x| *x < 0.0);
    (all && power < -LIMITS.sure * std).then_some(Driven { joint: j, power, std })
}

/// Mean power of a joint's own terms in some rows, as weights; none where it goes one way only.
fn power_of(problem: &Problem, trial: &Trial, j: usize, rows: &[usize]) -> Option<DVector<f64>> {
    let own = &problem.columns.own[j];
    let mut carried = Carried::new(trial.robot.joints());
    let mut out = DVector::zeros(own.len());
    let mut ways = [0.0_f64; 2];
    for &k in rows {
        if !(problem.channels).carry(&trial.robot, problem.sample.row(k), &trial.by, &mut carried) {
            continue;
        }
        let v = carried.v[j];
        ways[usize::from(v > 0.0)] += v.abs();
        for (out, own) in out.iter_mut().zip(own) {
            if *own != Own::Offset {
                *out += v * own_column(*own, &carried, j) / rows.len() as f64;
            }
        }
    }
    let both = ways[0].min(ways[1]) > 0.2 * (ways[0] + ways[1]);
    both.then_some(out)
}
