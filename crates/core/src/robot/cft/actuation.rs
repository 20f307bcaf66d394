//! Volts, motor forces and joint torques (eq. (63)-(66), Table 6); encoders and limits (Table 5).
//!
//! Motor forces are in the order of the coordinates (x_c1, x_c2, x_c3, x_c4). F_xc1 = -F_yr and
//! F_xc2 = F_xr act on the pantograph's references: they are not forces at the tool, which are 7
//! and 6 times smaller.

use super::geometry::L4;
use super::pantograph::{DOWNWARD_RATIO, OUTWARD_RATIO, inverse_reference_jacobian};
use crate::robot::error::RobotError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Encoder scale of x_c1..x_c4 in m or rad per count (Table 5), the same for both set-ups.
pub const ENCODER_SCALE: [f64; 4] = [8.7989e-6, 7.5209e-6, 1.6886e-5, 5.0e-6];

/// Which of the two laboratory set-ups drives the robot (Remark 5, Table 6).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "Setup")]
pub enum LaboratorySetup {
    /// TUeDACS: amplifiers of 1.6 A/V.
    #[default]
    Tuedacs,
    /// dSPACE: amplifiers of 0.4 A/V, and other limits of x_c4.
    Dspace,
}

/// Lower and upper limits of x_c1..x_c4 in m and rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActuationLimits {
    pub lower: [f64; 4],
    pub upper: [f64; 4],
}

impl ActuationLimits {
    /// Index 0..3 of the first coordinate that lies outside (or is not a number).
    pub fn first_outside(&self, x: &[f64; 4]) -> Option<usize> {
        (0..4).find(|&i| !(self.lower[i]..=self.upper[i]).contains(&x[i]))
    }

    /// Ends of coordinate i.
    pub fn of(&self, i: usize) -> Option<[f64; 2]> {
        Some([*self.lower.get(i)?, *self.upper.get(i)?])
    }

    /// upper - lower of each coordinate.
    pub fn spans(&self) -> [f64; 4] {
        std::array::from_fn(|i| self.upper[i] - self.lower[i])
    }

    /// The middle of each coordinate's span.
    pub fn middles(&self) -> [f64; 4] {
        std::array::from_fn(|i| 0.5 * (self.upper[i] + self.lower[i]))
    }
}

impl LaboratorySetup {
    /// K_T of x_c1..x_c4: N/V, N/V, N m/V, N/V (Table 6).
    pub const fn gains(self) -> [f64; 4] {
        match self {
            Self::Tuedacs => [430.2725, 430.2725, 31.7814, 107.5681],
            Self::Dspace => [107.5681, 107.5681, 7.9453, 26.8920],
        }
    }

    /// Limits of x_c1..x_c4 (Table 5, Remark 5).
    pub const fn limits(self) -> ActuationLimits {
        let (lower, upper) = match self {
            Self::Tuedacs => (-0.0606, 0.5344),
            Self::Dspace => (-0.55, 0.05),
        };
        ActuationLimits {
            lower: [-0.2918, -0.0269, -0.2892, lower],
            upper: [0.0232, 0.5801, 5.8708, upper],
        }
    }

    /// The name in robot files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tuedacs => "tuedacs",
            Self::Dspace => "dspace",
        }
    }

    /// Motor forces in N (N m for x_c3) of the amplifier voltages u_1..u_4 in V.
    #[inline]
    pub fn volts_to_forces(self, volts: &[f64; 4]) -> [f64; 4] {
        let gains = self.gains();
        std::array::from_fn(|i| gains[i] * volts[i])
    }

    /// Amplifier voltages in V of motor forces in N (N m for x_c3).
    #[inline]
    pub fn forces_to_volts(self, forces: &[f64; 4]) -> [f64; 4] {
        let gains = self.gains();
        std::array::from_fn(|i| forces[i] / gains[i])
    }

    /// Joint torques (q1, q2, q4, q5) of the amplifier voltages at the pose q.
    #[inline]
    pub fn volts_to_torques(self, q: &[f64; 4], volts: &[f64; 4]) -> [f64; 4] {
        forces_to_torques(q, &self.volts_to_forces(volts))
    }

    /// Amplifier voltages that give the joint torques at the pose q.
    ///
    /// # Errors
    /// [`RobotError::Singular`], see [`torques_to_forces`].
    #[inline]
    pub fn torques_to_volts(self, q: &[f64; 4], tau: &[f64; 4]) -> Result<[f64; 4], RobotError> {
        Ok(self.forces_to_volts(&torques_to_forces(q, tau)?))
    }
}

/// Joint torques tau(q1, q2, q4, q5) of the motor forces (x_c1..x_c4) (eq. (66)), N and N m.
#[inline]
pub fn forces_to_torques(q: &[f64; 4], forces: &[f64; 4]) -> [f64; 4] {
    let (s4, c4) = q[2].sin_cos();
    let (s, c) = (q[2] + q[3]).sin_cos();
    let [f1, f2, f3, f4] = *forces;
    let tau5 = -L4 * (f2 * c - f1 * s);
    [f4, f3, -L4 * (f2 * c4 - f1 * s4) + tau5, tau5]
}

/// Motor forces (x_c1..x_c4) that give the joint torques (q1, q2, q4, q5) (eq. (65)).
///
/// # Errors
/// [`RobotError::Singular`] where Delta_J = L4 sin q5 vanishes; never inside Table 5.
#[inline]
pub fn torques_to_forces(q: &[f64; 4], tau: &[f64; 4]) -> Result<[f64; 4], RobotError> {
    let inverse = inverse_reference_jacobian(q)?;
    let f_xr = inverse[0][0] * tau[2] + inverse[1][0] * tau[3];
    let f_yr = inverse[0][1] * tau[2] + inverse[1][1] * tau[3];
    Ok([-f_yr, f_xr, tau[1], tau[0]])
}

/// Covariance of (q1, q2, q4, q5) of independent errors of x_c1..x_c4 with the variances given
/// (m^2, rad^2): the encoders sit on the motors, so q4 and q5 are correlated by the pose.
///
/// # Errors
/// [`RobotError::Singular`] where links 4 and 5 are in line.
pub fn joint_covariance(
    q: &[f64; 4],
    coordinate_variance: &[f64; 4],
) -> Result<[[f64; 4]; 4], RobotError> {
    let inverse = inverse_reference_jacobian(q)?;
    let row = |r: [f64; 2]| [-r[1] / DOWNWARD_RATIO, r[0] / OUTWARD_RATIO, 0.0, 0.0];
    let map = [
        [0.0, 0.0, 0.0, 1.0],
        [0.0, 0.0, 1.0, 0.0],
        row(inverse[0]),
        row(inverse[1]),
    ];
    Ok(congruence(&map, coordinate_variance))
}

/// Variance of x_c1..x_c4 that rounding to whole encoder counts adds: scale^2/12, in m^2 and rad^2.
pub fn quantisation_variance() -> [f64; 4] {
    ENCODER_SCALE.map(|scale| scale * scale / 12.0)
}

/// A diag(d) A^T.
fn congruence(a: &[[f64; 4]; 4], d: &[f64; 4]) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..4).map(|k| a[i][k] * d[k] * a[j][k]).sum()))
}
