//! One hypothesis, fitted.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::channels::{Carried, Drive};
use super::correction::Correction;
use super::fit::{Fit, Power};
use super::normal::{Normal, Problem};
use cft_ident_core::robot::Robot;

/// Rows whose poses stand for all of them.
const POSES: usize = 40;

/// A hypothesis as it was fitted.
pub(super) struct Trial {
    pub by: Correction,
    pub robot: Robot,
    pub normal: Arc<Normal>,
    pub fit: Fit,
    pub power: Power,
}

impl Trial {
    pub fn new(
        problem: &Problem,
        by: Correction,
        rows: &[usize],
        blocks: usize,
        shared: Option<&Trial>,
    ) -> Option<Self> {
        let same = shared.filter(|s| problem.channels.same_rows(&s.by, &by));
        let (robot, normal) = match same {
            Some(s) => (s.robot.clone(), Arc::clone(&s.normal)),
            None => {
                let robot = problem.robot_under(&by)?;
                let normal = problem.normal(&robot, &by, rows, blocks)?;
                (robot, Arc::new(normal))
            }
        };
        let mix = problem.channels.mix(&by);
        let power = power(problem, &robot, &by, &normal, &mix, rows);
        // friction that is known may have been found with the sign as it is declared, or without
        let known = |turned: bool| {
            let of = |(j, mix): (usize, &DVector<f64>)| {
                let sign = by.torque_factor[j].signum();
                Normal::target(mix, if turned { sign } else { 1.0 })
            };
            mix.iter().enumerate().map(of).collect::<Vec<_>>()
        };
        let turned = by.torque_factor.iter().any(|f| *f < 0.0)
            && problem.columns.known.iter().any(Option::is_some);
        let fit = Fit::new(&normal, known(false), &power);
        let other = turned
            .then(|| Fit::new(&normal, known(true), &power))
            .flatten();
        let fit = match (fit, other) {
            (Some(a), Some(b)) if b.score > a.score => Some(b),
            (a, b) => a.or(b),
        }?;
        Some(Self {
            by,
            robot,
            normal,
            fit,
            power,
        })
    }
}

/// By what the residuals of a hypothesis are measured, from these rows.
pub(super) fn power(
    problem: &Problem,
    robot: &Robot,
    by: &Correction,
    normal: &Normal,
    mix: &[DVector<f64>],
    rows: &[usize],
) -> Power {
    let n = normal.joints;
    let own = |j: usize| {
        let first = normal.places[j].len();
        match normal.total[j].nrows() == first + n + 1 && first > 0 {
            true => {
                let k = normal.total[j].view((first, first), (n, n));
                mix[j].dot(&(k * &mix[j]))
            }
            false => 0.0,
        }
    };
    let alone = |joints: Vec<f64>| Power { joints, size: 0.0 };
    match problem.channels.drive {
        Drive::Joints => alone((0..n).map(own).collect()),
        Drive::Motors => {
            let joints: Vec<f64> = (0..n).map(own).collect();
            let size = through_linkage(problem, robot, by, (&joints, normal.rows), rows);
            Power { joints, size }
        }
        // channels share joints: their sizes count together
        _ => {
            let scale = (2.0 * by.torque_size() / n as f64).exp();
            let sums = squares(problem, rows);
            let felt = sums.iter().zip(problem.moving());
            alone(
                felt.map(|(s, m)| if *m { scale * s } else { 0.0 })
                    .collect(),
            )
        }
    }
}

/// Squares of the torques of each channel in these rows.
fn squares(problem: &Problem, rows: &[usize]) -> Vec<f64> {
    let mut sums = vec![0.0; problem.sample.joints];
    for &k in rows {
        for (sum, tau) in sums.iter_mut().zip(problem.sample.row(k).tau) {
            *sum += tau * tau;
        }
    }
    sums
}

/// Logarithm of the product of the joints' mean squares over that of the motors', by the volume that the linkage and the
/// correction make of the motors' torques.
fn through_linkage(
    problem: &Problem,
    robot: &Robot,
    by: &Correction,
    (joints, good): (&[f64], usize),
    rows: &[usize],
) -> f64 {
    let n = joints.len();
    let mean = |sums: &[f64], rows: usize| -> f64 {
        let all = sums.iter().filter(|s| **s > 0.0);
        all.map(|s| (s / rows.max(1) as f64).ln()).sum()
    };
    let drive = robot.transmission();
    let mut carried = Carried::new(n);
    let (mut unit, mut torque) = (vec![0.0; n], vec![0.0; n]);
    let (mut volume, mut count) = (0.0, 0.0);
    for k in rows.iter().step_by(rows.len().div_ceil(POSES).max(1)) {
        let row = problem.sample.row(*k);
        if !problem.channels.carry(robot, row, by, &mut carried) {
            continue;
        }
        let mut gains = DMatrix::zeros(n, n);
        for c in 0..n {
            unit[c] = 1.0;
            drive.torques(&carried.q, &unit, &mut torque);
            unit[c] = 0.0;
            gains.column_mut(c).copy_from_slice(&torque);
        }
        let size = gains.determinant().abs();
        if size > 0.0 {
            volume += size.ln();
            count += 1.0;
        }
    }
    let volume = volume / f64::max(count, 1.0) + by.torque_size();
    mean(joints, good) - mean(&squares(problem, rows), rows.len()) - 2.0 * volume
}
