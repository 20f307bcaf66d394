//! Cartesian coordinates (x_c1, x_c2, x_c3, x_c4) and joint coordinates (q1, q2, q4, q5), both
//! ways, with velocities and accelerations (eq. (45)-(57), (62)).
//!
//! x_c1 is down, x_c2 outward, x_c3 the turn of the base, x_c4 its travel. The motors of x_c1 and
//! x_c2 move the pantograph's references y_r and x_r; the wrist moves 7 and 6 times as far.

use super::geometry::{BASE_ANGLE, D, DS, L4, L6, LEVEL};
use crate::robot::error::RobotError;
use std::f64::consts::FRAC_PI_2;

/// dx_c2/dx_r = L6/L4 (eq. (48)).
pub(crate) const OUTWARD_RATIO: f64 = L6 / L4;
/// -dx_c1/dy_r = (L4 + L6)/L4 (eq. (49)).
pub(crate) const DOWNWARD_RATIO: f64 = (L4 + L6) / L4;
/// x_c3 - q2: the encoder's alignment and a quarter turn; the report rounds it to 2.4 (eq. (57)).
pub(crate) const TURN_OFFSET: f64 = BASE_ANGLE + FRAC_PI_2;

/// |sin q5| below which a pose counts as singular; inside Table 5 it is above 0.6.
const SINGULAR: f64 = 1e-9;

/// References (x_r, y_r) in m of the coordinates x_c1, x_c2 (eq. (48), (49)).
#[inline]
pub fn references(x_c1: f64, x_c2: f64) -> (f64, f64) {
    (
        (x_c2 - D - DS) / OUTWARD_RATIO,
        (LEVEL - x_c1) / DOWNWARD_RATIO,
    )
}

/// Coordinates (x_c1, x_c2) in m of the references: the inverse of [`references`].
#[inline]
pub fn arm_coordinates(x_r: f64, y_r: f64) -> (f64, f64) {
    (LEVEL - DOWNWARD_RATIO * y_r, OUTWARD_RATIO * x_r + D + DS)
}

/// References (x_r, y_r) of the joints q4, q5 (eq. (46), (62)).
#[inline]
pub fn references_of_joints(q4: f64, q5: f64) -> (f64, f64) {
    let (s4, c4) = q4.sin_cos();
    let (s, c) = (q4 + q5).sin_cos();
    (-L4 * (s + s4), L4 * (c + c4))
}

/// Link angles (alpha, beta) in rad of the references, counter-clockwise (eq. (52), (53)).
///
/// The two links of length L4 make an isosceles triangle over r = hypot(x_r, y_r), so that
/// beta = gamma + theta and alpha = gamma - theta, which holds on both branches of (53) and is
/// well conditioned where its arcsine and arccosine are not. beta may pass pi: it is not wrapped.
///
/// # Errors
/// [`RobotError::OutOfReach`] where r is 0 or more than 2 L4 (the pantograph cannot get there).
#[inline]
pub fn link_angles(x_r: f64, y_r: f64) -> Result<(f64, f64), RobotError> {
    let r = x_r.hypot(y_r);
    if r.is_nan() || r == 0.0 || r > 2.0 * L4 {
        return Err(RobotError::OutOfReach {
            x_r,
            y_r,
            r,
            reach: 2.0 * L4,
        });
    }
    let gamma = y_r.atan2(-x_r);
    let theta = (r / (2.0 * L4)).acos();
    Ok((gamma - theta, gamma + theta))
}

/// Joints (q1, q2, q4, q5) of the coordinates (x_c1..x_c4) (eq. (57)).
///
/// # Errors
/// [`RobotError::OutOfReach`], see [`link_angles`]; never inside the limits of Table 5.
#[inline]
pub fn joints(x: &[f64; 4]) -> Result<[f64; 4], RobotError> {
    let (x_r, y_r) = references(x[0], x[1]);
    let (alpha, beta) = link_angles(x_r, y_r)?;
    Ok([
        x[3] + DS,
        x[2] - TURN_OFFSET,
        FRAC_PI_2 - beta,
        beta - alpha,
    ])
}

/// Coordinates (x_c1..x_c4) of the joints (eq. (62), (48), (49)).
#[inline]
pub fn cartesian(q: &[f64; 4]) -> [f64; 4] {
    let (x_r, y_r) = references_of_joints(q[2], q[3]);
    let (x_c1, x_c2) = arm_coordinates(x_r, y_r);
    [x_c1, x_c2, q[1] + TURN_OFFSET, q[0] - DS]
}

/// d(x_r, y_r)/d(q4, q5), rows x_r and y_r, in m/rad.
#[inline]
pub fn reference_jacobian(q: &[f64; 4]) -> [[f64; 2]; 2] {
    let (s4, c4) = q[2].sin_cos();
    let (s, c) = (q[2] + q[3]).sin_cos();
    [[-L4 * (c + c4), -L4 * c], [-L4 * (s + s4), -L4 * s]]
}

/// Time derivative of [`reference_jacobian`] at the velocities v, in m/(rad s).
#[inline]
pub fn reference_jacobian_rate(q: &[f64; 4], v: &[f64; 4]) -> [[f64; 2]; 2] {
    let (s4, c4) = q[2].sin_cos();
    let (s, c) = (q[2] + q[3]).sin_cos();
    let (v4, w) = (v[2], v[2] + v[3]);
    [
        [L4 * (s * w + s4 * v4), L4 * s * w],
        [-L4 * (c * w + c4 * v4), -L4 * c * w],
    ]
}

/// Velocities of x_c1..x_c4 at the pose q and the joint velocities v.
#[inline]
pub fn cartesian_velocities(q: &[f64; 4], v: &[f64; 4]) -> [f64; 4] {
    let [x, y] = reference_jacobian(q);
    [
        -DOWNWARD_RATIO * (y[0] * v[2] + y[1] * v[3]),
        OUTWARD_RATIO * (x[0] * v[2] + x[1] * v[3]),
        v[1],
        v[0],
    ]
}

/// Accelerations of x_c1..x_c4 at the pose q, joint velocities v and accelerations a.
#[inline]
pub fn cartesian_accelerations(q: &[f64; 4], v: &[f64; 4], a: &[f64; 4]) -> [f64; 4] {
    let [x, y] = reference_jacobian(q);
    let [dx, dy] = reference_jacobian_rate(q, v);
    let row = |j: [f64; 2], dj: [f64; 2]| j[0] * a[2] + j[1] * a[3] + dj[0] * v[2] + dj[1] * v[3];
    [
        -DOWNWARD_RATIO * row(y, dy),
        OUTWARD_RATIO * row(x, dx),
        a[1],
        a[0],
    ]
}

/// Joint velocities at the pose q of the velocities xd of x_c1..x_c4.
///
/// # Errors
/// [`RobotError::Singular`] where links 4 and 5 are in line (q5 a multiple of pi).
#[inline]
pub fn joint_velocities(q: &[f64; 4], xd: &[f64; 4]) -> Result<[f64; 4], RobotError> {
    let (v4, v5) = solve_references(q, xd[1] / OUTWARD_RATIO, -xd[0] / DOWNWARD_RATIO)?;
    Ok([xd[3], xd[2], v4, v5])
}

/// Joint accelerations at the pose q, joint velocities v, of the accelerations xdd of x_c1..x_c4.
#[inline]
pub fn joint_accelerations(
    q: &[f64; 4],
    v: &[f64; 4],
    xdd: &[f64; 4],
) -> Result<[f64; 4], RobotError> {
    let [dx, dy] = reference_jacobian_rate(q, v);
    let (a4, a5) = solve_references(
        q,
        xdd[1] / OUTWARD_RATIO - (dx[0] * v[2] + dx[1] * v[3]),
        -xdd[0] / DOWNWARD_RATIO - (dy[0] * v[2] + dy[1] * v[3]),
    )?;
    Ok([xdd[3], xdd[2], a4, a5])
}

/// Rates (of q4, q5) that give the rates (of x_r, y_r): the inverse of [`reference_jacobian`].
#[inline]
fn solve_references(q: &[f64; 4], x: f64, y: f64) -> Result<(f64, f64), RobotError> {
    let inverse = inverse_reference_jacobian(q)?;
    Ok((
        inverse[0][0] * x + inverse[0][1] * y,
        inverse[1][0] * x + inverse[1][1] * y,
    ))
}

/// d(q4, q5)/d(x_r, y_r), in rad/m; its determinant is 1/(L4 Delta_J) with Delta_J = L4 sin q5.
#[inline]
pub(crate) fn inverse_reference_jacobian(q: &[f64; 4]) -> Result<[[f64; 2]; 2], RobotError> {
    let (s4, c4) = q[2].sin_cos();
    let (s, c) = (q[2] + q[3]).sin_cos();
    let s5 = s * c4 - c * s4;
    if s5.is_nan() || s5.abs() < SINGULAR {
        return Err(RobotError::Singular { q5: q[3] });
    }
    let scale = 1.0 / (L4 * s5);
    Ok([
        [-s * scale, c * scale],
        [(s + s4) * scale, -(c + c4) * scale],
    ])
}
