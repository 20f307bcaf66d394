//! Vectors and rotations of three dimensions, as the recursion needs them.

/// A vector in some frame.
pub type Vector = [f64; 3];
/// A rotation: the axes of a frame as the columns of the matrix, seen from another frame.
pub type Rotation = [[f64; 3]; 3];

/// The rotation that does nothing.
pub const UNTURNED: Rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// a x b.
#[inline(always)]
pub fn cross(a: &Vector, b: &Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// a . b.
#[inline(always)]
pub fn dot(a: &Vector, b: &Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a + b.
#[inline(always)]
pub fn add(a: &Vector, b: &Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// s a.
#[inline(always)]
pub fn times(s: f64, a: &Vector) -> Vector {
    [s * a[0], s * a[1], s * a[2]]
}

/// R a.
#[inline(always)]
pub fn turn(r: &Rotation, a: &Vector) -> Vector {
    [dot(&r[0], a), dot(&r[1], a), dot(&r[2], a)]
}

/// R' a.
#[inline(always)]
pub(crate) fn turn_back(r: &Rotation, a: &Vector) -> Vector {
    [
        r[0][0] * a[0] + r[1][0] * a[1] + r[2][0] * a[2],
        r[0][1] * a[0] + r[1][1] * a[1] + r[2][1] * a[2],
        r[0][2] * a[0] + r[1][2] * a[1] + r[2][2] * a[2],
    ]
}

/// A B.
#[inline(always)]
pub fn product(a: &Rotation, b: &Rotation) -> Rotation {
    let mut c = [[0.0; 3]; 3];
    for (row, a) in c.iter_mut().zip(a) {
        for (j, x) in row.iter_mut().enumerate() {
            *x = a[0] * b[0][j] + a[1] * b[1][j] + a[2] * b[2][j];
        }
    }
    c
}

/// Rotation by `angle` [rad] about a unit axis (Rodrigues).
#[inline(always)]
pub fn about(axis: &Vector, angle: f64) -> Rotation {
    let (s, c) = angle.sin_cos();
    let [x, y, z] = *axis;
    let k = 1.0 - c;
    [
        [c + k * x * x, k * x * y - s * z, k * x * z + s * y],
        [k * x * y + s * z, c + k * y * y, k * y * z - s * x],
        [k * x * z - s * y, k * y * z + s * x, c + k * z * z],
    ]
}

/// Rotation of roll, pitch and yaw about the fixed axes x, y, z, as URDF writes it [rad].
pub fn of_roll_pitch_yaw(rpy: &Vector) -> Rotation {
    let x = about(&[1.0, 0.0, 0.0], rpy[0]);
    let y = about(&[0.0, 1.0, 0.0], rpy[1]);
    let z = about(&[0.0, 0.0, 1.0], rpy[2]);
    product(&z, &product(&y, &x))
}

/// Roll, pitch and yaw of a rotation [rad], to the last digits also where the pitch is near
/// +-pi/2: there roll and yaw turn about almost the same axis, and the roll is what the yaw, taken
/// first, leaves of the turn.
pub fn roll_pitch_yaw(r: &Rotation) -> Vector {
    let pitch = (-r[2][0]).atan2(r[0][0].hypot(r[1][0]));
    let yaw = r[1][0].atan2(r[0][0]);
    let (s, c) = yaw.sin_cos();
    let roll = (s * r[0][2] - c * r[1][2]).atan2(c * r[1][1] - s * r[0][1]);
    [roll, pitch, yaw]
}
