//! One hypothesis, fitted.

use std::sync::Arc;

use nalgebra::DVector;

use super::channels::Drive;
use super::correction::Correction;
use super::fit::Fit;
use super::normal::{Normal, Problem};
use crate::robot::Robot;

/// A hypothesis as it was fitted.
pub(super) struct Trial {
    pub by: Correction,
    pub robot: Robot,
    pub normal: Arc<Normal>,
    pub fit: Fit,
    pub power: Vec<f64>,
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
        let power = power(problem, &by, &normal, &mix, rows);
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

/// Squares of each joint's torque, by which residuals are measured.
pub(super) fn power(
    problem: &Problem,
    by: &Correction,
    normal: &Normal,
    mix: &[DVector<f64>],
    rows: &[usize],
) -> Vec<f64> {
    let n = normal.joints;
    match problem.channels.drive {
        Drive::Joints => (0..n)
            .map(|j| {
                let first = normal.places[j].len();
                match normal.total[j].nrows() == first + n + 1 && first > 0 {
                    true => {
                        let k = normal.total[j].view((first, first), (n, n));
                        mix[j].dot(&(k * &mix[j]))
                    }
                    false => 0.0,
                }
            })
            .collect(),
        // channels share joints: their sizes count together
        _ => {
            let scale = (2.0 * by.torque_size() / n as f64).exp();
            let mut sums = vec![0.0; n];
            for &k in rows {
                for (sum, tau) in sums.iter_mut().zip(problem.sample.row(k).tau) {
                    *sum += scale * tau * tau;
                }
            }
            let moving = problem.moving();
            sums.iter()
                .zip(moving)
                .map(|(s, m)| if *m { *s } else { 0.0 })
                .collect()
        }
    }
}
