//! The regressor Y(q, v, a) of eq. (26) and (39): M a + C v + G = Y theta.
//!
//! Each lumped coefficient of [`super::dynamics`] owns one column of generalised forces
//! (q1, q2, phi = q4, psi = q4 + q5), got from the Lagrangian term by term; theta's columns are
//! sums of these, as the coefficients are sums of theta. Three sine-cosine pairs serve them all.

use super::geometry::{D, D6, GRAVITY, L4, L6, U};

type Column = [f64; 4];

/// Columns of the 22 base parameters in their order; joint rows q1, q2, then angle rows phi and psi.
#[inline(always)]
fn columns(q: &[f64; 4], v: &[f64; 4], a: &[f64; 4]) -> [Column; 22] {
    let (s2, c2) = q[1].sin_cos();
    let (s4, c4) = q[2].sin_cos();
    let (s, c) = (q[2] + q[3]).sin_cos();
    let (s5, c5) = (s * c4 - c * s4, c * c4 + s * s4);
    let (a1, a2, a4, aw) = (a[0], a[1], a[2], a[2] + a[3]);
    let (v2, v4, w) = (v[1], v[2], v[2] + v[3]);
    let (v2v2, v4v4, ww) = (v2 * v2, v4 * v4, w * w);
    // First and second time derivatives of sin and cos of phi and psi.
    let (ds4, dc4, ds, dc) = (c4 * v4, -s4 * v4, c * w, -s * w);
    let (dds4, ddc4) = (c4 * a4 - s4 * v4v4, -s4 * a4 - c4 * v4v4);
    let (dds, ddc) = (c * aw - s * ww, -s * aw - c * ww);
    // The crank raises the whole arm by L4 (cos phi + cos psi).
    let lift = L4 * (ddc4 + ddc) + GRAVITY;
    let (lift_phi, lift_psi) = (-L4 * s4, -L4 * s);

    let turn = s2 * a2 + c2 * v2v2;
    let pull = a1 * c2 - D * v2v2;
    let twice_s2v2 = 2.0 * s2 * v2;
    // Rows q1 and q2 of a part f of the radial moment H, which enters N as 2 d f.
    let row1 = |f: f64, df: f64, ddf: f64| ddf * c2 - df * twice_s2v2 - f * turn;
    let row2 = |f: f64, df: f64| f * (2.0 * D * a2 - a1 * s2) + df * 2.0 * D * v2;
    // Row q2 of a part n of N.
    let axis = |n: f64, dn: f64| n * a2 + dn * v2;
    let t1 = [a1, 0.0, 0.0, 0.0];
    let mr = [a1, 0.0, lift * lift_phi, lift * lift_psi];
    let o = [c2 * a2 - s2 * v2v2, a1 * c2, 0.0, 0.0];
    let h0 = [-turn, -a1 * s2, 0.0, 0.0];
    let k = [0.0, a2, 0.0, 0.0];
    let ha = [
        row1(s4, ds4, dds4),
        row2(s4, ds4),
        pull * c4 - ddc4 * lift_phi + lift * s4,
        -ddc4 * lift_psi,
    ];
    let hb = [
        row1(s, ds, dds),
        row2(s, ds),
        -ddc * lift_phi,
        pull * c - ddc * lift_psi + lift * s,
    ];
    let hc = [
        row1(c4, dc4, ddc4),
        row2(c4, dc4),
        -pull * s4 + dds4 * lift_phi + lift * c4,
        dds4 * lift_psi,
    ];
    let he = [
        row1(c, dc, ddc),
        row2(c, dc),
        dds * lift_phi,
        -pull * s + dds * lift_psi + lift * c,
    ];
    let aa = [0.0, axis(s4 * s4, 2.0 * s4 * ds4), a4 - v2v2 * s4 * c4, 0.0];
    let bb = [0.0, axis(s * s, 2.0 * s * ds), 0.0, aw - v2v2 * s * c];
    let ab = [
        0.0,
        2.0 * axis(s4 * s, ds4 * s + s4 * ds),
        c5 * aw - s5 * ww - v2v2 * c4 * s,
        c5 * a4 + s5 * v4v4 - v2v2 * s4 * c,
    ];
    let bc = [
        0.0,
        2.0 * axis(s * c4, ds * c4 + s * dc4),
        s5 * aw + c5 * ww + v2v2 * s * s4,
        s5 * a4 - c5 * v4v4 - v2v2 * c * c4,
    ];
    let ac = [
        0.0,
        2.0 * axis(s4 * c4, ds4 * c4 + s4 * dc4),
        v2v2 * (s4 * s4 - c4 * c4),
        0.0,
    ];
    let be = [
        0.0,
        2.0 * axis(s * c, ds * c + s * dc),
        0.0,
        v2v2 * (s * s - c * c),
    ];
    let oa = [0.0, dds4, a2 * c4, 0.0];
    let ob = [0.0, dds, 0.0, a2 * c];
    let oc = [0.0, ddc4, -a2 * s4, 0.0];
    let oe = [0.0, ddc, 0.0, -a2 * s];
    let c4c4 = [0.0, axis(c4 * c4, 2.0 * c4 * dc4), a4 + v2v2 * s4 * c4, 0.0];
    let ee = [0.0, axis(c * c, 2.0 * c * dc), 0.0, aw + v2v2 * s * c];
    let rs = [0.0, 2.0 * axis(s4 + s, ds4 + ds), -v2v2 * c4, -v2v2 * c];
    [
        t1,
        o,
        h0,
        k,
        sum([(-1.0, &ha), (-2.0 * L4, &aa), (-L4, &ab)]),
        sum([(-1.0, &hc), (-L4, &ac), (-L4, &bc)]),
        sum([(-1.0, &ha), (U, &ab), (-D6, &oa)]),
        sum([(-1.0, &hc), (U, &bc), (-D6, &oc)]),
        sum([(-1.0, &hb), (-2.0 * L4, &bb)]),
        sum([(-1.0, &he), (-L4, &be)]),
        sum([
            (1.0, &mr),
            (D6, &o),
            (D, &h0),
            (D * D + D6 * D6, &k),
            (-U, &hb),
            (U * U, &bb),
            (-D6 * U, &ob),
        ]),
        sum([
            (1.0, &mr),
            (D, &h0),
            (D * D, &k),
            (-L6, &ha),
            (-U, &hb),
            (L6 * L6, &aa),
            (U * L6, &ab),
            (U * U, &bb),
        ]),
        bb,
        ee,
        c4c4,
        ac,
        be,
        rs,
        oc,
        oe,
        oa,
        ob,
    ]
}

/// Sum of columns with constant weights.
#[inline(always)]
fn sum<const N: usize>(terms: [(f64, &Column); N]) -> Column {
    let mut out = [0.0; 4];
    for (weight, column) in terms {
        for i in 0..4 {
            out[i] += weight * column[i];
        }
    }
    out
}

/// Writes a column of generalised forces; a turn of q4 turns both phi and psi.
#[inline(always)]
fn place<const P: usize>(y: &mut [[f64; P]; 4], j: usize, column: &Column) {
    y[0][j] = column[0];
    y[1][j] = column[1];
    y[2][j] = column[2] + column[3];
    y[3][j] = column[3];
}

/// Y(q, v, a), 4 x 12, of theta_1..theta_12 (eq. (26)): `y[i][j]` is the torque on joint i of
/// (q1, q2, q4, q5) per unit of theta_(j+1).
#[inline]
pub fn regressor12(q: &[f64; 4], v: &[f64; 4], a: &[f64; 4], y: &mut [[f64; 12]; 4]) {
    for (j, column) in columns(q, v, a)[..12].iter().enumerate() {
        place(y, j, column);
    }
}

/// Y(q, v, a), 4 x 22, of the full rigid-body chain: theta_1..theta_12, then BB, EE, CC, AC, BE,
/// S, OC, OE, OA, OB.
#[inline]
pub fn regressor22(q: &[f64; 4], v: &[f64; 4], a: &[f64; 4], y: &mut [[f64; 22]; 4]) {
    for (j, column) in columns(q, v, a).iter().enumerate() {
        place(y, j, column);
    }
}
