//! From the standard parameters of links and drives to the parameters that torques can tell.

use nalgebra::{DMatrix, Matrix4};

use super::Robot;
use super::cft::Structure;
use super::cft::links::{PseudoInertia, base_parameters};

/// Standard parameters of a body: Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the origin of its frame
/// [kg m^2], first moments mx, my, mz [kg m], mass [kg]. Ixy is an entry of the tensor, the
/// negative of the integral of x y dm.
pub const STANDARD: usize = 10;
/// Moving links of the CFT robot.
const CFT_LINKS: usize = 8;

/// How a robot's inertial parameters follow from links and drives.
#[derive(Debug, Clone, PartialEq)]
pub struct StandardMap {
    /// Names of the links.
    pub links: Vec<String>,
    /// Joints whose drives have an inertia of their own.
    pub drives: Vec<usize>,
    /// Parameters x (ten a link, then the drives). Rows of zeros belong to parameters that no link
    /// and no drive has a part in: couplings of gear trains.
    pub matrix: DMatrix<f64>,
}

impl StandardMap {
    /// Number of standard parameters.
    pub fn columns(&self) -> usize {
        self.matrix.ncols()
    }
}

/// Pseudo-inertia (4 x 4, about the frame's origin) of standard parameters.
pub fn pseudo_inertia(s: &[f64; STANDARD]) -> Matrix4<f64> {
    let [xx, xy, xz, yy, yz, zz, mx, my, mz, m] = *s;
    let half = 0.5 * (xx + yy + zz);
    Matrix4::new(
        half - xx,
        -xy,
        -xz,
        mx, //
        -xy,
        half - yy,
        -yz,
        my, //
        -xz,
        -yz,
        half - zz,
        mz, //
        mx,
        my,
        mz,
        m,
    )
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

impl Robot {
    /// How the inertial parameters follow from the standard parameters of links and drives.
    pub fn standard_map(&self) -> StandardMap {
        let p = self.parameters().len();
        match self {
            Robot::Serial(robot) => {
                let links = robot.chain().links();
                let first = STANDARD * links.len();
                let count = robot.standard_parameters();
                let mut matrix = DMatrix::zeros(p, count);
                for (row, grouping) in robot.groupings().iter().enumerate() {
                    matrix[(row, grouping.kept)] = 1.0;
                    for (index, c) in &grouping.terms {
                        matrix[(row, *index)] = *c;
                    }
                }
                StandardMap {
                    links: links.iter().map(|l| l.name.clone()).collect(),
                    drives: (0..count - first).collect(),
                    matrix,
                }
            }
            Robot::Cft(robot) => {
                let count = STANDARD * CFT_LINKS;
                let kept = match robot.structure {
                    Structure::Printed12 => 12,
                    Structure::Full22 => 22,
                };
                let mut matrix = DMatrix::zeros(p, count);
                for column in 0..count {
                    let mut unit = [0.0; STANDARD];
                    unit[column % STANDARD] = 1.0;
                    let mut links = [PseudoInertia([[0.0; 4]; 4]); CFT_LINKS];
                    // symmetric: rows are columns
                    links[column / STANDARD] = PseudoInertia(pseudo_inertia(&unit).into());
                    for (row, x) in base_parameters(&links).into_iter().enumerate().take(kept) {
                        matrix[(row, column)] = x;
                    }
                }
                StandardMap {
                    links: (1..=CFT_LINKS).map(|i| format!("link_{i}")).collect(),
                    drives: Vec::new(),
                    matrix,
                }
            }
            // one moving body: all that shows is its mass, or its moment about the axis
            Robot::SingleJoint(robot) => {
                let mut matrix = DMatrix::zeros(1, STANDARD);
                matrix[(
                    0,
                    if robot.kind.torque_unit() == "N" {
                        9
                    } else {
                        5
                    },
                )] = 1.0;
                StandardMap {
                    links: vec!["link_1".to_owned()],
                    drives: Vec::new(),
                    matrix,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::cft::{Setup, links::Link};

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

    #[test]
    fn the_map_of_the_cft_robot_gives_its_base_parameters() {
        let link = |i: f64| Link {
            mass: 2.0 + i,
            centre: [0.1 * i, -0.03, 0.02 * i],
            moments: [0.2 + 0.01 * i, 0.3, 0.25],
            products: [0.01, -0.02 * i, 0.004],
        };
        let links: [Link; CFT_LINKS] = std::array::from_fn(|i| link(i as f64));
        let pseudo: [PseudoInertia; CFT_LINKS] = std::array::from_fn(|i| (&links[i]).into());
        let robot = Robot::cft(Setup::default(), Structure::Full22);
        let mut standard = Vec::new();
        for p in &pseudo {
            standard.extend(standard_of(&Matrix4::from(p.0)));
        }
        let found = robot.standard_map().matrix * nalgebra::DVector::from_vec(standard);
        for (a, b) in found.iter().zip(base_parameters(&pseudo)) {
            assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{a} {b}");
        }
    }
}
