//! Logs that are not of one machine: what one fit leaves of them, beside a fit of one log and a fit of the others.

use nalgebra::{DMatrix, DVector};

use super::accumulate::{BlockFactor, BlockFactors, JointRows};
use super::solution::{FitError, residual_std, solve};
use super::solve::weights_of;

/// The numbers that decide whether a log disagrees with the others.
struct BetweenLogNumbers {
    /// How many times as large the residual of a joint is by one fit as by two. Half: the misfit of any model, which two fits
    /// follow better than one, is a disagreement; twice: a payload of a fifth of the arm is none.
    times: f64,
    /// Least part of a joint's torque that it adds. Half: what a warm gear does from log to log is named; twice: friction
    /// that differs by a fourth is not.
    size: f64,
    /// Logs that are asked at most, those with the greatest residual: each takes two fits.
    asked: usize,
}

const NUMBERS: BetweenLogNumbers = BetweenLogNumbers {
    times: 2.0,
    size: 0.02,
    asked: 8,
};

/// A log that disagrees with the others, and the joint at which it does so most.
#[derive(Debug, Clone, PartialEq)]
pub struct DisagreeingLog {
    /// Its place among the logs.
    pub log: usize,
    pub joint: usize,
    /// Relative residual of the joint in this log by the fit of all logs, and by its own.
    pub own: [f64; 2],
    /// The same in the others.
    pub others: [f64; 2],
}

/// The log that disagrees most with the others, of the rows of each in one block; none where one fit does for all.
///
/// # Errors
/// [`FitError`].
pub fn disagreeing_log(factors: &BlockFactors) -> Result<Option<DisagreeingLog>, FitError> {
    let logs = factors.blocks.len();
    if logs < 2 {
        return Ok(None);
    }
    let parts: Vec<BlockFactors> = (0..logs)
        .map(|k| factors.of_blocks(|log| log == k))
        .collect();
    let all = LogFit::of(factors, None)?;
    let (theta, weights) = (&all.theta, &all.weights);
    let by_all: Vec<Vec<f64>> = parts
        .iter()
        .map(|part| part.squares_of_joints(theta))
        .collect();
    let weighted = |log: &usize| -> f64 {
        let each = by_all[*log].iter().zip(weights);
        each.map(|(square, w)| w * w * square).sum()
    };
    let mut order: Vec<usize> = (0..logs).collect();
    order.sort_by(|a, b| weighted(b).total_cmp(&weighted(a)));
    let mut most: Option<(f64, DisagreeingLog)> = None;
    for log in order.into_iter().take(NUMBERS.asked) {
        let rest = factors.of_blocks(|other| other != log);
        let sides = [&parts[log], &rest];
        let [own, others] = sides.map(|side| LogFit::of(side, Some(weights)));
        // a log that determines nothing contradicts nobody
        let (Ok(own), Ok(others)) = (own, others) else {
            continue;
        };
        let together = [by_all[log].clone(), rest.squares_of_joints(theta)];
        let apart = [
            sides[0].squares_of_joints(&own.theta),
            sides[1].squares_of_joints(&others.theta),
        ];
        for joint in 0..factors.columns.joints {
            let [one, two] = [&together, &apart].map(|of| of[0][joint] + of[1][joint]);
            let torque = sides.map(|side| side.moving[joint].torque_square);
            let times = (one / two.max(f64::MIN_POSITIVE)).sqrt();
            let size = ((one - two).max(0.0) / (torque[0] + torque[1])).sqrt();
            let is_more = most.as_ref().is_none_or(|(most, _)| times > *most);
            if times >= NUMBERS.times && size >= NUMBERS.size && is_more {
                let relative = |side: usize| {
                    let of = |squares: &[Vec<f64>; 2]| (squares[side][joint] / torque[side]).sqrt();
                    [of(&together), of(&apart)]
                };
                let found = DisagreeingLog {
                    log,
                    joint,
                    own: relative(0),
                    others: relative(1),
                };
                most = Some((times, found));
            }
        }
    }
    Ok(most.map(|(_, found)| found))
}

/// A fit to the rows of some logs.
struct LogFit {
    theta: DVector<f64>,
    weights: Vec<f64>,
}

impl LogFit {
    /// With the weights given, else those of its own residual.
    fn of(factors: &BlockFactors, weights: Option<&[f64]>) -> Result<Self, FitError> {
        let joints: Vec<DMatrix<f64>> = (0..factors.columns.joints)
            .map(|j| factors.joint(j))
            .collect();
        let weights = match weights {
            Some(weights) => weights.to_vec(),
            None => {
                let plain = solve(factors, &joints, &vec![1.0; joints.len()], None)?;
                weights_of(factors, &residual_std(factors, &joints, &plain.theta))
            }
        };
        Ok(LogFit {
            theta: solve(factors, &joints, &weights, None)?.theta,
            weights,
        })
    }
}

impl BlockFactors {
    /// The same of some of the blocks, by their places.
    fn of_blocks(&self, is_in: impl Fn(usize) -> bool) -> BlockFactors {
        let own = self.blocks.iter().enumerate().filter(|(k, _)| is_in(*k));
        let blocks: Vec<BlockFactor> = own.map(|(_, block)| block.clone()).collect();
        let rows: u64 = blocks.iter().map(|b| b.rows).sum();
        let moving = |j: usize| {
            let last = |b: &BlockFactor| b.r[j].column(b.r[j].ncols() - 1).norm_squared();
            JointRows {
                count: rows,
                torque_square: blocks.iter().map(last).sum(),
            }
        };
        BlockFactors {
            moving: (0..self.columns.joints).map(moving).collect(),
            rows,
            blocks,
            ..self.without_blocks()
        }
    }

    /// |b - X theta|^2 of every joint over the rows in which it moves.
    fn squares_of_joints(&self, theta: &DVector<f64>) -> Vec<f64> {
        let of = |j: usize| {
            let own = self.own_unknowns(theta, j);
            self.parts(&self.joint(j), j).residual_square(&own)
        };
        (0..self.columns.joints).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inertia::columns::{JointTerm, RegressorColumns};

    /// Rows of a slide of so many kg whose noise is 1 % of the force, in blocks of half a second.
    fn log(mass: f64, phase: f64) -> BlockFactors {
        let row = |k: usize| {
            let t = 0.01 * k as f64;
            let (v, a) = ((3.0 * t + phase).sin(), 3.0 * (3.0 * t + phase).cos());
            let noise = 0.1 * ((k * 7919 % 1009) as f64 / 504.5 - 1.0);
            [v, a, mass * a + 1.5 * v + noise]
        };
        let columns = RegressorColumns {
            joints: 1,
            shared: 1,
            own: vec![vec![JointTerm::Viscous]],
            known: vec![None],
            rest_speed: Vec::new(),
        };
        columns.rows_of_one(0.5, (0..2000).map(row))
    }

    fn together(masses: &[f64]) -> BlockFactors {
        let logs = masses.iter().enumerate();
        let logs = logs.map(|(k, mass)| log(*mass, 0.4 * k as f64));
        let merged = logs.reduce(|mut all, log| {
            all.merge(log);
            all
        });
        merged.unwrap().in_logs()
    }

    #[test]
    fn a_log_of_another_mass_is_named_and_logs_of_one_machine_are_not() {
        assert_eq!(disagreeing_log(&log(4.0, 0.0).in_logs()).unwrap(), None);
        assert_eq!(disagreeing_log(&together(&[4.0; 4])).unwrap(), None);
        let found = disagreeing_log(&together(&[4.0, 4.0, 4.6, 4.0])).unwrap();
        let found = found.unwrap();
        assert_eq!((found.log, found.joint), (2, 0));
        assert!(found.own[0] > 0.05 && found.own[1] < 0.015, "{found:?}");
        assert!(
            found.others[0] > 0.02 && found.others[1] < 0.015,
            "{found:?}"
        );
    }
}
