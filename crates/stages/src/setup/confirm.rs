//! Gains on blocks of the logs that did not choose the hypothesis, by how many rows are independent.

use std::ops::Range;

use super::channels::Carried;
use super::correction::Correction;
use super::fit::{Fit, Power};
use super::normal::{Normal, Problem, own_column};
use cft_ident_core::robot::Robot;

/// Correlation below which rows count as independent.
const UNCORRELATED: f64 = 0.05;

/// A block that gains so many times what the median one does is counted as that.
const OUTLIER: f64 = 3.0;

/// Share of a gain that is one joint's alone.
const MOSTLY: f64 = 0.8;

/// What one hypothesis gains over another on held-out blocks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    /// Log-likelihood over all blocks, by independent rows.
    pub all: f64,
    /// The smaller one of its first and its second half.
    pub half: f64,
    /// How many of its own deviations the mean over the blocks is above zero: what is wrong everywhere is told
    /// everywhere.
    pub deviations: f64,
}

/// Gain of `after` over `before` on held-out blocks. `independent` is the share of the rows of each joint that are
/// worth an independent one.
pub(super) fn gain(
    (before, of_before, power_before): (&Fit, &Normal, &Power),
    (after, of_after, power_after): (&Fit, &Normal, &Power),
    independent: &[f64],
) -> Option<Gain> {
    let (b, a) = (before.held_out(of_before)?, after.held_out(of_after)?);
    let rows = of_after.rows as f64;
    let of_joint = |blocks: Range<usize>, j: usize| -> f64 {
        let [was, is] = [power_before.joints[j], power_after.joints[j]];
        if was <= 0.0 || is <= 0.0 || before.weights[j] == 0.0 {
            return 0.0;
        }
        let share = blocks.len() as f64 / b.len() as f64;
        let sum = |of: &[Vec<f64>]| of[blocks.clone()].iter().map(|x| x[j]).sum::<f64>();
        // beyond the torque itself a prediction is worth no more than none
        let left = |x: f64, power: f64| (x / (share * power)).clamp(1e-8, 1.0);
        let ratio = left(sum(&b), was) / left(sum(&a), is);
        0.5 * rows * share * independent[j] * ratio.ln()
    };
    let count = b.len();
    // what the joints' torques are of the channels' is of both hypotheses
    let active = before.weights.iter().zip(independent);
    let active = active.filter(|(w, _)| **w > 0.0).map(|(_, x)| *x);
    let mean = active.clone().sum::<f64>() / active.count().max(1) as f64;
    let sizes = 0.5 * rows * mean * (power_before.size - power_after.size) / count as f64;
    let of = |blocks: Range<usize>| -> f64 {
        let joints = 0..of_after.joints;
        let gains = joints.map(|j| of_joint(blocks.clone(), j));
        gains.sum::<f64>() + sizes * blocks.len() as f64
    };
    let all = of(0..count);
    let each = (0..count).map(|k| of(k..k + 1)).collect();
    let mut deviations = deviations(each);
    // a gain that is one joint's alone is told by its own blocks: the others' are noise beside it
    let alone = (0..of_after.joints).find(|j| of_joint(0..count, *j) > MOSTLY * all.max(0.0));
    if let Some(j) = alone {
        let each = (0..count).map(|k| of_joint(k..k + 1, j)).collect();
        deviations = deviations.max(self::deviations(each));
    }
    Some(Gain {
        all,
        half: of(0..count / 2).min(of(count / 2..count)),
        deviations,
    })
}

/// How many of its own deviations the mean gain of the blocks is above zero.
fn deviations(mut each: Vec<f64>) -> f64 {
    let count = each.len();
    let mut sizes: Vec<f64> = each.iter().map(|gain| gain.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    // one block that gains very much is no reason to doubt the others
    let most = OUTLIER * sizes.get(count / 2).copied().unwrap_or(0.0);
    each.iter_mut().for_each(|gain| *gain = gain.min(most));
    let mean = each.iter().sum::<f64>() / count as f64;
    let square: f64 = each.iter().map(|gain| (gain - mean).powi(2)).sum();
    let std = (square / (count * (count - 1).max(1)) as f64).sqrt();
    mean / std.max(f64::MIN_POSITIVE)
}

/// Of each joint, the share of the rows that are worth an independent one: one over the sum of the
/// correlations of its residual.
pub(super) fn independent(
    problem: &Problem,
    robot: &Robot,
    by: &Correction,
    fit: &Fit,
) -> Vec<f64> {
    let residual = residuals(problem, robot, by, fit);
    residual.iter().map(|r| share(r)).collect()
}

/// Residual of each joint, row after row.
fn residuals(problem: &Problem, robot: &Robot, by: &Correction, fit: &Fit) -> Vec<Vec<f64>> {
    let n = robot.joints();
    let p = robot.parameters().len();
    let theta: Vec<f64> = fit.theta.iter().take(p).copied().collect();
    let mut carried = Carried::new(n);
    let mut tau = vec![0.0; n];
    let mut out = vec![Vec::with_capacity(problem.sample.len()); n];
    for k in 0..problem.sample.len() {
        if !problem
            .channels
            .carry(robot, problem.sample.row(k), by, &mut carried)
        {
            continue;
        }
        robot.torque(&theta, &carried.q, &carried.v, &carried.a, &mut tau);
        for (j, out) in out.iter_mut().enumerate() {
            out.push(left(problem, robot, fit, &carried, j) - tau[j]);
        }
    }
    out
}

/// What a fit leaves of a joint's torque in a row, its inertial part not yet taken off.
pub(super) fn left(problem: &Problem, robot: &Robot, fit: &Fit, row: &Carried, j: usize) -> f64 {
    let n = robot.joints();
    let target = &fit.targets[j];
    let torques = row.tau[j * n..(j + 1) * n].iter();
    let mut r: f64 = torques.zip(target.iter()).map(|(x, w)| x * w).sum();
    if let Some(known) = problem.known_friction(row, j) {
        r += target[n] * known;
    }
    let first = problem.first_own(robot, j);
    for (i, own) in problem.columns.own[j].iter().enumerate() {
        r -= fit.theta[first + i] * own_column(*own, row, j);
    }
    r
}

fn share(r: &[f64]) -> f64 {
    let rows = r.len();
    let mean = r.iter().sum::<f64>() / rows.max(1) as f64;
    let power: f64 = r.iter().map(|x| (x - mean).powi(2)).sum();
    if rows < 8 || power <= 0.0 {
        return 1.0;
    }
    let mut sum = 1.0;
    for lag in 1..rows / 4 {
        let products = r
            .iter()
            .zip(&r[lag..])
            .map(|(a, b)| (a - mean) * (b - mean));
        let correlation = products.sum::<f64>() / power;
        if correlation < UNCORRELATED {
            break;
        }
        sum += 2.0 * correlation;
    }
    1.0 / sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_repeat_are_worth_fewer() {
        let mut x = 0x9e37_79b9_u64;
        let mut chance = || {
            x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (x >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let white: Vec<f64> = (0..2000).map(|_| chance()).collect();
        let held: Vec<f64> = white.iter().flat_map(|x| [*x; 5]).collect();
        let (one, five) = (share(&white), share(&held));
        assert!(one > 0.8 && (one / five - 5.0).abs() < 1.2, "{one} {five}");
    }

    #[test]
    fn a_block_that_gains_very_much_leaves_the_others_their_say() {
        let mut each = vec![1.0, 2.0, 1.5, 0.5, 1.2, 0.8, 1.1, 1.4];
        let plain = deviations(each.clone());
        each.push(1000.0);
        assert!(plain > 5.0 && deviations(each.clone()) > 4.0);
        // losses count in full
        each.push(-1000.0);
        assert!(deviations(each) < 0.0);
    }
}
