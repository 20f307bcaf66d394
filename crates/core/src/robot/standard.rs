//! Bodies in standard parameters: what the torques of a link are linear in.

use nalgebra::{Matrix3, Matrix4, SymmetricEigen};

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

/// Share of the largest second moment to which a description's digits are right: a thin plate of six digits is a body, and
/// no thinner than they can say. Half refuses plates of three digits, twice thickens links that are rods.
pub const WRITTEN: f64 = 1e-3;
/// The same of numbers that were computed. MuJoCo 4.0.0, sdformat and Drake 1.51.1 take exactly flat links turned at random
/// only from 1e-14 on; what this adds no torque shows, and half or twice is the same to all of them.
pub const COMPUTED: f64 = 1e-9;
/// Least moment of inertia that every reader takes [kg m^2]: ten times the 1e-14 from which MuJoCo 4.0.0 takes one. Half or twice
/// is the same to it, and a ten-thousandth of what a finger of a gram has.
pub const LEAST_MOMENT: f64 = 1e-13;

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

    /// The nearest body that can exist, of numbers that are right to a share `digits` of the largest second moment
    /// ([`WRITTEN`] or [`COMPUTED`]): one that is flatter than that is as flat as that. None where no body has the numbers.
    pub fn physical(&self, digits: f64) -> Option<Body> {
        let [xx, xy, xz, yy, yz, zz] = self.inertia;
        let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let mut numbers = self.inertia.iter().chain(&self.centre);
        if self.mass.is_nan() || self.mass <= 0.0 || !numbers.all(|x| x.is_finite()) {
            return None;
        }
        // integrals of x x' dm about the centre, which no body has below zero
        let second = Matrix3::from_diagonal_element(0.5 * tensor.trace()) - tensor;
        let mut axes = SymmetricEigen::new(second);
        let most = axes.eigenvalues.max();
        let thin = digits * most.max(0.0);
        let [x, y, z] = self.centre;
        let moved = COMPUTED * self.mass * (x * x + y * y + z * z);
        if axes.eigenvalues.min() < -(thin + moved) {
            return None;
        }
        let least = thin.max(0.5 * LEAST_MOMENT);
        if axes.eigenvalues.min() >= least {
            return Some(*self);
        }
        axes.eigenvalues.apply(|x| *x = x.max(least));
        let second = axes.recompose();
        let tensor = Matrix3::from_diagonal_element(second.trace()) - second;
        let places = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        Some(Body {
            inertia: places.map(|place| tensor[place]),
            ..*self
        })
    }

    /// Whether it is one of no extent, as descriptions have it whose moments nobody knew.
    pub fn is_point(&self) -> bool {
        let [xx, _, _, yy, _, zz] = self.inertia;
        xx + yy + zz < 10.0 * LEAST_MOMENT
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
    use nalgebra::{Rotation3, Vector3};

    /// A body of these second moments, turned by `turn` about a skew axis, with its centre off the frame.
    fn of_second_moments(moments: [f64; 3], mass: f64, turn: f64) -> Body {
        let turn = Rotation3::new(Vector3::new(0.3, -0.5, 0.8) * turn);
        let second = turn * Matrix3::from_diagonal(&moments.into()) * turn.transpose();
        let tensor = Matrix3::from_diagonal_element(second.trace()) - second;
        let places = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        Body {
            mass,
            centre: [0.1, -0.02, 0.3],
            inertia: places.map(|place| tensor[place]),
        }
    }

    /// Least second moment of a body over its largest.
    fn flatness(body: &Body) -> f64 {
        let about_centre = Body {
            centre: [0.0; 3],
            ..*body
        };
        let j = pseudo_inertia(&about_centre.standard());
        let second = j.fixed_view::<3, 3>(0, 0).symmetric_eigenvalues();
        second.min() / second.max()
    }

    #[test]
    fn a_flat_body_of_any_size_gets_the_thickness_of_its_digits_whatever_its_rounding() {
        for (size, mass) in [(1.0, 10.0), (1e-7, 1e-3)] {
            for k in 0..200 {
                let flat = of_second_moments([2.0 * size, size, 0.0], mass, 0.1 * f64::from(k));
                // by way of the origin, as fits have it
                let rounded = Body::of(&flat.standard());
                for digits in [WRITTEN, COMPUTED] {
                    let body = rounded.physical(digits).unwrap();
                    let thin = flatness(&body);
                    assert!(
                        (thin / digits.max(0.5 * LEAST_MOMENT / (2.0 * size)) - 1.0).abs() < 0.01,
                        "{thin:e}"
                    );
                    assert_eq!(body.mass, rounded.mass);
                }
            }
        }
    }

    #[test]
    fn a_body_with_extent_stays_as_it_is_and_what_no_body_can_be_is_none() {
        let body = of_second_moments([0.02, 0.01, 1e-4], 1.0, 0.7);
        assert_eq!(body.physical(COMPUTED), Some(body));
        for (mass, least) in [(0.0, 0.01), (-1.0, 0.01), (1.0, -1e-3), (f64::NAN, 0.01)] {
            let none = of_second_moments([0.02, 0.01, least], mass, 0.7);
            assert_eq!(none.physical(COMPUTED), None, "{mass} {least}");
        }
    }

    #[test]
    fn a_point_gets_the_least_moments_that_all_readers_take() {
        let point = Body::of(&of_second_moments([0.0; 3], 0.4, 0.0).standard());
        let body = point.physical(COMPUTED).unwrap();
        for k in [0, 3, 5] {
            assert!(
                (body.inertia[k] / LEAST_MOMENT - 1.0).abs() < 1e-2,
                "{body:?}"
            );
        }
        assert!(body.is_point() && point.is_point());
        assert!(!of_second_moments([1e-9, 0.0, 0.0], 1e-3, 0.4).is_point());
    }

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
