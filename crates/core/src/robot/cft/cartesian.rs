//! The dynamics in Cartesian space, M_x a_x + V_x + G_x + F_x = J^-T tau (after eq. (61)).

use super::dynamics::{Coefficients, coriolis, gravity_torque, inertia};
use super::pantograph::{
    DOWNWARD_RATIO, OUTWARD_RATIO, inverse_reference_jacobian, reference_jacobian_rate,
};
use crate::robot::error::RobotError;

/// Which coordinates x = h(q) the dynamics are written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// The coordinates (x_c1, x_c2, x_c3, x_c4): forces act on the wrist P_e.
    Wrist,
    /// What the motors move, (-y_r, x_r, x_c3, x_c4): forces are the motor forces
    /// (F_xc1, F_xc2, F_xc3, F_xc4) of eq. (65).
    Motor,
}

/// M_x, V_x, G_x and F_x at one state, in the order of x_c1..x_c4; kg, N (kg m^2, N m for x_c3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CartesianDynamics {
    /// M_x = J^-T M J^-1.
    pub inertia: [[f64; 4]; 4],
    /// V_x = J^-T (C v - M J^-1 dJ/dt v).
    pub velocity: [f64; 4],
    /// G_x = J^-T G.
    pub gravity: [f64; 4],
    /// F_x = J^-T F.
    pub friction: [f64; 4],
}

/// The inverse Jacobian dq/dx at one pose.
#[derive(Debug, Clone, Copy)]
struct Inverse([[f64; 4]; 4]);

impl Space {
    /// d(x_1, x_2)/d(-y_r, x_r): 7 and 6 for the wrist, 1 for the motors.
    fn ratios(self) -> (f64, f64) {
        match self {
            Self::Wrist => (DOWNWARD_RATIO, OUTWARD_RATIO),
            Self::Motor => (1.0, 1.0),
        }
    }
}

impl Inverse {
    fn new(q: &[f64; 4], space: Space) -> Result<Self, RobotError> {
        let (down, out) = space.ratios();
        let row = |r: [f64; 2]| [-r[1] / down, r[0] / out, 0.0, 0.0];
        let [q4, q5] = inverse_reference_jacobian(q)?;
        Ok(Self([
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 1.0, 0.0],
            row(q4),
            row(q5),
        ]))
    }

    fn apply(&self, x: &[f64; 4]) -> [f64; 4] {
        std::array::from_fn(|i| (0..4).map(|j| self.0[i][j] * x[j]).sum())
    }

    fn transposed(&self, tau: &[f64; 4]) -> [f64; 4] {
        std::array::from_fn(|j| (0..4).map(|i| self.0[i][j] * tau[i]).sum())
    }
}

impl CartesianDynamics {
    /// At the pose q and joint velocities v, for the friction torques F(v) given (joint order).
    ///
    /// # Errors
    /// [`RobotError::Singular`] where links 4 and 5 are in line; never inside Table 5.
    pub fn at(
        q: &[f64; 4],
        v: &[f64; 4],
        k: &Coefficients,
        friction: &[f64; 4],
        space: Space,
    ) -> Result<Self, RobotError> {
        let inverse = Inverse::new(q, space)?;
        let m = inertia(q, k);
        let c = coriolis(q, v, k);
        // The acceleration of q that the curvature of x = h(q) asks for at a_x = 0.
        let (down, out) = space.ratios();
        let [dx, dy] = reference_jacobian_rate(q, v);
        let rate = |row: [f64; 2]| row[0] * v[2] + row[1] * v[3];
        let curved = inverse.apply(&[-down * rate(dy), out * rate(dx), 0.0, 0.0]);
        let joint: [f64; 4] =
            std::array::from_fn(|i| (0..4).map(|j| c[i][j] * v[j] - m[i][j] * curved[j]).sum());
        // Column j of J^-T M J^-1, which is its row j too.
        let inertia = std::array::from_fn(|j| {
            let force = std::array::from_fn(|i| (0..4).map(|l| m[i][l] * inverse.0[l][j]).sum());
            inverse.transposed(&force)
        });
        Ok(Self {
            inertia,
            velocity: inverse.transposed(&joint),
            gravity: inverse.transposed(&gravity_torque(q, k)),
            friction: inverse.transposed(friction),
        })
    }

    /// Forces M_x a_x + V_x + G_x + F_x for the accelerations of x_1..x_4.
    pub fn force(&self, acceleration: &[f64; 4]) -> [f64; 4] {
        std::array::from_fn(|i| {
            let inertial: f64 = (0..4).map(|j| self.inertia[i][j] * acceleration[j]).sum();
            inertial + self.velocity[i] + self.gravity[i] + self.friction[i]
        })
    }
}

/// Forces J^-T tau on x_1..x_4 that do the work of the joint torques tau (eq. (61)).
///
/// # Errors
/// [`RobotError::Singular`] where links 4 and 5 are in line; never inside Table 5.
pub fn forces_of_torques(
    q: &[f64; 4],
    tau: &[f64; 4],
    space: Space,
) -> Result<[f64; 4], RobotError> {
    Ok(Inverse::new(q, space)?.transposed(tau))
}
