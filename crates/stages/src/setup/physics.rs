//! What no machine does: friction that drives a joint, and an inertia below zero that a joint's drive feels.

use nalgebra::DVector;

use super::LIMITS;
use super::channels::Carried;
use super::problem::{Problem, own_column};
use super::trial::Trial;
use cft_ident_core::inertia::columns::Own;

/// Rows whose poses stand for all of them.
const POSES: usize = 60;
/// Rows whose motion stands for all of them.
const MOTIONS: usize = 500;

/// A smaller share of its way in the other direction does not tell friction from a constant torque.
const OTHER_WAY: f64 = 0.1;

/// A joint whose friction drives it, whichever block is left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    pub joint: usize,
    /// Mean power \[W\], and its standard error.
    pub power: f64,
    pub std: f64,
}

/// What breaks physics in a fit, whichever block is left out.
#[derive(Debug, Clone, Default)]
pub(super) struct Broken {
    pub friction: Vec<Driven>,
    /// Joints whose inertia is below zero.
    inertia: Vec<usize>,
}

impl Broken {
    /// Of a trial.
    pub fn of(problem: &Problem, trial: &Trial) -> Self {
        let joints: Vec<usize> = problem.channels_that_move();
        let inertia = inertias(problem, trial);
        let power = powers(problem, trial);
        let driven = |j: &usize| {
            let (power, std) = below(trial, power[*j].as_ref()?)?;
            Some(Driven {
                joint: *j,
                power,
                std,
            })
        };
        Self {
            friction: joints.iter().filter_map(driven).collect(),
            inertia: (joints.iter().copied())
                .filter(|j| below(trial, &inertia[*j]).is_some())
                .collect(),
        }
    }

    /// Joints that are broken in both ways: a turned sign turns inertia and friction.
    pub fn turned(&self) -> Vec<usize> {
        let both = self.friction.iter().map(|d| d.joint);
        both.filter(|j| self.inertia.contains(j)).collect()
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

/// The mean power of each joint's friction, as weights of the unknowns; none of a joint that goes one way only.
fn powers(problem: &Problem, trial: &Trial) -> Vec<Option<DVector<f64>>> {
    let n = trial.robot.joints();
    let mut carried = Carried::new(n);
    let mut out = vec![DVector::zeros(trial.theta.len()); n];
    let mut ways = vec![[0.0_f64; 2]; n];
    let rows = problem.sample.spread(MOTIONS);
    for &k in &rows {
        if !(problem.channels).carry(&trial.robot, problem.sample.row(k), &trial.by, &mut carried) {
            continue;
        }
        for j in 0..n {
            let v = carried.v[j];
            ways[j][usize::from(v > 0.0)] += v.abs();
            let first = problem.first_own(&trial.robot, j);
            for (i, own) in problem.columns.own[j].iter().enumerate() {
                if *own != Own::Offset {
                    out[j][first + i] += v * own_column(*own, &carried, j) / rows.len() as f64;
                }
            }
        }
    }
    let both = |[a, b]: &[f64; 2]| a.min(*b) > OTHER_WAY * (a + b);
    let pairs = out.into_iter().zip(&ways);
    pairs.map(|(f, ways)| both(ways).then_some(f)).collect()
}

/// f' theta and its standard error where it is below zero whichever block is left out, and beyond doubt.
fn below(trial: &Trial, f: &DVector<f64>) -> Option<(f64, f64)> {
    let values: Vec<f64> = trial.without.iter().map(|theta| f.dot(theta)).collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let scatter: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    let std = (scatter * (count - 1.0) / count).sqrt();
    let all = values.iter().all(|x| *x < 0.0);
    (all && mean < -LIMITS.sure * std).then_some((mean, std))
}
