//! The direct dynamics of a fit, in closed loop along a reference: where instruments come from.
//!
//! One implicit Euler step a sample: (M + h D + h^2 K) a = K (q_r - q - h v) + D (v_r - v) - c - F(v),
//! M and c from the fit's own parameters, M by differences of the regressor: column i is
//! Y(q, 0, e_i) theta - Y(q, 0, 0) theta. Feedback is proportional and derivative, its gains those of
//! a natural frequency at critical damping. The step is of first order only: instruments have to move
//! as the robot does, not to be exact.

use super::columns::{JointTerm, RegressorColumns};
use crate::math::hyperbolic::tanh;
use crate::robot::Robot;
use crate::robot::tree::MOST_JOINTS;

/// The frequency of the loop stays below this share of the sampling rate.
const FASTEST: f64 = 0.1;
/// Frequency of the loop over the cut-off of the rows.
const ABOVE_CUTOFF: f64 = 3.0;
/// A joint this far from its reference [m or rad] is put back there.
const MAX_REFERENCE_ERROR: f64 = 0.5;
/// Least inertia of a joint, as a share of the largest.
const MIN_INERTIA_SHARE: f64 = 1e-6;

/// Gains of the loop.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoopGains {
    /// Natural frequency [rad/s].
    pub frequency: f64,
    /// Per joint: K [N/m or Nm/rad].
    pub proportional: Vec<f64>,
    /// Per joint: D [N s/m or Nm s/rad].
    pub derivative: Vec<f64>,
}

/// A matrix of which a corner is used.
type SquareMatrix = [[f64; MOST_JOINTS]; MOST_JOINTS];

/// A robot under the parameters of a fit.
#[derive(Debug, Clone)]
pub(super) struct ClosedLoop<'a> {
    robot: &'a Robot,
    columns: &'a RegressorColumns,
    theta: Vec<f64>,
    pub gains: LoopGains,
    q: [f64; MOST_JOINTS],
    v: [f64; MOST_JOINTS],
    /// Steps at which the mass matrix was not positive definite, or a joint went astray.
    pub indefinite: u64,
}

impl<'a> ClosedLoop<'a> {
    /// A loop about pose `q`, for rows up to `cutoff_hz` sampled with step `h` [s]; `theta` as in `columns`.
    pub fn new(
        robot: &'a Robot,
        columns: &'a RegressorColumns,
        theta: Vec<f64>,
        q: &[f64],
        cutoff_hz: f64,
        h: f64,
    ) -> Self {
        let n = columns.joints;
        let frequency = std::f64::consts::TAU * (ABOVE_CUTOFF * cutoff_hz).min(FASTEST / h);
        let mut new = ClosedLoop {
            robot,
            columns,
            theta,
            gains: LoopGains {
                frequency,
                ..LoopGains::default()
            },
            q: [0.0; MOST_JOINTS],
            v: [0.0; MOST_JOINTS],
            indefinite: 0,
        };
        let (mass, _) = new.balance(q, &[0.0; MOST_JOINTS][..n]);
        let sizes = (0..n).map(|i| mass[i][i].abs());
        let largest = sizes.fold(f64::MIN_POSITIVE, f64::max);
        for (i, row) in mass.iter().enumerate().take(n) {
            let inertia = row[i].abs().max(MIN_INERTIA_SHARE * largest);
            new.gains.proportional.push(inertia * frequency * frequency);
            new.gains.derivative.push(2.0 * inertia * frequency);
        }
        new
    }

    /// Puts the robot at a pose with a velocity.
    pub fn place(&mut self, q: &[f64], v: &[f64]) {
        let n = self.columns.joints;
        self.q[..n].copy_from_slice(&q[..n]);
        self.v[..n].copy_from_slice(&v[..n]);
    }

    /// Mass matrix and the torque that needs no acceleration, friction aside.
    fn balance(&self, q: &[f64], v: &[f64]) -> (SquareMatrix, [f64; MOST_JOINTS]) {
        let (n, shared) = (self.columns.joints, &self.theta[..self.columns.shared]);
        let torque = |v: &[f64], a: &[f64]| {
            let mut out = [0.0; MOST_JOINTS];
            self.robot.torque(shared, q, v, a, &mut out[..n]);
            out
        };
        let rest = [0.0; MOST_JOINTS];
        let still = torque(&rest[..n], &rest[..n]);
        let mut mass = [rest; MOST_JOINTS];
        for i in 0..n {
            let mut unit = rest;
            unit[i] = 1.0;
            let column = torque(&rest[..n], &unit[..n]);
            for j in 0..n {
                mass[j][i] = column[j] - still[j];
            }
        }
        (mass, torque(v, &rest[..n]))
    }

    /// Friction of joint j at speed v and its slope; a sign that jumps is smoothed over `width`.
    fn friction(&self, j: usize, v: f64, width: f64) -> [f64; 2] {
        let mut sum = [0.0; 2];
        if let Some(known) = &self.columns.known[j] {
            sum = [known.law.torque(v), known.law.slope(v)];
        }
        let first = self.columns.first_own(j);
        for (k, own) in self.columns.own[j].iter().enumerate() {
            let size = self.theta[first + k];
            match own {
                JointTerm::Viscous => {
                    sum[0] += size * v;
                    sum[1] += size;
                }
                JointTerm::Coulomb => {
                    let t = tanh(v / width);
                    sum[0] += size * t;
                    sum[1] += size * (1.0 - t * t) / width;
                }
                own => sum[0] += size * own.column(v),
            }
        }
        sum
    }

    /// Advances by h towards the reference at the end of the step; the new pose.
    pub fn step(&mut self, h: f64, q_ref: &[f64], v_ref: &[f64]) -> &[f64] {
        let n = self.columns.joints;
        let (q, v) = (self.q, self.v);
        let (mut mass, bias) = self.balance(&q[..n], &v[..n]);
        let mut force = [0.0; MOST_JOINTS];
        for (j, force) in force.iter_mut().enumerate().take(n) {
            let (k, d) = (self.gains.proportional[j], self.gains.derivative[j]);
            let inertia = d / (2.0 * self.gains.frequency);
            let own = self.columns.own[j].iter().enumerate();
            let coulomb: f64 = own
                .filter(|(_, own)| **own == JointTerm::Coulomb)
                .map(|(i, _)| self.theta[self.columns.first_own(j) + i].abs())
                .sum();
            let width = (2.0 * h * coulomb / inertia).max(1e-9);
            let [friction, slope] = self.friction(j, v[j], width);
            *force = k * (q_ref[j] - q[j] - h * v[j]) + d * (v_ref[j] - v[j]) - bias[j] - friction;
            mass[j][j] += h * (d + slope.max(0.0)) + h * h * k;
        }
        let diagonal: [f64; MOST_JOINTS] = std::array::from_fn(|j| mass[j][j]);
        if !solve(&mut mass, &mut force, n) {
            // a fit may have a mass matrix that no robot has: each joint by itself, then
            self.indefinite += 1;
            for j in 0..n {
                let (k, d) = (self.gains.proportional[j], self.gains.derivative[j]);
                let least = d / (2.0 * self.gains.frequency) + h * d + h * h * k;
                force[j] /= diagonal[j].max(least);
            }
        }
        for (j, a) in force.iter().enumerate().take(n) {
            self.v[j] += h * a;
            self.q[j] += h * self.v[j];
        }
        // not a number counts as astray
        let near = |j: usize| (self.q[j] - q_ref[j]).abs() < MAX_REFERENCE_ERROR;
        if !(0..n).all(near) {
            self.indefinite += 1;
            self.place(q_ref, v_ref);
        }
        &self.q[..n]
    }
}

/// Solves a x = b in place by Cholesky's factor of the symmetric part; false where that is not positive definite.
fn solve(a: &mut SquareMatrix, b: &mut [f64; MOST_JOINTS], n: usize) -> bool {
    for i in 0..n {
        for j in 0..=i {
            let sum: f64 = (0..j).map(|k| a[i][k] * a[j][k]).sum();
            let entry = 0.5 * (a[i][j] + a[j][i]);
            if i == j {
                let rest = a[i][i] - sum;
                if rest.is_nan() || rest <= 0.0 {
                    return false;
                }
                a[i][i] = rest.sqrt();
            } else {
                a[i][j] = (entry - sum) / a[j][j];
                // the mirror entry is not read again below the diagonal
            }
        }
    }
    let mut x = *b;
    for i in 0..n {
        let sum: f64 = (0..i).map(|k| a[i][k] * x[k]).sum();
        x[i] = (x[i] - sum) / a[i][i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|k| a[k][i] * x[k]).sum();
        x[i] = (x[i] - sum) / a[i][i];
    }
    *b = x;
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::JointKind;

    #[test]
    fn a_joint_follows_its_reference_and_lags_by_what_friction_and_inertia_ask() {
        let robot = Robot::single_joint("q1", JointKind::Prismatic);
        let columns = RegressorColumns::of_one(
            &[JointTerm::Viscous, JointTerm::Coulomb, JointTerm::Offset],
            None,
        );
        let h = 1e-3;
        let theta = vec![95.0, 200.0, 20.0, -3.0];
        let mut joint = ClosedLoop::new(&robot, &columns, theta, &[0.0], 40.0, h);
        let w: f64 = 4.0;
        joint.place(&[0.0], &[0.1 * w]);
        let mut worst: f64 = 0.0;
        for k in 1..5000 {
            let t = f64::from(k) * h;
            let (q, v) = (0.1 * (w * t).sin(), 0.1 * w * (w * t).cos());
            let found = joint.step(h, &[q], &[v])[0];
            if k > 100 {
                worst = worst.max((found - q).abs());
            }
        }
        // the feedback alone carries the force: at most 250 N over K
        let stiffness = joint.gains.proportional[0];
        assert!((stiffness / (95.0 * (628.318_53_f64).powi(2)) - 1.0).abs() < 1e-6);
        assert!(worst < 300.0 / stiffness + 1e-6, "{worst}");
        assert!(worst > 50.0 / stiffness, "{worst}");
        assert_eq!(joint.indefinite, 0);
    }

    #[test]
    fn a_symmetric_system_is_solved_and_an_indefinite_one_is_refused() {
        let mut a = [[0.0; MOST_JOINTS]; MOST_JOINTS];
        let entries = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        for i in 0..3 {
            a[i][..3].copy_from_slice(&entries[i]);
        }
        let x = [1.0, -2.0, 3.0];
        let mut b = [0.0; MOST_JOINTS];
        for i in 0..3 {
            b[i] = (0..3).map(|k| entries[i][k] * x[k]).sum();
        }
        assert!(solve(&mut a, &mut b, 3));
        for i in 0..3 {
            assert!((b[i] - x[i]).abs() < 1e-13, "{i}: {}", b[i]);
        }
        let mut a = [[0.0; MOST_JOINTS]; MOST_JOINTS];
        (a[0][0], a[1][1], a[0][1], a[1][0]) = (1.0, 1.0, 2.0, 2.0);
        assert!(!solve(&mut a, &mut b, 2));
    }
}
