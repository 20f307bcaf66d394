//! Properties (19)-(21) and (26) of the dynamic model, over the whole workspace.

use crate::robot_oracle;

use cft_ident_core::robot::cft::{
    LaboratorySetup, ParameterStructure, ReportCoefficients, dynamics, pantograph, regressor,
};
use cft_ident_core::robot::friction::DoubleTanh;
use cft_ident_core::robot::{JointKind, Robot};
use nalgebra::{DMatrix, Matrix4};
use robot_oracle::{Draw, Oracle, apply, assert_close, assert_close_rows};

/// 22 parameters whose every entry matters.
fn full_theta(oracle: &Oracle) -> [f64; 22] {
    let extra = [0.3, 0.1, 0.05, -0.04, 0.03, -0.2, 0.02, -0.015, 0.06, 0.04];
    std::array::from_fn(|i| {
        if i < 12 {
            oracle.theta[i]
        } else {
            extra[i - 12]
        }
    })
}

/// dM/dt along v by a central difference of fourth order.
fn inertia_rate(q: &[f64; 4], v: &[f64; 4], k: &ReportCoefficients) -> [[f64; 4]; 4] {
    let h = 1e-3;
    let at = |s: f64| dynamics::inertia(&std::array::from_fn(|i| q[i] + s * h * v[i]), k);
    let (m2, m1, p1, p2) = (at(-2.0), at(-1.0), at(1.0), at(2.0));
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            (m2[i][j] - 8.0 * m1[i][j] + 8.0 * p1[i][j] - p2[i][j]) / (12.0 * h)
        })
    })
}

#[test]
fn the_rate_of_inertia_less_twice_coriolis_is_skew() {
    let oracle = Oracle::load();
    let mut draw = Draw::new(11);
    for k in [
        ReportCoefficients::from_theta12(&oracle.theta),
        ReportCoefficients::from_theta22(&full_theta(&oracle)),
    ] {
        for _ in 0..200 {
            let (q, v, _) = draw.state();
            let rate = inertia_rate(&q, &v, &k);
            let c = dynamics::coriolis(&q, &v, &k);
            for i in 0..4 {
                for j in 0..4 {
                    let skew = rate[i][j] - c[i][j] - c[j][i];
                    assert!(skew.abs() < 1e-8, "({i}, {j}): {skew}");
                }
            }
            let x: [f64; 4] = draw.vector(-1.0, 1.0);
            let n = apply(&rate, &x);
            let cx = apply(&c, &x);
            let form: f64 = (0..4).map(|i| x[i] * (n[i] - 2.0 * cx[i])).sum();
            assert!(form.abs() < 1e-8, "x'(dM/dt - 2C)x = {form}");
        }
    }
}

#[test]
fn the_coriolis_matrix_is_linear_in_velocity_and_swaps_its_velocities() {
    let oracle = Oracle::load();
    let k = ReportCoefficients::from_theta22(&full_theta(&oracle));
    let mut draw = Draw::new(12);
    for _ in 0..200 {
        let (q, x, _) = draw.state();
        let (y, z): ([f64; 4], [f64; 4]) = (draw.vector(-2.0, 2.0), draw.vector(-2.0, 2.0));
        let alpha = draw.between(-3.0, 3.0);
        let c = |v: &[f64; 4]| dynamics::coriolis(&q, v, &k);
        // C(q, x) y = C(q, y) x, for the matrices of (20) are symmetric.
        assert_close(&apply(&c(&x), &y), &apply(&c(&y), &x), 1e-12, "(21) swap");
        let joined = c(&std::array::from_fn(|i| z[i] + alpha * x[i]));
        let (left, right) = (c(&z), c(&x));
        let sum =
            std::array::from_fn(|i| std::array::from_fn(|j| left[i][j] + alpha * right[i][j]));
        assert_close_rows(&joined, &sum, 1e-12, "(21) sum");
    }
}

#[test]
fn inertia_is_symmetric_positive_definite_over_the_workspace() {
    let oracle = Oracle::load();
    let k = ReportCoefficients::from_theta12(&oracle.theta);
    let limits = LaboratorySetup::Tuedacs.limits();
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    let steps = 24;
    let at = |i: usize, n: usize| {
        limits.lower[i] + (limits.upper[i] - limits.lower[i]) * n as f64 / steps as f64
    };
    for a in 0..=steps {
        for b in 0..=steps {
            for c in 0..=steps {
                let x = [at(0, a), at(1, b), at(2, c), 0.2];
                let m = dynamics::inertia(&pantograph::joints(&x).unwrap(), &k);
                let m = Matrix4::from_fn(|i, j| m[i][j]);
                assert_eq!(m, m.transpose());
                let eigenvalues = m.symmetric_eigenvalues();
                least = least.min(eigenvalues.min());
                most = most.max(eigenvalues.max());
            }
        }
    }
    assert!(least > 0.07 && least < 0.08, "least eigenvalue {least}");
    assert!(most > 128.0 && most < 130.0, "largest eigenvalue {most}");
}

#[test]
fn friction_opposes_motion() {
    let oracle = Oracle::load();
    let laws = DoubleTanh::cft_joints(&oracle.friction);
    let mut draw = Draw::new(14);
    for _ in 0..2000 {
        let v: [f64; 4] = draw.vector(-3.0, 3.0);
        for (law, v) in laws.iter().zip(v) {
            assert!(law.torque(v) * v >= 0.0);
            assert_eq!(law.torque(-v), -law.torque(v));
        }
    }
}

#[test]
fn torque_is_linear_in_theta_and_equals_the_regressor() {
    let oracle = Oracle::load();
    let mut draw = Draw::new(15);
    let theta = full_theta(&oracle);
    for _ in 0..100 {
        let (q, v, a) = draw.state();
        let other: [f64; 22] = draw.vector(-2.0, 2.0);
        let mixed: [f64; 22] = std::array::from_fn(|i| 0.7 * theta[i] - 1.3 * other[i]);
        let tau = |theta: &[f64; 22]| {
            dynamics::inverse_dynamics(&q, &v, &a, &ReportCoefficients::from_theta22(theta))
        };
        let (first, second) = (tau(&theta), tau(&other));
        let sum = std::array::from_fn(|i| 0.7 * first[i] - 1.3 * second[i]);
        assert_close(&tau(&mixed), &sum, 1e-12, "linear");
        let mut y = [[0.0; 22]; 4];
        regressor::regressor22(&q, &v, &a, &mut y);
        assert_close(&apply(&y, &theta), &first, 1e-12, "Y theta");
    }
}

#[test]
fn accelerations_of_torques_are_those_that_need_them() {
    let oracle = Oracle::load();
    let robot = Robot::cft(LaboratorySetup::default(), ParameterStructure::default());
    let accelerations = |theta: &[f64; 12], q: &[f64; 4], v: &[f64; 4], tau: [f64; 4]| {
        let dynamics = robot.dynamics(theta);
        let (mut mass, mut bias) = ([0.0; 16], [0.0; 4]);
        dynamics.inertia_and_bias(q, v, &mut mass, &mut bias);
        let mut a = std::array::from_fn(|i| tau[i] - bias[i]);
        dynamics.solve(&mut mass, &mut a).then_some(a)
    };
    let k = ReportCoefficients::from_theta12(&oracle.theta);
    let mut draw = Draw::new(16);
    for _ in 0..200 {
        let (q, v, a) = draw.state();
        let tau = dynamics::inverse_dynamics(&q, &v, &a, &k);
        let found = accelerations(&oracle.theta, &q, &v, tau).unwrap();
        assert_close(&found, &a, 1e-10, "a");
    }
    let still = [0.0; 4];
    assert_eq!(accelerations(&[-1.0; 12], &still, &still, still), None);
}

fn rank_of_random_states(robot: &Robot, q1_accelerates: bool) -> usize {
    let columns = robot.parameters().len();
    let mut draw = Draw::new(17);
    let mut stacked = DMatrix::zeros(4 * 200, columns);
    for n in 0..200 {
        let (q, v, mut a) = draw.state();
        if !q1_accelerates {
            a[0] = 0.0;
        }
        let mut y = vec![0.0; 4 * columns];
        robot.regressor(&q, &v, &a, &mut y);
        for (i, row) in y.chunks(columns).enumerate() {
            for (j, value) in row.iter().enumerate() {
                stacked[(4 * n + i, j)] = *value;
            }
        }
    }
    for mut column in stacked.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column /= length;
        }
    }
    let gram = stacked.transpose() * stacked;
    gram.symmetric_eigenvalues()
        .iter()
        .filter(|e| **e > 1e-12)
        .count()
}

#[test]
fn the_columns_are_independent_and_theta_1_needs_acceleration_of_q1() {
    let printed = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Printed12);
    assert_eq!(rank_of_random_states(&printed, true), 12);
    assert_eq!(rank_of_random_states(&printed, false), 11);
    let full = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Full22);
    assert_eq!(rank_of_random_states(&full, true), 22);
}

#[test]
fn the_robot_names_joints_units_and_parameters() {
    let robot = Robot::cft(LaboratorySetup::Dspace, ParameterStructure::Printed12);
    assert_eq!(robot.joint_names(), ["q1", "q2", "q4", "q5"]);
    let units: Vec<_> = (0..robot.joints()).map(|i| robot.joint_unit(i)).collect();
    assert_eq!(units, ["N", "Nm", "Nm", "Nm"]);
    for (i, parameter) in robot.parameters().iter().enumerate() {
        assert_eq!(parameter.name, format!("theta_{}", i + 1));
        assert_eq!(parameter.theta, Some(i as u32 + 1));
        assert!(!parameter.meaning.is_empty());
    }
    let full = Robot::cft(LaboratorySetup::Dspace, ParameterStructure::Full22);
    let extra: Vec<_> = full.parameters()[12..].iter().map(|p| &*p.name).collect();
    assert_eq!(extra, cft_ident_core::robot::cft::UNPRINTED);
    assert_eq!(
        extra,
        ["BB", "EE", "CC", "AC", "BE", "S", "OC", "OE", "OA", "OB"]
    );

    let slide = Robot::single_joint("slide", JointKind::Prismatic);
    assert_eq!((slide.joints(), slide.joint_unit(0)), (1, "N"));
    assert_eq!(
        (&*slide.parameters()[0].name, &*slide.parameters()[0].unit),
        ("inertia", "kg")
    );
    let mut y = [0.0];
    slide.regressor(&[0.1], &[0.2], &[3.5], &mut y);
    assert_eq!(y, [3.5]);
}

#[test]
fn friction_parameters_carry_their_theta_numbers() {
    let robot = Robot::cft(LaboratorySetup::default(), ParameterStructure::default());
    // theta_17 is Bf1 of q1, theta_26 is w1 of q2
    let numbers = [(0, 0), (0, 1), (1, 3), (3, 4)].map(|(j, k)| robot.friction_theta(j, k));
    assert_eq!(numbers, [13, 17, 26, 32].map(Some));
}
