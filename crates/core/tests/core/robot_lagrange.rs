//! A second derivation of the CFT robot's dynamics that shares nothing with the library: energies
//! of eight general links on the Denavit-Hartenberg chain of Table 2, differentiated by dual
//! numbers and put into Lagrange's equation.

use crate::robot_oracle;

use cft_ident_core::robot::cft::links::{PseudoInertia, base_parameters};
use cft_ident_core::robot::cft::{ReportCoefficients, dynamics, linkage, regressor};
use cft_ident_core::robot::tree::pose;
use num_dual::{Dual, DualNum, HyperDual64, HyperHyperDual64};
use robot_oracle::{Draw, Oracle, apply, assert_close, assert_close_rows};
use std::f64::consts::{FRAC_PI_2, PI};

type Links = [[[f64; 4]; 4]; 8];
type Transformation<D> = [[D; 4]; 4];

fn number<D: DualNum<Primitive = f64>>(x: f64) -> D {
    D::from(x)
}

/// Eq. (2): from frame i - 1 to frame i.
fn step<D: DualNum<Primitive = f64> + Copy>(alpha: f64, a: f64, d: D, q: D) -> Transformation<D> {
    let (zero, one) = (number::<D>(0.0), number::<D>(1.0));
    let (sa, ca) = (alpha.sin(), alpha.cos());
    let (s, c) = (q.sin(), q.cos());
    [
        [c, -s, zero, number(a)],
        [s * ca, c * ca, number(-sa), d * (-sa)],
        [s * sa, c * sa, number(ca), d * ca],
        [zero, zero, zero, one],
    ]
}

fn product<D: DualNum<Primitive = f64> + Copy>(
    a: &Transformation<D>,
    b: &Transformation<D>,
) -> Transformation<D> {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j] + a[i][3] * b[3][j]
        })
    })
}

/// Frames 1..8 over frame 0, numbers of Tables 1 and 2 typed in again.
fn frames<D: DualNum<Primitive = f64> + Copy>(q: &[D; 4]) -> [Transformation<D>; 8] {
    let q3 = ((q[2] + q[3]).sin() + q[2].sin()) * 0.05 + number::<D>(0.0916);
    let zero = number::<D>(0.0);
    let steps = [
        step(-FRAC_PI_2, 0.0, q[0], zero),
        step(FRAC_PI_2, 0.0, number(0.25), q[1]),
        step(-FRAC_PI_2, 0.0, q3, number(-FRAC_PI_2)),
        step(-FRAC_PI_2, 0.0, zero, q[2]),
        step(0.0, 0.05, zero, q[3]),
        step(0.0, 0.35, number(0.04), -q[3]),
        step(0.0, 0.30, number(-0.04), number::<D>(PI) - q[2]),
        step(0.0, 0.08, zero, number(FRAC_PI_2)),
    ];
    let mut frame = steps[0];
    std::array::from_fn(|i| {
        if i > 0 {
            frame = product(&frame, &steps[i]);
        }
        frame
    })
}

/// Kinetic energy 1/2 trace(dT/dt J dT/dt^T), eq. (5); dT/dt from one more dual part.
fn kinetic<D: DualNum<Primitive = f64> + Copy>(links: &Links, q: &[D; 4], v: &[D; 4]) -> D {
    let moving: [Dual<D>; 4] = std::array::from_fn(|i| Dual::new(q[i], v[i]));
    let mut energy = number::<D>(0.0);
    for (frame, j) in frames(&moving).iter().zip(links) {
        for row in &frame[..3] {
            for r in 0..4 {
                for c in 0..4 {
                    energy += row[r].eps * row[c].eps * (0.5 * j[r][c]);
                }
            }
        }
    }
    energy
}

/// Potential energy, eq. (9), with gravity along -z0.
fn potential<D: DualNum<Primitive = f64> + Copy>(links: &Links, q: &[D; 4]) -> D {
    let mut energy = number::<D>(0.0);
    for (frame, j) in frames(q).iter().zip(links) {
        for c in 0..4 {
            energy += frame[2][c] * (9.81 * j[c][3]);
        }
    }
    energy
}

/// Lagrange's equation: d/dt dL/dv_i - dL/dq_i.
fn lagrange(links: &Links, q: &[f64; 4], v: &[f64; 4], a: &[f64; 4]) -> [f64; 4] {
    std::array::from_fn(|i| {
        // eps1 along v_i; eps2 along the motion, (dq, dv) = (v, a).
        let along_q: [HyperDual64; 4] =
            std::array::from_fn(|k| HyperDual64::new(q[k], 0.0, v[k], 0.0));
        let along_v: [HyperDual64; 4] = std::array::from_fn(|k| {
            HyperDual64::new(v[k], if k == i { 1.0 } else { 0.0 }, a[k], 0.0)
        });
        let momentum_rate = kinetic(links, &along_q, &along_v).eps1eps2;
        let turned: [Dual<f64>; 4] =
            std::array::from_fn(|k| Dual::new(q[k], if k == i { 1.0 } else { 0.0 }));
        let fixed: [Dual<f64>; 4] = std::array::from_fn(|k| Dual::new(v[k], 0.0));
        momentum_rate - kinetic(links, &turned, &fixed).eps + potential(links, &turned).eps
    })
}

/// M and dM/dq_k, as derivatives of the kinetic energy.
fn inertia_and_derivatives(links: &Links, q: &[f64; 4]) -> ([[f64; 4]; 4], [[[f64; 4]; 4]; 4]) {
    let mut m = [[0.0; 4]; 4];
    let mut dm = [[[0.0; 4]; 4]; 4];
    let at = |re: f64, e1: bool, e2: bool, e3: bool| {
        let part = |on: bool| if on { 1.0 } else { 0.0 };
        HyperHyperDual64::new(re, part(e1), part(e2), part(e3), 0.0, 0.0, 0.0, 0.0)
    };
    for i in 0..4 {
        for j in 0..4 {
            for (k, along) in dm.iter_mut().enumerate() {
                let pose: [_; 4] = std::array::from_fn(|n| at(q[n], false, false, n == k));
                let speed: [_; 4] = std::array::from_fn(|n| at(0.0, n == i, n == j, false));
                let energy = kinetic(links, &pose, &speed);
                m[i][j] = energy.eps1eps2;
                along[i][j] = energy.eps1eps2eps3;
            }
        }
    }
    (m, dm)
}

fn random_links(draw: &mut Draw) -> Links {
    std::array::from_fn(|_| {
        // A sum of point masses is a physical body.
        let mut j = [[0.0; 4]; 4];
        for _ in 0..6 {
            let [x, y, z]: [f64; 3] = draw.vector(-0.3, 0.3);
            let (p, mass) = ([x, y, z, 1.0], draw.between(0.1, 3.0));
            for r in 0..4 {
                for c in 0..4 {
                    j[r][c] += mass * p[r] * p[c];
                }
            }
        }
        j
    })
}

/// Entries of pseudo-inertias that give theta_1..theta_12 and none of the ten that the printed
/// structure lacks: an algebraic choice, no body has to look so.
fn links_of_printed(theta: &[f64; 12]) -> Links {
    let [t1, t2, t3, t4, t5, t6, t7, t8, t9, t10, t11, t12] = *theta;
    let mut links = [[[0.0; 4]; 4]; 8];
    let mut set = |link: usize, r: usize, c: usize, value: f64| {
        links[link - 1][r][c] = value;
        links[link - 1][c][r] = value;
    };
    set(1, 3, 3, t1);
    set(2, 0, 3, t2);
    set(2, 1, 3, t3);
    set(2, 0, 0, t4);
    set(4, 0, 3, t5);
    set(4, 1, 3, t6);
    set(6, 0, 3, t7);
    set(6, 1, 3, t8);
    set(5, 0, 3, t9);
    set(5, 1, 3, t10);
    set(6, 3, 3, t11);
    set(8, 3, 3, t12);
    links
}

#[test]
fn the_regressor_of_22_equals_lagrange_on_random_robots() {
    let mut draw = Draw::new(1);
    for _ in 0..20 {
        let links = random_links(&mut draw);
        let theta = base_parameters(&links.map(PseudoInertia));
        for _ in 0..5 {
            let (q, v, a) = draw.state();
            let mut y = [[0.0; 22]; 4];
            regressor::regressor22(&q, &v, &a, &mut y);
            let want = lagrange(&links, &q, &v, &a);
            assert_close(&apply(&y, &theta), &want, 1e-11, "Y theta");
            let k = ReportCoefficients::from_theta22(&theta);
            assert_close(
                &dynamics::inverse_dynamics(&q, &v, &a, &k),
                &want,
                1e-11,
                "tau",
            );
        }
    }
}

#[test]
fn the_regressor_of_12_equals_lagrange_with_the_synthetic_theta() {
    let oracle = Oracle::load();
    let links = links_of_printed(&oracle.theta);
    for state in &oracle.states {
        let (q, v, a) = (&state.q, &state.v, &state.a);
        let mut y = [[0.0; 12]; 4];
        regressor::regressor12(q, v, a, &mut y);
        let want = lagrange(&links, q, v, a);
        assert_close(&apply(&y, &oracle.theta), &want, 1e-11, "Y theta");
    }
}

#[test]
fn each_column_of_the_regressor_is_the_lagrange_torque_of_a_unit_parameter() {
    let mut draw = Draw::new(2);
    for _ in 0..10 {
        let (q, v, a) = draw.state();
        let mut y = [[0.0; 12]; 4];
        regressor::regressor12(&q, &v, &a, &mut y);
        for p in 0..12 {
            let mut unit = [0.0; 12];
            unit[p] = 1.0;
            let want = lagrange(&links_of_printed(&unit), &q, &v, &a);
            let column = std::array::from_fn(|i| y[i][p]);
            assert_close(&column, &want, 1e-11, &format!("column {}", p + 1));
        }
    }
}

#[test]
fn the_algebraic_links_have_exactly_the_parameters_asked_for() {
    let mut draw = Draw::new(3);
    let theta: [f64; 12] = draw.vector(-3.0, 3.0);
    let base = base_parameters(&links_of_printed(&theta).map(PseudoInertia));
    for (i, value) in base.iter().enumerate() {
        let want = if i < 12 { theta[i] } else { 0.0 };
        assert!(
            (value - want).abs() < 1e-14,
            "parameter {i}: {value} and not {want}"
        );
    }
}

#[test]
fn inertia_and_christoffel_matrix_equal_the_derivatives_of_the_kinetic_energy() {
    let mut draw = Draw::new(4);
    for _ in 0..5 {
        let links = random_links(&mut draw);
        let k = ReportCoefficients::from_theta22(&base_parameters(&links.map(PseudoInertia)));
        let (q, v, _) = draw.state();
        let (m, dm) = inertia_and_derivatives(&links, &q);
        assert_close_rows(&dynamics::inertia(&q, &k), &m, 1e-11, "M");
        let mut c = [[0.0; 4]; 4];
        for i in 0..4 {
            for j in 0..4 {
                for (n, speed) in v.iter().enumerate() {
                    c[i][j] += 0.5 * (dm[n][i][j] + dm[j][i][n] - dm[i][j][n]) * speed;
                }
            }
        }
        assert_close_rows(&dynamics::coriolis(&q, &v, &k), &c, 1e-10, "C");
    }
}

#[test]
fn the_library_chain_equals_the_chain_of_this_test() {
    let chain = linkage::chain().unwrap();
    let mut draw = Draw::new(5);
    for _ in 0..50 {
        let (q, _, _) = draw.state();
        for ((rotation, origin), want) in pose::frames(&chain, &q).iter().zip(frames(&q)) {
            for (i, wanted) in want[..3].iter().enumerate() {
                let row = rotation[i];
                let joined = [row[0], row[1], row[2], origin[i]];
                assert_close(&joined, wanted, 1e-14, "frame");
            }
        }
    }
}
