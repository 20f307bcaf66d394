//! The deviation of a model's torque by few directions of its parameters, at the cost of as many torques.
//!
//! What an observer calls a deviation is learnt along motions that the parameters were fitted to. On another motion a
//! combination of parameters may count that those logs hardly determined: the few that move the torque most within the
//! robot's reach are kept, each as parameters whose torque is one deviation.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use cft_ident_core::robot::Robot;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::held_out::HeldOut;

/// Directions that are kept at most ..
const MAX_DIRECTIONS: usize = 8;
/// .. and the share of the variance within reach from which on no more are taken.
const VARIANCE_SHARE: f64 = 0.98;
/// States within reach.
const STATES: usize = 256;

/// One deviation of a model's parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Inertial parameters, in the robot's order.
    pub theta: Vec<f64>,
    /// Those of every joint's friction, one joint after the other, in the order of its law.
    pub friction: Vec<f64>,
    /// Offset of each joint [N or Nm].
    pub offset: Vec<f64>,
}

impl Direction {
    /// Of all of them, in the order of [`ModelFile::model_covariance`].
    pub fn of(model: &Model, all: &[f64]) -> Self {
        let (theta, rest) = all.split_at(model.theta.len());
        let (friction, offset) = rest.split_at(rest.len() - model.offset.len());
        Self {
            theta: theta.to_vec(),
            friction: friction.to_vec(),
            offset: offset.to_vec(),
        }
    }
}

/// The directions of a model's parameters that its logs determine least.
#[derive(Debug, Clone, PartialEq)]
pub struct Directions {
    robot: Robot,
    friction: Vec<JointFriction>,
    each: Vec<Direction>,
    tau: Vec<f64>,
}

impl Directions {
    /// Those of a model within the positions and speeds that were seen; none where the file has no covariance.
    pub fn of(file: &ModelFile, model: &Model, seen: &[HeldOut]) -> Self {
        let u = model.parameters();
        let covariance = DMatrix::from_row_slice(u, u, &file.model_covariance(model));
        let n = model.robot.joints();
        let each = match seen.len() == n {
            true => least_reported(model, &covariance, seen),
            false => Vec::new(),
        };
        Self {
            robot: model.robot.clone(),
            friction: model.friction.clone(),
            each,
            tau: vec![0.0; n],
        }
    }

    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    pub fn each(&self) -> &[Direction] {
        &self.each
    }

    /// Variance of every joint's torque by these directions at a motion \[N^2 or Nm^2\].
    pub fn variances(&mut self, [q, v, a]: [&[f64]; 3], out: &mut [f64]) {
        out.fill(0.0);
        for direction in &self.each {
            self.robot.torque(&direction.theta, q, v, a, &mut self.tau);
            let mut own = direction.friction.as_slice();
            for (j, law) in self.friction.iter().enumerate() {
                let mut slopes = [0.0; 5];
                law.gradient(v[j], &mut slopes);
                let (of, rest) = own.split_at(law.parameters());
                own = rest;
                let friction: f64 = of.iter().zip(&slopes).map(|(x, slope)| x * slope).sum();
                out[j] += (self.tau[j] + friction + direction.offset[j]).powi(2);
            }
        }
    }
}

/// Means over states within reach of what a parameter, or two together, do to the torques: a matrix for each joint.
fn within_reach(model: &Model, seen: &[HeldOut]) -> Vec<DMatrix<f64>> {
    let robot = &model.robot;
    let (n, p, u) = (robot.joints(), model.theta.len(), model.parameters());
    let mut sums = vec![DMatrix::zeros(u, u); n];
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut y = vec![0.0; n * p];
    let mut row = DVector::zeros(u);
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
        let mut first = p;
        for (j, sum) in sums.iter_mut().enumerate() {
            let law = &model.friction[j];
            row.fill(0.0);
            row.rows_mut(0, p).copy_from_slice(&y[j * p..(j + 1) * p]);
            law.gradient(v[j], &mut row.as_mut_slice()[first..]);
            first += law.parameters();
            row[u - n + j] = 1.0;
            sum.ger(1.0 / STATES as f64, &row, &row, 1.0);
        }
    }
    sums
}

/// Directions by the share of the torques' variance within reach that they make, each joint's by its own.
fn least_reported(model: &Model, covariance: &DMatrix<f64>, seen: &[HeldOut]) -> Vec<Direction> {
    let u = model.parameters();
    let mut reach = DMatrix::zeros(u, u);
    for of in within_reach(model, seen) {
        let variance = covariance.component_mul(&of).sum();
        if variance > 0.0 && variance.is_finite() {
            reach += of / variance;
        }
    }
    // units aside
    let scale = DVector::from_fn(u, |i, _| covariance[(i, i)].max(0.0).sqrt());
    let scaled = |m: &DMatrix<f64>, by: &DVector<f64>| {
        DMatrix::from_fn(u, u, |i, k| m[(i, k)] * by[i] * by[k])
    };
    let inverse = scale.map(|s| if s > 0.0 { 1.0 / s } else { 0.0 });
    let (correlation, reach) = (scaled(covariance, &inverse), scaled(&reach, &scale));
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
    for k in order.into_iter().take(MAX_DIRECTIONS) {
        if held >= VARIANCE_SHARE * whole {
            break;
        }
        held += shares.eigenvalues[k];
        let direction = (&root * shares.eigenvectors.column(k)).component_mul(&scale);
        out.push(Direction::of(model, direction.as_slice()));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use cft_ident_core::robot::double_pendulum::double_pendulum;
    use cft_ident_core::robot::friction::ViscousCoulomb;

    /// A double pendulum in a vertical plane, with friction on its second joint.
    fn pendulum() -> Model {
        let robot = double_pendulum([0.0, -9.81, 0.0], true);
        let viscous_coulomb = ViscousCoulomb {
            viscous: 1.0,
            coulomb: 2.0,
        };
        Model {
            theta: vec![1.0; robot.parameters().len()],
            friction: vec![
                JointFriction::None,
                JointFriction::ViscousCoulomb(viscous_coulomb),
            ],
            offset: vec![0.0; 2],
            robot,
        }
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
        let model = pendulum();
        let (n, p, u) = (2, model.theta.len(), model.parameters());
        // two combinations that hardly anything is known of, beside what is known well
        let vector = |k: usize| DVector::from_fn(u, |i, _| ((3 * i + 7 * k + 1) as f64).sin());
        let covariance = vector(1) * vector(1).transpose() * 4.0
            + vector(2) * vector(2).transpose() * 9.0
            + DMatrix::identity(u, u) * 1e-4;
        let each = least_reported(&model, &covariance, &seen());
        assert!((2..=MAX_DIRECTIONS).contains(&each.len()), "{}", each.len());
        let mut few = Directions {
            robot: model.robot,
            friction: model.friction,
            each,
            tau: vec![0.0; n],
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
                let friction = [v[1], v[1].signum()];
                let g = DVector::from_fn(u, |i, _| match i {
                    i if i < p => y[j * p + i],
                    i if i < p + 2 => friction[i - p] * f64::from(u8::from(j == 1)),
                    i => f64::from(u8::from(i - p - 2 == j)),
                });
                let whole = g.dot(&(&covariance * &g));
                assert!(found[j] <= whole * (1.0 + 1e-9), "{} {whole}", found[j]);
                assert!(found[j] > 0.9 * whole - 0.2, "{} {whole}", found[j]);
            }
        }
    }

    #[test]
    fn parameters_without_a_covariance_have_no_directions() {
        let model = pendulum();
        let u = model.parameters();
        assert!(least_reported(&model, &DMatrix::zeros(u, u), &seen()).is_empty());
    }
}
