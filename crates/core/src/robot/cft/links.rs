//! From the masses of the eight moving links to theta (Table 4, eq. (5)-(9), (15)-(17)).
//!
//! A pseudo-inertia holds all of a rigid body that its dynamics see: J = integral of p p^T dm with
//! p = (x, y, z, 1) in the Denavit-Hartenberg frame of its link. Of the 80 numbers of eight links
//! 22 combinations can be distinguished from the outside, the base parameters.

use super::geometry::{D, D6, L4, L5, L6};

/// Pseudo-inertia of a link about the origin of its frame: symmetric, last row m (lx, ly, lz, 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PseudoInertia(pub [[f64; 4]; 4]);

/// The 22 base parameters of links 1..8, in the order of [`super::EXTENDED`].
pub fn base_parameters(links: &[PseudoInertia; 8]) -> [f64; 22] {
    let m = |i: usize| links[i - 1].0[3][3];
    let mx = |i: usize| links[i - 1].0[0][3];
    let my = |i: usize| links[i - 1].0[1][3];
    let mz = |i: usize| links[i - 1].0[2][3];
    let xx = |i: usize| links[i - 1].0[0][0];
    let yy = |i: usize| links[i - 1].0[1][1];
    let zz = |i: usize| links[i - 1].0[2][2];
    let xy = |i: usize| links[i - 1].0[0][1];
    let xz = |i: usize| links[i - 1].0[0][2];
    let yz = |i: usize| links[i - 1].0[1][2];

    let delta = (xx(4) + xx(6) - L4 * L4 * (m(3) + m(4))) / (L6 * L6);
    let t11 = m(3) + m(4) + m(5) + m(6) - delta;
    let beyond = D6 * (m(6) - t11);
    let radial = my(7) + mx(8);
    [
        m(1) + m(2),
        mx(2) + my(3) + mz(4) + mz(5) + mz(6) + mz(7) + mz(8) + beyond,
        my(2) + mz(3) + radial,
        xx(2)
            + yy(2)
            + yy(3)
            + zz(3)
            + zz(4)
            + zz(5)
            + zz(6)
            + yy(7)
            + zz(7)
            + xx(8)
            + zz(8)
            + 2.0 * D6 * mz(6)
            + D6 * beyond
            + 2.0 * D * (mz(3) + radial),
        mx(4) - L4 * (m(3) + m(4)),
        my(4),
        mx(6) - L6 * delta,
        my(6),
        mx(5) - L5 * (m(3) + m(4) + m(5)),
        my(5),
        t11,
        m(7) + m(8) + delta,
        xx(5) - L5 * L5 * (m(3) + m(4) + m(5)),
        yy(5),
        yy(4) + yy(6),
        xy(4) + xy(6),
        xy(5),
        L4 * mz(3) - L6 * radial,
        -(yz(4) + yz(6)),
        -yz(5),
        L4 * (my(3) + mz(4)) - xz(4) - xz(6) - L6 * (mz(7) + mz(8)) - D6 * L6 * delta,
        L4 * (my(3) + mz(4) + mz(5)) - xz(5) - L6 * (mz(6) + mz(7) + mz(8))
            + D6 * L6 * (m(3) + m(4) + m(5) - delta),
    ]
}
