//! The deviation of a model's torque by few directions of its parameters, at the cost of as many torques.
//!
//! What an observer calls a deviation is learnt along motions that the parameters were fitted to. On another motion a
//! combination of parameters may count that those logs hardly told: the few that move the torque most within the
//! robot's reach are kept, each as parameters whose torque is one deviation.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::config::ModelFile;
use crate::config::held_out::HeldOut;
use crate::robot::Robot;
use crate::robot::model::Model;

/// Directions that are kept at most ..
const MOST: usize = 8;
/// .. and the share of the variance within reach from which on no more are taken.
const ENOUGH: f64 = 0.98;
/// States within reach.
const STATES: usize = 256;

/// One deviation of the parameters of links, drives and offsets.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Inertial parameters, in the robot's order.
    pub theta: Vec<f64>,
    /// Offset of each joint [N or Nm].
    pub offset: Vec<f64>,
}

impl Direction {
    /// Nothing of each.
    pub fn none(robot: &Robot) -> Self {
        Self {
            theta: vec![0.0; robot.parameters().len()],
            offset: vec![0.0; robot.joints()],
        }
    }
}

/// The directions of a model's parameters that its logs tell least of.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    robot: Robot,
    each: Vec<Direction>,
    tau: Vec<f64>,
}

impl Directions {
    /// Those of a model within the positions and speeds that were seen; none where the file has no covariance.
    pub fn of(file: &ModelFile, model: &Model, seen: &[HeldOut]) -> Self {
        let robot = model.robot.clone();
        let each = match seen.len() == robot.joints() {
            true => least_told(&robot, &covariance(file, model), seen),
            false => Vec::new(),
        };
        Self {
            tau: vec![0.0; robot.joints()],
            robot,
            each,
        }
    }

    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    pub fn each(&self) -> &[Direction] {
        &self.each
    }

    /// Variance of every joint's torque by these directions at a position, velocity and acceleration
    /// \[N^2 or Nm^2\].
    pub fn variances(&mut self, [q, v, a]: [&[f64]; 3], out: &mut [f64]) {
        out.fill(0.0);
        for direction in &self.each {
            self.robot.torque(&direction.theta, q, v, a, &mut self.tau);
            let deviations = self.tau.iter().zip(&direction.offset);
            for (out, (tau, offset)) in out.iter_mut().zip(deviations) {
                *out += (tau + offset).powi(2);
            }
        }
    }
}

/// Covariance of the inertial parameters and the offsets.
fn covariance(file: &ModelFile, model: &Model) -> DMatrix<f64> {
    let (u, p, n) = (model.parameters(), model.theta.len(), model.robot.joints());
    let all = file.model_covariance(model);
    let place = |i: usize| if i < p { i } else { u - n + (i - p) };
    DMatrix::from_fn(p + n, p + n, |i, k| all[place(i) * u + place(k)])
}

/// Means over states within reach of what a parameter, or two together, do to the torques: a matrix for each joint,
/// offsets last.
fn within_reach(robot: &Robot, seen: &[HeldOut]) -> Vec<DMatrix<f64>> {
    let (n, p) = (robot.joints(), robot.parameters().len());
    let mut sums = vec![DMatrix::zeros(p + n, p + n); n];
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut y = vec![0.0; n * p];
    let mut row = DVector::zeros(p + n);
    for state in 0..STATES {
        for (j, seen) in seen.iter().enumerate() {
            let [low, high] = seen.positions_seen;
            // numbers that fill the ranges evenly
            let draw = |kind: usize| {
                let step = ((3 * j + kind) as f64 + 0.5).sqrt();
                ((state + 1) as f64 * step).fract()
            };
            q[j] = low + (high - low) * draw(0);
            v[j] = seen.speed_seen * (2.0 * draw(1) - 1.0);
            // the greatest of a sine over that range at that speed
            let room = (0.5 * (high - low)).max(f64::MIN_POSITIVE);
            let most = (seen.speed_seen * seen.speed_seen / room).min(f64::MAX);
            a[j] = most * (2.0 * draw(2) - 1.0);
        }
        robot.regressor(&q, &v, &a, &mut y);
        for (j, sum) in sums.iter_mut().enumerate() {
            row.fill(0.0);
            row.rows_mut(0, p).copy_from_slice(&y[j * p..(j + 1) * p]);
            row[p + j] = 1.0;
            sum.ger(1.0 / STATES as f64, &row, &row, 1.0);
        }
    }
    sums
}

/// Directions by the share of the torques' variance within reach that they make, each joint's by its own.
fn least_told(robot: &Robot, covariance: &DMatrix<f64>, seen: &[HeldOut]) -> Vec<Direction> {
    let p = robot.parameters().len();
    let u = covariance.nrows();
    let mut reach = DMatrix::zeros(u, u);
    for of in within_reach(robot, seen) {
        let variance = covariance.component_mul(&of).sum();
        if variance > 0.0 && variance.is_finite() {
            reach += of / variance;
        }
    }
    // units aside
    let scale = DVector::from_fn(u, |i, _| covariance[(i, i)].max(0.0).sqrt());
    let scaled = |m: &DMatrix<f64>, by: &dyn Fn(f64) -> f64| {
        DMatrix::from_fn(u, u, |i, k| m[(i, k)] * by(scale[i]) * by(scale[k]))
    };
    let correlation = scaled(covariance, &|s| if s > 0.0 { 1.0 / s } else { 0.0 });
    let reach = scaled(&reach, &|s| s);
    if !(correlation.iter().chain(reach.iter())).all(|x| x.is_finite()) {
        return Vec::new();
    }
    let of = SymmetricEigen::new(correlation);
    let roots = of.eigenvalues.map(|x| x.max(0.0).sqrt());
    let root = &of.eigenvectors * DMatrix::from_diagonal(&roots);
    let shares = SymmetricEigen::new(root.transpose() * reach * &root);
    let mut order: Vec<usize> = (0..u).collect();
    order.sort_by(|i, k| shares.eigenvalues[*k].total_cmp(&shares.eigenvalues[*i]));
    let whole: f64 = shares.eigenvalues.iter().sum();
    let mut held = 0.0;
    let mut out = Vec::new();
    for k in order.into_iter().take(MOST) {
        if held >= ENOUGH * whole {
            break;
        }
        held += shares.eigenvalues[k];
        let direction = (&root * shares.eigenvectors.column(k)).component_mul(&scale);
        out.push(Direction {
            theta: direction.rows(0, p).iter().copied().collect(),
            offset: direction.rows(p, u - p).iter().copied().collect(),
        });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::JointKind;
    use crate::robot::tree::{Coordinate, Link, Tree, space};

    /// Two links in a vertical plane, 0.4 m between the axes.
    fn double_pendulum() -> Robot {
        let link = |name: &str, parent, origin, joint| Link {
            name: name.to_owned(),
            parent,
            rotation: space::UNTURNED,
            origin,
            axis: [0.0, 0.0, 1.0],
            kind: JointKind::Revolute,
            coordinate: Coordinate::Joint(joint),
        };
        let links = vec![
            link("upper", None, [0.0; 3], 0),
            link("lower", Some(0), [0.4, 0.0, 0.0], 1),
        ];
        let tree = Tree::new(links, 2, [0.0, -9.81, 0.0]).unwrap();
        Robot::of_tree(tree, vec!["q1".into(), "q2".into()], true, Vec::new())
    }

    fn seen() -> Vec<HeldOut> {
        let of = |low, high, speed_seen| HeldOut {
            positions_seen: [low, high],
            speed_seen,
            ..HeldOut::default()
        };
        vec![of(-1.0, 0.5, 2.0), of(0.2, 1.4, 3.0)]
    }

    #[test]
    fn few_directions_give_the_deviation_of_a_torque_that_all_parameters_give() {
        let robot = double_pendulum();
        let (n, p) = (2, robot.parameters().len());
        let u = p + n;
        // two combinations that hardly anything is known of, beside what is known well
        let vector = |k: usize| DVector::from_fn(u, |i, _| ((3 * i + 7 * k + 1) as f64).sin());
        let covariance = vector(1) * vector(1).transpose() * 4.0
            + vector(2) * vector(2).transpose() * 9.0
            + DMatrix::identity(u, u) * 1e-4;
        let each = least_told(&robot, &covariance, &seen());
        assert!((2..=MOST).contains(&each.len()), "{}", each.len());
        let mut few = Directions {
            tau: vec![0.0; n],
            robot,
            each,
        };
        let mut y = vec![0.0; n * p];
        let mut found = [0.0; 2];
        for k in 0..40 {
            let x = |i: usize| ((k * 5 + i * 3) as f64).cos();
            let (q, v, a) = (
                [x(0), x(1)],
                [2.0 * x(2), 3.0 * x(3)],
                [9.0 * x(4), 9.0 * x(5)],
            );
            few.variances([&q, &v, &a], &mut found);
            few.robot.regressor(&q, &v, &a, &mut y);
            for j in 0..n {
                let g = DVector::from_fn(u, |i, _| match i {
                    i if i < p => y[j * p + i],
                    i => f64::from(u8::from(i - p == j)),
                });
                let whole = g.dot(&(&covariance * &g));
                assert!(found[j] <= whole * (1.0 + 1e-9), "{} {whole}", found[j]);
                assert!(found[j] > 0.9 * whole - 0.2, "{} {whole}", found[j]);
            }
        }
    }

    #[test]
    fn parameters_without_a_covariance_have_no_directions() {
        let robot = double_pendulum();
        let u = robot.parameters().len() + 2;
        assert!(least_told(&robot, &DMatrix::zeros(u, u), &seen()).is_empty());
    }
}
