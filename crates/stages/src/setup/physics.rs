//! What no machine does: friction that drives a joint, and an inertia below zero that a joint's drive feels.

use nalgebra::DVector;

use super::LIMITS;
use super::channels::Carried;
use super::problem::Problem;
use super::trial::Trial;
use cft_ident_core::inertia::columns::JointTerm;
use cft_ident_core::judge::{NUMBERS, PARTS};

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
    /// Joints that are broken in both ways: a turned sign turns inertia and friction.
    pub turned: Vec<usize>,
}

impl Broken {
    /// Of a trial.
    pub fn of(problem: &Problem, trial: &Trial) -> Self {
        let driven = |joint: usize| {
            let (power, std) = below(trial, &friction_power(problem, trial, joint)?)?;
            Some(Driven { joint, power, std })
        };
        let joints = problem.channels_that_move();
        let friction: Vec<Driven> = joints.into_iter().filter_map(driven).collect();
        let inertia = match friction.is_empty() {
            true => Vec::new(),
            false => inertias(problem, trial),
        };
        let both = friction.iter().map(|driven| driven.joint);
        let turned = both.filter(|j| below(trial, &inertia[*j]).is_some());
        Self {
            turned: turned.collect(),
            friction,
        }
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
    for k in (0..problem.sample.len()).step_by(problem.few()) {
        if !(problem.channels).carry(robot, problem.sample.row(k), &trial.by, &mut carried) {
            continue;
        }
        robot.regressor(&carried.q, &still, &still, &mut at_rest);
        for j in 0..n {
            unit[j] = 1.0;
            robot.regressor(&carried.q, &still, &unit, &mut y);
            unit[j] = 0.0;
            for c in 0..p {
                out[j][c] += y[j * p + c] - at_rest[j * p + c];
            }
        }
    }
    out
}

/// Mean power of a joint's friction, as weights of the unknowns; none of a joint that goes one way only.
fn friction_power(problem: &Problem, trial: &Trial, joint: usize) -> Option<DVector<f64>> {
    let own = &problem.columns.own[joint];
    let first = problem.first_own(&trial.robot, joint);
    let sums = &trial.total[joint];
    let column = |of: JointTerm| {
        let at = own.iter().position(|o| *o == of)?;
        Some(sums.nrows() - 1 - own.len() + at)
    };
    let speed = column(JointTerm::Viscous)?;
    if let (Some(one), Some(sign)) = (column(JointTerm::Offset), column(JointTerm::Coulomb)) {
        // the way there and back, and what of it is left
        let (way, net) = (sums[(speed, sign)], sums[(speed, one)]);
        if net.abs() > (1.0 - 2.0 * LIMITS.same) * way {
            return None;
        }
    }
    let mut out = DVector::zeros(trial.theta.len());
    for (i, of) in own
        .iter()
        .enumerate()
        .filter(|(_, of)| **of != JointTerm::Offset)
    {
        out[first + i] = sums[(speed, column(*of)?)] / trial.rows.count as f64;
    }
    Some(out)
}

/// f' theta and its standard error where it is below zero whichever block is left out, and beyond doubt.
fn below(trial: &Trial, f: &DVector<f64>) -> Option<(f64, f64)> {
    let values: Vec<f64> = trial.without.iter().map(|theta| f.dot(theta)).collect();
    let (mean, std) = jackknife(&values);
    let all = values.iter().all(|x| *x < 0.0);
    // as sure as an agreement of parts
    let beyond = mean * mean * (1.0 - NUMBERS.confirmed) > PARTS.doubt * std * std;
    (all && beyond).then_some((mean, std))
}

/// Mean and standard error of values of which each leaves out one block.
pub(super) fn jackknife(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let scatter: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    (mean, (scatter * (count - 1.0) / count).sqrt())
}
