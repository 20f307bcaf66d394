//! Vectors and rotations in three dimensions.

pub type Vector = [f64; 3];
/// Rows of a matrix.
pub type Matrix = [[f64; 3]; 3];

pub fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub fn scaled(a: Vector, k: f64) -> Vector {
    [k * a[0], k * a[1], k * a[2]]
}

pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub fn times(m: &Matrix, a: Vector) -> Vector {
    [dot(m[0], a), dot(m[1], a), dot(m[2], a)]
}

/// The transpose of `m` times `a`.
pub fn back(m: &Matrix, a: Vector) -> Vector {
    add(
        add(scaled(m[0], a[0]), scaled(m[1], a[1])),
        scaled(m[2], a[2]),
    )
}

pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    [back(b, a[0]), back(b, a[1]), back(b, a[2])]
}

pub fn transposed(m: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| [m[0][i], m[1][i], m[2][i]])
}

pub fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    [add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])]
}

/// Rotation about z by an angle [rad].
pub fn about_z(angle: f64) -> Matrix {
    let (s, c) = angle.sin_cos();
    [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
}

/// Rotation of URDF's roll, pitch and yaw: about the fixed x, y and z [rad].
pub fn of_rpy(rpy: Vector) -> Matrix {
    let ([r, p, y], one) = (rpy, |s: f64, c: f64| (s, c));
    let ((sr, cr), (sp, cp)) = (one(r.sin(), r.cos()), one(p.sin(), p.cos()));
    let x = [[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]];
    let pitch = [[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]];
    product(&about_z(y), &product(&pitch, &x))
}

/// What a mass at `r` adds to the inertia about the origin: m (r.r 1 - r r').
pub fn of_point(mass: f64, r: Vector) -> Matrix {
    let square = dot(r, r);
    let of = |i: usize, j: usize| mass * (if i == j { square } else { 0.0 } - r[i] * r[j]);
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| of(i, j)))
}
