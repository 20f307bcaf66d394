//! Pantograph and Cartesian maps over the whole box of Table 5, and where the tool is.

use crate::robot_oracle;

use cft_ident_core::robot::RobotError;
use cft_ident_core::robot::cft::{LaboratorySetup, linkage, pantograph};
use cft_ident_core::robot::tree::pose;
use num_dual::{Dual2_64, DualNum};
use robot_oracle::{Draw, assert_close};

/// A grid over the box of both set-ups' limits, corners and edges included.
fn box_of_table_5() -> Vec<[f64; 4]> {
    let mut points = Vec::new();
    for setup in [LaboratorySetup::Tuedacs, LaboratorySetup::Dspace] {
        let limits = setup.limits();
        let (fine, coarse) = (32, 4);
        let at = |i: usize, n: usize, of: usize| {
            let part = n as f64 / of as f64;
            limits.lower[i] * (1.0 - part) + limits.upper[i] * part
        };
        for a in 0..=fine {
            for b in 0..=fine {
                for c in 0..=coarse {
                    for d in 0..=coarse {
                        points.push([
                            at(0, a, fine),
                            at(1, b, fine),
                            at(2, c, coarse),
                            at(3, d, coarse),
                        ]);
                    }
                }
            }
        }
    }
    points
}

#[test]
fn positions_return_from_the_joints_over_the_whole_box() {
    for x in box_of_table_5() {
        let q = pantograph::joints(&x).unwrap();
        assert_close(&pantograph::cartesian(&q), &x, 1e-12, "x_c");
        let again = pantograph::joints(&pantograph::cartesian(&q)).unwrap();
        assert_close(&again, &q, 1e-12, "q");
        assert!(q[3] > 0.77 && q[3] < 2.49, "q5 = {}", q[3]);
        let delta = 0.05 * q[3].sin();
        assert!(delta > 0.0306 && delta <= 0.05, "Delta_J = {delta}");
    }
}

#[test]
fn references_and_link_angles_return_over_the_whole_box() {
    let mut sides = [0, 0];
    for x in box_of_table_5() {
        let (x_r, y_r) = pantograph::references(x[0], x[1]);
        let (x_c1, x_c2) = pantograph::arm_coordinates(x_r, y_r);
        assert_close(&[x_c1, x_c2], &[x[0], x[1]], 1e-13, "x_c1, x_c2");
        let (alpha, beta) = pantograph::link_angles(x_r, y_r).unwrap();
        // Eq. (46).
        let back = [
            -0.05 * (alpha.cos() + beta.cos()),
            0.05 * (alpha.sin() + beta.sin()),
        ];
        assert_close(&back, &[x_r, y_r], 1e-12, "(46)");
        // Eq. (52) and both branches of (53).
        let r = x_r.hypot(y_r);
        let printed = (-x_r / r).acos() + (r / 0.1).acos();
        assert!(
            (beta - printed).abs() < 1e-12,
            "(52): {beta} and not {printed}"
        );
        let branch = match x_r < 0.0 {
            true => (y_r / 0.05 - beta.sin()).asin(),
            false => (-x_r / 0.05 - beta.cos()).acos(),
        };
        assert!(
            (alpha - branch).abs() < 1e-10,
            "(53) at {x_r}, {y_r}: {alpha} and not {branch}"
        );
        sides[usize::from(x_r >= 0.0)] += 1;
    }
    assert!(
        sides[0] > 1000 && sides[1] > 1000,
        "both branches are used: {sides:?}"
    );
}

#[test]
fn beta_passes_pi_unwrapped_at_the_far_low_corner() {
    let most = box_of_table_5()
        .iter()
        .map(|x| {
            let (x_r, y_r) = pantograph::references(x[0], x[1]);
            pantograph::link_angles(x_r, y_r).unwrap().1
        })
        .fold(0.0, f64::max);
    assert!((most - 3.50).abs() < 0.01, "beta reaches {most}");
}

#[test]
fn velocities_and_accelerations_return_over_the_whole_box() {
    let mut draw = Draw::new(21);
    for x in box_of_table_5() {
        let q = pantograph::joints(&x).unwrap();
        let (v, a): ([f64; 4], [f64; 4]) = (draw.vector(-2.0, 2.0), draw.vector(-8.0, 8.0));
        let xd = pantograph::cartesian_velocities(&q, &v);
        assert_close(
            &pantograph::joint_velocities(&q, &xd).unwrap(),
            &v,
            1e-11,
            "v",
        );
        let xdd = pantograph::cartesian_accelerations(&q, &v, &a);
        assert_close(
            &pantograph::joint_accelerations(&q, &v, &xdd).unwrap(),
            &a,
            1e-11,
            "a",
        );
    }
}

/// A motion through (q, v, a), as numbers that carry their first two time derivatives.
fn motion(q: &[f64; 4], v: &[f64; 4], a: &[f64; 4]) -> [Dual2_64; 4] {
    std::array::from_fn(|i| Dual2_64::new(q[i], v[i], a[i]))
}

#[test]
fn velocities_and_accelerations_are_the_time_derivatives_of_the_positions() {
    let mut draw = Draw::new(22);
    for _ in 0..200 {
        let (q, v, a) = draw.state();
        let m = motion(&q, &v, &a);
        let (phi, psi) = (m[2], m[2] + m[3]);
        let x_r = (psi.sin() + phi.sin()) * -0.05;
        let y_r = (psi.cos() + phi.cos()) * 0.05;
        let (x_c1, x_c2) = (y_r * -7.0 + 0.25, x_r * 6.0 + (0.0916 + 0.185));
        let xd = [x_c1.v1, x_c2.v1, v[1], v[0]];
        let xdd = [x_c1.v2, x_c2.v2, a[1], a[0]];
        assert_close(
            &pantograph::cartesian_velocities(&q, &v),
            &xd,
            1e-12,
            "dx_c/dt",
        );
        assert_close(
            &pantograph::cartesian_accelerations(&q, &v, &a),
            &xdd,
            1e-12,
            "d2x_c/dt2",
        );
    }
}

#[test]
fn the_rate_of_the_jacobian_is_its_rate() {
    let mut draw = Draw::new(23);
    for _ in 0..100 {
        let (q, v, _) = draw.state();
        let h = 1e-4;
        let moved = |s: f64| std::array::from_fn(|i| q[i] + s * h * v[i]);
        let (back, ahead) = (
            pantograph::reference_jacobian(&moved(-1.0)),
            pantograph::reference_jacobian(&moved(1.0)),
        );
        let rate = pantograph::reference_jacobian_rate(&q, &v);
        for i in 0..2 {
            for n in 0..2 {
                let difference = (ahead[i][n] - back[i][n]) / (2.0 * h);
                assert!((rate[i][n] - difference).abs() < 1e-7);
            }
        }
    }
}

#[test]
fn the_tool_stays_horizontal_in_every_pose() {
    let chain = linkage::chain().unwrap();
    let mut draw = Draw::new(25);
    for _ in 0..200 {
        let (q, _, _) = draw.state();
        let (rotation, _) = pose::frames(&chain, &q)[7];
        // Its y axis is the vertical of frame 0.
        let up: [f64; 3] = std::array::from_fn(|i| rotation[i][1]);
        assert_close(&up, &[0.0, 0.0, 1.0], 1e-13, "up");
    }
}

#[test]
fn the_wrist_of_eq_44_is_the_chain_without_the_tool() {
    let chain = linkage::chain().unwrap();
    for x in box_of_table_5() {
        let q = pantograph::joints(&x).unwrap();
        let (s, c) = (x[2] - 0.8292).sin_cos();
        let reach = x[1] - 0.185;
        let wrist = [reach * c, x[3] + 0.185 + reach * s, 0.5 - x[0]];
        assert_close(&pose::origins(&chain, &q)[6], &wrist, 1e-12, "frame 7");
    }
}

#[test]
fn measured_spans_of_eq_50_and_51_agree_with_the_drawing() {
    for x in box_of_table_5() {
        let (x_r, y_r) = pantograph::references(x[0], x[1]);
        let by_span = (x[1] + 0.0269) / 6.0 - 0.0506;
        assert!((x_r - by_span).abs() < 5e-5, "(50): {x_r} and {by_span}");
        let by_span = (0.0232 - x[0]) / 7.0 + 0.03235;
        // Exactly 5e-5 m everywhere, 0.0324 against the printed 0.03235.
        assert!(
            (y_r - by_span - 5e-5).abs() < 1e-15,
            "(51): {y_r} and {by_span}"
        );
    }
}

#[test]
fn a_pose_out_of_reach_or_singular_is_refused_with_its_numbers() {
    let error = pantograph::joints(&[-0.6, 0.2766, 2.4, 0.1]).unwrap_err();
    assert!(matches!(error, RobotError::OutOfReach { .. }), "{error}");
    assert!(error.to_string().contains("0.100000 m"), "{error}");
    assert!(pantograph::joints(&[f64::NAN, 0.2766, 2.4, 0.1]).is_err());
    let error = pantograph::joint_velocities(&[0.1, 0.2, 0.3, 0.0], &[0.1; 4]).unwrap_err();
    assert_eq!(error, RobotError::Singular { q5: 0.0 });
}
