//! M, C and G of eq. (60) in closed form.
//!
//! The printed Appendix B, with its slips put right, shrinks to a few functions when it is written
//! in the angles phi = q4 and psi = q4 + q5 and in lumped coefficients. With H(phi, psi) the first
//! radial moment of the arm, N its second moment about the axis of q2, and P, X, R its planar
//! inertia,
//!
//! ```text
//! 2 T = (t1 + Mr) v1^2 + 2 v1 d/dt(O sin q2 + H cos q2) + N v2^2 + 2 v2 d/dt(Q)
//!     + P v4^2 + 2 X v4 w + R w^2,                      w = v4 + v5
//! ```
//!
//! where Q(phi, psi) is the product of inertia of the radial and the sideways direction. Joint
//! order is (q1, q2, q4, q5), units are SI.

use super::geometry::{D, D6, GRAVITY, L4, L6, U};

/// The coefficients of the closed form, linear in theta_1..theta_12 and in the ten base parameters
/// that the printed structure leaves out. Computed once for many samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReportCoefficients {
    /// theta_1 = m1 + m2 (kg): the mass that only q1 moves.
    pub t1: f64,
    /// Mr (kg): what q1 moves besides theta_1.
    pub mr: f64,
    /// O (kg m): first moment sideways to the arm.
    pub o: f64,
    /// H0 (kg m): constant part of the radial first moment H.
    pub h0: f64,
    /// Parts of H in sin q4, sin(q4+q5), cos q4, cos(q4+q5) (kg m): A, B, Cc, E.
    pub h: [f64; 4],
    /// K (kg m^2): constant part of N.
    pub k: f64,
    /// Parts of N in sin^2 q4, sin^2(q4+q5), cos^2 q4, cos^2(q4+q5) (kg m^2): AA, BB, CC, EE.
    pub squares: [f64; 4],
    /// Half the parts of N in sin q4 sin(q4+q5), sin(q4+q5) cos q4, sin q4 cos q4 and
    /// sin(q4+q5) cos(q4+q5) (kg m^2): AB, BC, AC, BE.
    pub products: [f64; 4],
    /// Half the part of N in sin q4 + sin(q4+q5) beyond d H (kg m^2): S.
    pub radial: f64,
    /// Parts of Q in sin q4, sin(q4+q5), cos q4, cos(q4+q5) (kg m^2): OA, OB, OC, OE.
    pub sideways: [f64; 4],
}

impl ReportCoefficients {
    /// From theta_1..theta_12 of Table 4 (SI).
    pub fn from_theta12(theta: &[f64; 12]) -> Self {
        let [t1, t2, t3, t4, t5, t6, t7, t8, t9, t10, t11, t12] = *theta;
        let mr = t11 + t12;
        Self {
            t1,
            mr,
            o: t2 + D6 * t11,
            h0: t3 + D * mr,
            h: [-(t5 + t7 + L6 * t12), -(t9 + U * mr), -(t6 + t8), -t10],
            k: t4 + D * D * mr + D6 * D6 * t11,
            squares: [
                L6 * L6 * t12 - 2.0 * L4 * t5,
                U * U * mr - 2.0 * L4 * t9,
                0.0,
                0.0,
            ],
            products: [
                U * (L6 * t12 + t7) - L4 * t5,
                U * t8 - L4 * t6,
                -L4 * t6,
                -L4 * t10,
            ],
            radial: 0.0,
            sideways: [-D6 * t7, -D6 * U * t11, -D6 * t8, 0.0],
        }
    }

    /// From the 22 base parameters: theta_1..theta_12, then BB, EE, CC, AC, BE, S, OC, OE, OA, OB.
    pub fn from_theta22(theta: &[f64; 22]) -> Self {
        let printed = theta.first_chunk().expect("12 of 22");
        let [bb, ee, cc, ac, be, s, oc, oe, oa, ob] = *theta.last_chunk().expect("10 of 22");
        let mut full = Self::from_theta12(printed);
        full.squares[1] += bb;
        full.squares[2] += cc;
        full.squares[3] += ee;
        full.products[2] += ac;
        full.products[3] += be;
        full.radial += s;
        full.sideways[0] += oa;
        full.sideways[1] += ob;
        full.sideways[2] += oc;
        full.sideways[3] += oe;
        full
    }
}

/// Sines and cosines of q2, q4, q4 + q5 and q5: everything below is a polynomial in them.
type Pose = [f64; 8];

fn pose(q: &[f64; 4]) -> Pose {
    let (s2, c2) = q[1].sin_cos();
    let (s4, c4) = q[2].sin_cos();
    let (s, c) = (q[2] + q[3]).sin_cos();
    [s2, c2, s4, c4, s, c, s * c4 - c * s4, c * c4 + s * s4]
}

/// M in the velocities (v1, v2, v4, w), upper part as [M12, M1phi, M1psi, M22, M2phi, M2psi, P, X, R] with M11 apart.
fn inertia_in_angles(p: &Pose, k: &ReportCoefficients) -> [f64; 9] {
    let [s2, c2, s4, c4, s, c, s5, c5] = *p;
    let [a, b, cc, e] = k.h;
    let moving = a * s4 + b * s + cc * c4 + e * c;
    let radial = k.h0 + moving;
    let n = k.k
        + 2.0 * (D * moving + k.radial * (s4 + s))
        + k.squares[0] * s4 * s4
        + k.squares[1] * s * s
        + k.squares[2] * c4 * c4
        + k.squares[3] * c * c
        + 2.0
            * (k.products[0] * s4 * s
                + k.products[1] * s * c4
                + k.products[2] * s4 * c4
                + k.products[3] * s * c);
    let m = L4 * k.mr;
    [
        k.o * c2 - radial * s2,
        (a * c4 - cc * s4) * c2,
        (b * c - e * s) * c2,
        n,
        k.sideways[0] * c4 - k.sideways[2] * s4,
        k.sideways[1] * c - k.sideways[3] * s,
        k.squares[0] + k.squares[2] + L4 * ((m - 2.0 * a) * s4 * s4 - 2.0 * cc * s4 * c4),
        k.products[0] * c5
            + k.products[1] * s5
            + L4 * ((m - a - b) * s4 * s - e * s4 * c - cc * c4 * s),
        k.squares[1] + k.squares[3] + L4 * ((m - 2.0 * b) * s * s - 2.0 * e * s * c),
    ]
}

/// Christoffel matrix in the velocities (v1, v2, v4, w), columns 2, phi, psi; the first is zero.
fn christoffel_in_angles(p: &Pose, k: &ReportCoefficients, v: &[f64; 4]) -> [[f64; 3]; 4] {
    let [s2, c2, s4, c4, s, c, s5, c5] = *p;
    let (v2, v4, w) = (v[1], v[2], v[2] + v[3]);
    let [a, b, cc, e] = k.h;
    let radial = k.h0 + a * s4 + b * s + cc * c4 + e * c;
    let (h_phi, h_psi) = (a * c4 - cc * s4, b * c - e * s);
    let (h_phi_phi, h_psi_psi) = (-(a * s4 + cc * c4), -(b * s + e * c));
    let [aa, bb, c4c4, ee] = k.squares;
    let [ab, bc, ac, be] = k.products;
    // Halves of the derivatives of N.
    let n_phi = D * h_phi + k.radial * c4 + (aa - c4c4) * s4 * c4 + ab * c4 * s - bc * s * s4
        + ac * (c4 * c4 - s4 * s4);
    let n_psi = D * h_psi
        + k.radial * c
        + (bb - ee) * s * c
        + ab * s4 * c
        + bc * c * c4
        + be * (c * c - s * s);
    let [oa, ob, oc, oe] = k.sideways;
    let m = L4 * k.mr;
    // Half of dP/dphi, dX/dphi, dX/dpsi, half of dR/dpsi.
    let p_phi = L4 * ((m - 2.0 * a) * s4 * c4 - cc * (c4 * c4 - s4 * s4));
    let r_psi = L4 * ((m - 2.0 * b) * s * c - e * (c * c - s * s));
    let x_phi = ab * s5 - bc * c5 + L4 * ((m - a - b) * c4 * s - e * c4 * c + cc * s4 * s);
    let x_psi = -ab * s5 + bc * c5 + L4 * ((m - a - b) * s4 * c + e * s4 * s - cc * c4 * c);
    [
        [
            -(k.o * s2 + radial * c2) * v2 - s2 * (h_phi * v4 + h_psi * w),
            -h_phi * s2 * v2 + h_phi_phi * c2 * v4,
            -h_psi * s2 * v2 + h_psi_psi * c2 * w,
        ],
        [
            n_phi * v4 + n_psi * w,
            n_phi * v2 - (oa * s4 + oc * c4) * v4,
            n_psi * v2 - (ob * s + oe * c) * w,
        ],
        [-n_phi * v2, p_phi * v4, x_psi * w],
        [-n_psi * v2, x_phi * v4, r_psi * w],
    ]
}

fn gravity_in_angles(p: &Pose, k: &ReportCoefficients) -> [f64; 2] {
    let [_, _, s4, c4, s, c, ..] = *p;
    let [a, b, cc, e] = k.h;
    let m = L4 * k.mr;
    [
        GRAVITY * ((a - m) * s4 + cc * c4),
        GRAVITY * ((b - m) * s + e * c),
    ]
}

fn inertia_in_joints(k: &ReportCoefficients, m: [f64; 9]) -> [[f64; 4]; 4] {
    let [m12, m1phi, m1psi, m22, m2phi, m2psi, p, x, r] = m;
    let (m13, m23, m34) = (m1phi + m1psi, m2phi + m2psi, x + r);
    [
        [k.t1 + k.mr, m12, m13, m1psi],
        [m12, m22, m23, m2psi],
        [m13, m23, p + 2.0 * x + r, m34],
        [m1psi, m2psi, m34, r],
    ]
}

/// Inertia matrix M(q) of eq. (60), symmetric, joint order (q1, q2, q4, q5); kg, kg m, kg m^2.
pub fn inertia(q: &[f64; 4], k: &ReportCoefficients) -> [[f64; 4]; 4] {
    inertia_in_joints(k, inertia_in_angles(&pose(q), k))
}

/// Coriolis matrix C(q, v) in the Christoffel form of eq. (16), so that dM/dt - 2 C is skew (19).
pub fn coriolis(q: &[f64; 4], v: &[f64; 4], k: &ReportCoefficients) -> [[f64; 4]; 4] {
    let [r1, r2, phi, psi] = christoffel_in_angles(&pose(q), k, v);
    let row = |r: [f64; 3]| [0.0, r[0], r[1] + r[2], r[2]];
    [
        row(r1),
        row(r2),
        row([phi[0] + psi[0], phi[1] + psi[1], phi[2] + psi[2]]),
        row(psi),
    ]
}

/// Gravity torque G(q) of eq. (60), (17), in N and N m; zero on q1 and q2.
pub fn gravity_torque(q: &[f64; 4], k: &ReportCoefficients) -> [f64; 4] {
    let [phi, psi] = gravity_in_angles(&pose(q), k);
    [0.0, 0.0, phi + psi, psi]
}

/// M(q) and C(q, v) v + G(q) from one set of sines and cosines: what an integrator needs.
pub fn inertia_and_bias(
    q: &[f64; 4],
    v: &[f64; 4],
    k: &ReportCoefficients,
) -> ([[f64; 4]; 4], [f64; 4]) {
    let p = pose(q);
    let m = inertia_in_joints(k, inertia_in_angles(&p, k));
    let c = christoffel_in_angles(&p, k, v);
    let [g_phi, g_psi] = gravity_in_angles(&p, k);
    let w = v[2] + v[3];
    let row = |r: [f64; 3]| r[0] * v[1] + r[1] * v[2] + r[2] * w;
    let psi = row(c[3]) + g_psi;
    (m, [row(c[0]), row(c[1]), row(c[2]) + g_phi + psi, psi])
}

/// Torque without friction, M a + C v + G, in N and N m.
pub fn inverse_dynamics(
    q: &[f64; 4],
    v: &[f64; 4],
    a: &[f64; 4],
    k: &ReportCoefficients,
) -> [f64; 4] {
    let (m, bias) = inertia_and_bias(q, v, k);
    std::array::from_fn(|i| {
        bias[i] + m[i][0] * a[0] + m[i][1] * a[1] + m[i][2] * a[2] + m[i][3] * a[3]
    })
}

/// x with M x = b by L D L^T written out, without roots; `None` where the symmetric M is not positive definite.
#[inline]
pub(crate) fn solve_positive(m: &[[f64; 4]; 4], b: &[f64; 4]) -> Option<[f64; 4]> {
    let d0 = m[0][0];
    let i0 = 1.0 / d0;
    let (l1, l2, l3) = (m[0][1] * i0, m[0][2] * i0, m[0][3] * i0);
    let d1 = m[1][1] - l1 * m[0][1];
    let i1 = 1.0 / d1;
    let (n12, n13) = (m[1][2] - l1 * m[0][2], m[1][3] - l1 * m[0][3]);
    let (l12, l13) = (n12 * i1, n13 * i1);
    let d2 = m[2][2] - l2 * m[0][2] - l12 * n12;
    let i2 = 1.0 / d2;
    let n23 = m[2][3] - l2 * m[0][3] - l12 * n13;
    let l23 = n23 * i2;
    let d3 = m[3][3] - l3 * m[0][3] - l13 * n13 - l23 * n23;
    if !(d0 > 0.0 && d1 > 0.0 && d2 > 0.0 && d3 > 0.0) {
        return None;
    }
    let y0 = b[0];
    let y1 = b[1] - l1 * y0;
    let y2 = b[2] - l2 * y0 - l12 * y1;
    let y3 = b[3] - l3 * y0 - l13 * y1 - l23 * y2;
    let x3 = y3 / d3;
    let x2 = y2 * i2 - l23 * x3;
    let x1 = y1 * i1 - l12 * x2 - l13 * x3;
    Some([y0 * i0 - l1 * x1 - l2 * x2 - l3 * x3, x1, x2, x3])
}
