//! The arm as a serial chain whose pantograph and tool guide are dependent joints (Table 2, eq.
//! (54), (56)), and links that have given base parameters: what exports and comparisons start from.

use super::geometry::{D, D6, GRAVITY, L2, L4, L5, L6, L7};
use super::links::PseudoInertia;
use crate::robot::joint::JointKind;
use crate::robot::standard::standard_of;
use crate::robot::tree::{Coordinate, DependentCoordinate, Link, SineTerm, Tree, TreeError};
use nalgebra::Matrix4;
use std::f64::consts::{FRAC_PI_2, PI};

/// Moving links 1..8; link 8 is at rest on link 7 and a frame of its own in Table 2.
pub(crate) const LINKS: usize = 8;

/// The chain of Table 2, its joints q1, q2, q4, q5.
///
/// # Errors
/// None: a test builds it.
pub fn chain() -> Result<Tree, TreeError> {
    use JointKind::{Prismatic, Revolute};
    let sine = |of: Vec<(usize, f64)>| SineTerm {
        amplitude: L4,
        phase: 0.0,
        of,
    };
    let follows = |offset, linear, sines| {
        Coordinate::Follows(DependentCoordinate {
            offset,
            linear,
            sines,
        })
    };
    let q3 = follows(
        D,
        Vec::new(),
        vec![sine(vec![(2, 1.0), (3, 1.0)]), sine(vec![(2, 1.0)])],
    );
    let q6 = follows(0.0, vec![(3, -1.0)], Vec::new());
    let q7 = follows(PI, vec![(2, -1.0)], Vec::new());
    let at_rest = follows(0.0, Vec::new(), Vec::new());
    let rows: [(f64, f64, f64, f64, JointKind, Coordinate); LINKS] = [
        (0.0, -FRAC_PI_2, 0.0, 0.0, Prismatic, Coordinate::Joint(0)),
        (0.0, FRAC_PI_2, L2, 0.0, Revolute, Coordinate::Joint(1)),
        (0.0, -FRAC_PI_2, 0.0, -FRAC_PI_2, Prismatic, q3),
        (0.0, -FRAC_PI_2, 0.0, 0.0, Revolute, Coordinate::Joint(2)),
        (L4, 0.0, 0.0, 0.0, Revolute, Coordinate::Joint(3)),
        (L5, 0.0, D6, 0.0, Revolute, q6),
        (L6, 0.0, -D6, 0.0, Revolute, q7),
        (L7, 0.0, 0.0, FRAC_PI_2, Revolute, at_rest),
    ];
    let links = rows
        .into_iter()
        .enumerate()
        .map(|(i, (a, alpha, d, theta, kind, coordinate))| {
            let (rotation, origin) = Link::of_row(a, alpha, d, theta);
            Link {
                name: format!("link_{}", i + 1),
                parent: i.checked_sub(1),
                rotation,
                origin,
                axis: [0.0, 0.0, 1.0],
                kind,
                coordinate,
            }
        })
        .collect();
    Tree::new(links, super::JOINTS.len(), [0.0, 0.0, -GRAVITY])
}

/// Of the many links with these base parameters those with delta = 0 and only the masses m1, m6 and m7: no picture.
pub(crate) fn links_of(theta: &[f64; 22]) -> [PseudoInertia; LINKS] {
    let t = |number: usize| theta[number - 1];
    let [bb, ee, cc, ac, be, s, oc, oe, oa, ob] = *theta.last_chunk().expect("10 of 22");
    let mut links = [[[0.0; 4]; 4]; LINKS];
    let mut set = |link: usize, r: usize, c: usize, x: f64| {
        links[link - 1][r][c] = x;
        links[link - 1][c][r] = x;
    };
    const X: usize = 0;
    const Y: usize = 1;
    const Z: usize = 2;
    const ONE: usize = 3;
    // S = L4 m3 lz3 - L6 (m7 ly7 + m8 lx8), all of it in link 7
    let radial = -s / L6;
    set(1, ONE, ONE, t(1));
    set(2, X, ONE, t(2));
    set(2, Y, ONE, t(3) - radial);
    set(2, X, X, t(4) - 2.0 * D * radial);
    set(7, Y, ONE, radial);
    set(4, X, ONE, t(5));
    set(4, Y, ONE, t(6));
    set(6, X, ONE, t(7));
    set(6, Y, ONE, t(8));
    set(5, X, ONE, t(9));
    set(5, Y, ONE, t(10));
    set(6, ONE, ONE, t(11));
    set(7, ONE, ONE, t(12));
    set(5, X, X, bb);
    set(5, Y, Y, ee);
    set(4, Y, Y, cc);
    set(4, X, Y, ac);
    set(5, X, Y, be);
    set(4, Y, Z, -oc);
    set(5, Y, Z, -oe);
    set(4, X, Z, -oa);
    set(5, X, Z, -ob);
    links.map(PseudoInertia)
}

impl PseudoInertia {
    /// Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the origin of the frame [kg m^2], first moments [kg m] and
    /// mass [kg]: I = trace(J) 1 - J.
    pub fn standard(&self) -> [f64; 10] {
        standard_of(&Matrix4::from(self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::links::base_parameters;
    use super::*;

    #[test]
    fn links_of_base_parameters_have_these() {
        let theta: [f64; 22] =
            std::array::from_fn(|i| 1.0 + 0.37 * i as f64 * (-1f64).powi(i as i32));
        let back = base_parameters(&links_of(&theta));
        for (x, y) in theta.iter().zip(&back) {
            assert!((x - y).abs() < 1e-13 * (1.0 + x.abs()), "{x} {y}");
        }
    }

    #[test]
    fn the_chain_is_one() {
        assert_eq!(chain().unwrap().links().len(), LINKS);
    }
}
