//! Bodies in standard parameters: what the torques of a link are linear in.

use nalgebra::Matrix4;

/// Standard parameters of a body: Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the origin of its frame
/// [kg m^2], first moments mx, my, mz [kg m], mass [kg]. Ixy is an entry of the tensor, the
/// negative of the integral of x y dm.
pub const STANDARD: usize = 10;
/// Their names, in this order.
pub const STANDARD_NAMES: [&str; STANDARD] = [
    "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz", "mx", "my", "mz", "m",
];

/// Pseudo-inertia (4 x 4, about the frame's origin) of standard parameters.
pub fn pseudo_inertia(s: &[f64; STANDARD]) -> Matrix4<f64> {
    let [xx, xy, xz, yy, yz, zz, mx, my, mz, m] = *s;
    let half = 0.5 * (xx + yy + zz);
    Matrix4::from([
        [half - xx, -xy, -xz, mx],
        [-xy, half - yy, -yz, my],
        [-xz, -yz, half - zz, mz],
        [mx, my, mz, m],
    ])
}

/// Standard parameters of a pseudo-inertia: the inverse of [`pseudo_inertia`].
pub fn standard_of(j: &Matrix4<f64>) -> [f64; STANDARD] {
    let (a, b, c) = (j[(0, 0)], j[(1, 1)], j[(2, 2)]);
    [
        b + c,
        -j[(0, 1)],
        -j[(0, 2)],
        a + c,
        -j[(1, 2)],
        a + b,
        j[(0, 3)],
        j[(1, 3)],
        j[(2, 3)],
        j[(3, 3)],
    ]
}

/// Mass properties as drawings give them: mass [kg], centre of gravity [m], and Ixx, Ixy, Ixz, Iyy,
/// Iyz, Izz about it [kg m^2].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    pub mass: f64,
    pub centre: [f64; 3],
    pub inertia: [f64; 6],
}

impl Body {
    /// The body of standard parameters; without a mass its centre is the origin.
    pub fn of(s: &[f64; STANDARD]) -> Self {
        let [xx, xy, xz, yy, yz, zz, mx, my, mz, m] = *s;
        let [x, y, z] = match m {
            0.0 => [0.0; 3],
            _ => [mx / m, my / m, mz / m],
        };
        Body {
            mass: m,
            centre: [x, y, z],
            inertia: [
                xx - m * (y * y + z * z),
                xy + m * x * y,
                xz + m * x * z,
                yy - m * (x * x + z * z),
                yz + m * y * z,
                zz - m * (x * x + y * y),
            ],
        }
    }

    /// Its standard parameters (Steiner).
    pub fn standard(&self) -> [f64; STANDARD] {
        let (m, [x, y, z]) = (self.mass, self.centre);
        let [xx, xy, xz, yy, yz, zz] = self.inertia;
        [
            xx + m * (y * y + z * z),
            xy - m * x * y,
            xz - m * x * z,
            yy + m * (x * x + z * z),
            yz - m * y * z,
            zz + m * (x * x + y * y),
            m * x,
            m * y,
            m * z,
            m,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_and_its_standard_parameters_belong_together() {
        let body = Body {
            mass: 2.5,
            centre: [0.1, -0.2, 0.05],
            inertia: [0.03, 0.002, -0.001, 0.04, 0.003, 0.05],
        };
        let back = Body::of(&body.standard());
        assert!((back.mass - body.mass).abs() < 1e-15);
        for (a, b) in back.inertia.iter().zip(&body.inertia) {
            assert!((a - b).abs() < 1e-15, "{a} {b}");
        }
        let s = body.standard();
        let hollow = [0.03, 0.0, 0.0, 0.04, 0.0, 0.05, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(Body::of(&hollow).centre, [0.0; 3]);
        assert_eq!(Body::of(&hollow).standard(), hollow);
        let round = standard_of(&pseudo_inertia(&s));
        for (a, b) in round.iter().zip(&s) {
            assert!((a - b).abs() < 1e-15, "{a} {b}");
        }
    }
}
