//! The Denavit-Hartenberg chain of the CFT robot (Table 2, eq. (1), (2)), and where its tool is
//! (eq. (44), (54), (58), (59)).
//!
//! Frame 0 lies in the plane of the rails with y0 along them and z0 up. Three of the seven joints
//! follow the others: the pantograph gives q3 (56) and q6 = -q5, the tool's guide q7 (54).

use super::geometry::{BASE_ANGLE, D, D6, DS, L2, L4, L5, L6, L7, L8, LEVEL, U};
use std::f64::consts::{FRAC_PI_2, PI};

/// A frame seen from another: its axes as the columns of `rotation`, its origin in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidTransform {
    pub rotation: [[f64; 3]; 3],
    pub origin: [f64; 3],
}

/// A frame's row of Table 2 in the convention of eq. (2) (Craig): alpha and a of the link before
/// it, then d and the angle of its own joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CraigRow {
    /// alpha_(i-1) in rad, about x_(i-1).
    pub alpha: f64,
    /// a_(i-1) in m, along x_(i-1).
    pub a: f64,
    /// d_i in m, along z_i.
    pub d: f64,
    /// q_i in rad, about z_i.
    pub angle: f64,
}

impl RigidTransform {
    /// The reference frame itself.
    pub(crate) const IDENTITY: Self = Self {
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        origin: [0.0; 3],
    };

    /// The transformation T of eq. (2).
    pub fn of_row(row: &CraigRow) -> Self {
        let (s, c) = row.angle.sin_cos();
        let (sa, ca) = row.alpha.sin_cos();
        Self {
            rotation: [[c, -s, 0.0], [s * ca, c * ca, -sa], [s * sa, c * sa, ca]],
            origin: [row.a, -row.d * sa, row.d * ca],
        }
    }

    /// The frame `next`, which is given in this one, seen from where this one is given.
    pub fn then(&self, next: &Self) -> Self {
        let r = &self.rotation;
        let rotation = std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..3).map(|k| r[i][k] * next.rotation[k][j]).sum())
        });
        Self {
            rotation,
            origin: self.point(&next.origin),
        }
    }

    /// A point of this frame, in m, seen from where the frame is given.
    pub fn point(&self, p: &[f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| {
            let r = &self.rotation[i];
            self.origin[i] + r[0] * p[0] + r[1] * p[1] + r[2] * p[2]
        })
    }
}

/// The dependent joints (q3 in m, q6 and q7 in rad) of q = (q1, q2, q4, q5) (eq. (54), (56)).
pub(crate) fn dependent_joints(q: &[f64; 4]) -> [f64; 3] {
    let q3 = L4 * ((q[2] + q[3]).sin() + q[2].sin()) + D;
    [q3, -q[3], PI - q[2]]
}

/// The nine rows of Table 2 at the pose q.
pub fn rows(q: &[f64; 4]) -> [CraigRow; 9] {
    let [q3, q6, q7] = dependent_joints(q);
    let row = |alpha, a, d, angle| CraigRow { alpha, a, d, angle };
    [
        row(-FRAC_PI_2, 0.0, q[0], 0.0),
        row(FRAC_PI_2, 0.0, L2, q[1]),
        row(-FRAC_PI_2, 0.0, q3, -FRAC_PI_2),
        row(-FRAC_PI_2, 0.0, 0.0, q[2]),
        row(0.0, L4, 0.0, q[3]),
        row(0.0, L5, D6, q6),
        row(0.0, L6, -D6, q7),
        row(0.0, L7, 0.0, FRAC_PI_2),
        row(0.0, L8, 0.0, 0.0),
    ]
}

/// Frames 1..9 seen from frame 0 (eq. (58)); the last is the tool's.
pub fn frames(q: &[f64; 4]) -> [RigidTransform; 9] {
    let mut frame = RigidTransform::IDENTITY;
    rows(q).map(|row| {
        frame = frame.then(&RigidTransform::of_row(&row));
        frame
    })
}

/// Position of the tool's end in frame 0, in m (eq. (59) in the form
/// (-h sin q2, q1 + h cos q2, z), h the reach from the axis of q2).
pub fn tool_position(q: &[f64; 4]) -> [f64; 3] {
    let (s2, c2) = q[1].sin_cos();
    let (s4, c4) = q[2].sin_cos();
    let (s, c) = (q[2] + q[3]).sin_cos();
    let h = L8 + D - L6 * s4 - U * s;
    [-h * s2, q[0] + h * c2, L2 - L7 + (L4 + L6) * c4 + L5 * c]
}

/// Orientation of the tool in frame 0, its axes as columns: x outward, y up, z to the side. It
/// turns with q2 only, for the tool stays horizontal (eq. (54)).
pub fn tool_orientation(q: &[f64; 4]) -> [[f64; 3]; 3] {
    let (s2, c2) = q[1].sin_cos();
    [[-s2, 0.0, c2], [c2, 0.0, s2], [0.0, 1.0, 0.0]]
}

/// Velocity of the tool's end in frame 0, in m/s.
pub fn tool_velocity(q: &[f64; 4], v: &[f64; 4]) -> [f64; 3] {
    let (s2, c2) = q[1].sin_cos();
    let (s4, c4) = q[2].sin_cos();
    let (s, c) = (q[2] + q[3]).sin_cos();
    let (v2, v4, w) = (v[1], v[2], v[2] + v[3]);
    let h = L8 + D - L6 * s4 - U * s;
    let dh = -L6 * c4 * v4 - U * c * w;
    [
        -dh * s2 - h * c2 * v2,
        v[0] + dh * c2 - h * s2 * v2,
        -(L4 + L6) * s4 * v4 - L5 * s * w,
    ]
}

/// Acceleration of the tool's end in frame 0, in m/s^2.
pub fn tool_acceleration(q: &[f64; 4], v: &[f64; 4], a: &[f64; 4]) -> [f64; 3] {
    let (s2, c2) = q[1].sin_cos();
    let (s4, c4) = q[2].sin_cos();
    let (s, c) = (q[2] + q[3]).sin_cos();
    let (v2, v4, w) = (v[1], v[2], v[2] + v[3]);
    let (a2, a4, aw) = (a[1], a[2], a[2] + a[3]);
    let h = L8 + D - L6 * s4 - U * s;
    let dh = -L6 * c4 * v4 - U * c * w;
    let ddh = L6 * (s4 * v4 * v4 - c4 * a4) + U * (s * w * w - c * aw);
    // Along the arm and across it, in the frame that turns with q2.
    let (along, across) = (ddh - h * v2 * v2, 2.0 * dh * v2 + h * a2);
    [
        -along * s2 - across * c2,
        a[0] + along * c2 - across * s2,
        -(L4 + L6) * (s4 * a4 + c4 * v4 * v4) - L5 * (s * aw + c * w * w),
    ]
}

/// Position of the wrist P_e (the origin of frame 7) in frame 0, in m, from the Cartesian
/// coordinates x_c1..x_c4 (eq. (44)).
pub fn wrist_position(x: &[f64; 4]) -> [f64; 3] {
    let (s, c) = (x[2] - BASE_ANGLE).sin_cos();
    let reach = x[1] - DS;
    [reach * c, x[3] + DS + reach * s, L2 + LEVEL - x[0]]
}
