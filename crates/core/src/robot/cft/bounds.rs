//! Bounds of M, C and G that hold at every pose (eq. (22)-(24)), and of F (eq. (25)).

use super::dynamics::Coefficients;
use super::geometry::{D, GRAVITY, L4};
use crate::robot::friction::DoubleTanh;

/// Constants of eq. (22)-(24), from the triangle inequality on the lumped coefficients: safe, not
/// tight. Norms are Euclidean, as the report's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// M_M: |M(q)| <= M_M.
    pub inertia: f64,
    /// C_M: |C(q, x)| <= C_M |x|.
    pub coriolis: f64,
    /// g_b: |G(q)| <= g_b, constant on this robot, whose q1 slides horizontally.
    pub gravity: f64,
}

impl Bounds {
    /// The bounds of one set of parameters.
    pub fn of(k: &Coefficients) -> Self {
        // |A sin x + B cos x| <= hypot(A, B).
        let [a, b, cc, e] = k.h;
        let (phi, psi) = (a.hypot(cc), b.hypot(e));
        let h = k.h0.abs() + phi + psi;
        let [aa, bb, c4c4, ee] = k.squares.map(f64::abs);
        let [ab, bc, ac, be] = k.products.map(f64::abs);
        let [oa, ob, oc, oe] = k.sideways;
        let (o_phi, o_psi) = (oa.hypot(oc), ob.hypot(oe));
        let (phi_lift, psi_lift) = (
            L4 * k.mr.abs() + 2.0 * a.abs(),
            L4 * k.mr.abs() + 2.0 * b.abs(),
        );
        let n = k.k.abs()
            + 2.0 * (D * (phi + psi) + 2.0 * k.radial.abs())
            + aa
            + bb
            + c4c4
            + ee
            + 2.0 * (ab + bc + ac + be);
        let p = aa + c4c4 + L4 * (phi_lift + 2.0 * cc.abs());
        let r = bb + ee + L4 * (psi_lift + 2.0 * e.abs());
        let cross = ab + bc + L4 * (L4 * k.mr.abs() + a.abs() + b.abs() + e.abs() + cc.abs());
        let turned = (k.o.abs()).hypot(h);
        let m = [
            [(k.t1 + k.mr).abs(), turned, phi, psi],
            [turned, n, o_phi, o_psi],
            [phi, o_phi, p, cross],
            [psi, o_psi, cross, r],
        ];
        // C in the angles is linear in (v2, v4, w): sums of its symbols bound it per |(v2, v4, w)|.
        let n_phi = D * phi + k.radial.abs() + aa + c4c4 + ab + bc + ac;
        let n_psi = D * psi + k.radial.abs() + bb + ee + ab + bc + be;
        let c = [
            [turned + phi + psi, 2.0 * phi, 2.0 * psi],
            [n_phi + n_psi, n_phi + o_phi, n_psi + o_psi],
            [n_phi, p, cross],
            [n_psi, cross, r],
        ];
        let frobenius = |rows: &[f64]| rows.iter().map(|x| x * x).sum::<f64>().sqrt();
        // (v4, v4 + v5) = S (v4, v5) with |S|^2 = (3 + sqrt 5)/2: M = S^T M' S, G = S^T G'.
        let shear = 0.5 * (3.0 + 5.0_f64.sqrt());
        Self {
            inertia: shear * frobenius(m.as_flattened()),
            coriolis: shear * shear.sqrt() * frobenius(c.as_flattened()),
            gravity: shear.sqrt() * GRAVITY * (L4 * k.mr.abs() + phi).hypot(L4 * k.mr.abs() + psi),
        }
    }
}

/// (b_v, b_f1, b_f2) with |F(v)| <= b_v |v| + b_f1 + b_f2 (eq. (25)).
pub fn friction_bounds(laws: &[DoubleTanh; 4]) -> (f64, f64, f64) {
    let norm =
        |part: fn(&DoubleTanh) -> f64| laws.iter().map(|law| part(law).powi(2)).sum::<f64>().sqrt();
    let viscous = laws.iter().fold(0.0_f64, |m, law| m.max(law.viscous.abs()));
    (
        viscous,
        norm(|law| law.coulomb_1),
        norm(|law| law.coulomb_2),
    )
}
