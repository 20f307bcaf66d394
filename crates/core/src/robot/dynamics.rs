//! M and C v + G of a robot with given parameters: what a simulation solves for accelerations.

use super::cft::dynamics::{ReportCoefficients, inertia_and_bias, solve_positive};
use super::cft::{EXTENDED, PRINTED};
use super::tree::MOST_JOINTS;
use super::{DynamicsForm, Robot};

/// A robot with its inertial parameters, ready for many states.
#[derive(Debug, Clone)]
pub struct RobotDynamics {
    robot: Robot,
    theta: Vec<f64>,
    /// The coefficients of the closed form, where there is one.
    closed: Option<ReportCoefficients>,
}

impl Robot {
    /// The dynamics with inertial parameters in the order of [`Robot::parameters`].
    pub fn dynamics(&self, theta: &[f64]) -> RobotDynamics {
        RobotDynamics {
            robot: self.clone(),
            theta: theta.to_vec(),
            closed: self.coefficients(theta),
        }
    }

    /// The coefficients of the report's closed forms, of the robot that it is about.
    pub fn coefficients(&self, theta: &[f64]) -> Option<ReportCoefficients> {
        let DynamicsForm::Report(_) = self.0.form else {
            return None;
        };
        if let Ok(theta) = <&[f64; EXTENDED.len()]>::try_from(theta) {
            return Some(ReportCoefficients::from_theta22(theta));
        }
        let theta = <&[f64; PRINTED]>::try_from(theta).ok()?;
        Some(ReportCoefficients::from_theta12(theta))
    }
}

impl RobotDynamics {
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Writes M(q), n x n row-major, and C v + G at q and v. Where there is no closed form the columns of M
    /// are torques of unit accelerations. Does not allocate.
    ///
    /// # Panics
    /// Where q, v or `bias` does not hold n numbers or `mass` n^2: a mistake of the caller's code.
    #[inline]
    pub fn inertia_and_bias(&self, q: &[f64], v: &[f64], mass: &mut [f64], bias: &mut [f64]) {
        let n = self.robot.joints();
        if let Some(closed) = &self.closed {
            let (m, b) = inertia_and_bias(super::four(q), super::four(v), closed);
            mass.copy_from_slice(m.as_flattened());
            bias.copy_from_slice(&b);
            return;
        }
        let mut unit = [0.0; MOST_JOINTS];
        let mut tau = [0.0; MOST_JOINTS];
        let (unit, tau) = (&mut unit[..n], &mut tau[..n]);
        self.robot.torque(&self.theta, q, v, unit, bias);
        for k in 0..n {
            unit[k] = 1.0;
            self.robot.torque(&self.theta, q, v, unit, tau);
            unit[k] = 0.0;
            for (i, (tau, bias)) in tau.iter().zip(&*bias).enumerate() {
                mass[i * n + k] = tau - bias;
            }
        }
    }

    /// x with M x = b, in the place of b; `false` where M, n x n row-major, is not positive definite. M may be
    /// overwritten. Does not allocate.
    #[inline]
    pub fn solve(&self, mass: &mut [f64], b: &mut [f64]) -> bool {
        if self.closed.is_none() {
            return cholesky(mass, b);
        }
        let (rows, _) = mass.as_chunks::<4>();
        let rows: &[[f64; 4]; 4] = rows.try_into().expect("the CFT robot has four joints");
        let found = solve_positive(rows, super::four(b));
        if let Some(x) = found {
            b.copy_from_slice(&x);
        }
        found.is_some()
    }
}

/// x with L L^T x = b in the place of b; `false` where the n x n matrix is not positive definite.
#[inline]
fn cholesky(mass: &mut [f64], b: &mut [f64]) -> bool {
    let n = b.len();
    if n == 1 {
        // a root and its square would round
        b[0] /= mass[0];
        return mass[0] > 0.0;
    }
    // L takes the place of the lower triangle
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| mass[i * n + k] * mass[j * n + k]).sum();
            let own = mass[i * n + j];
            if i == j {
                let left = own - sum;
                // rounding of a matrix that is singular
                if left.partial_cmp(&(1e-12 * own.abs())) != Some(std::cmp::Ordering::Greater) {
                    return false;
                }
                mass[i * n + i] = left.sqrt();
            } else {
                mass[i * n + j] = (own - sum) / mass[j * n + j];
            }
        }
    }
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| mass[i * n + k] * b[k]).sum();
        b[i] = (b[i] - sum) / mass[i * n + i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| mass[k * n + i] * b[k]).sum();
        b[i] = (b[i] - sum) / mass[i * n + i];
    }
    true
}
