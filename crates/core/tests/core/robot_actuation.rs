//! Volts, motor forces, counts, and the dynamics in Cartesian space.

use crate::robot_oracle;

use cft_ident_core::robot::cft::cartesian::{CartesianDynamics, Space, forces_of_torques};
use cft_ident_core::robot::cft::links::{MassProperties, PseudoInertia};
use cft_ident_core::robot::cft::{Coefficients, Setup, actuation, dynamics, pantograph};
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use robot_oracle::{Draw, Oracle, assert_close, assert_close_rows};

#[test]
fn cartesian_dynamics_need_the_forces_of_the_joint_torques() {
    let oracle = Oracle::load();
    let k = Coefficients::from_theta12(&oracle.theta);
    let laws = DoubleTanh::cft_joints(&oracle.friction);
    let mut draw = Draw::new(31);
    for _ in 0..200 {
        let (q, v, a) = draw.state();
        let friction: [f64; 4] = std::array::from_fn(|i| laws[i].torque(v[i]));
        let rigid = dynamics::inverse_dynamics(&q, &v, &a, &k);
        let tau: [f64; 4] = std::array::from_fn(|i| rigid[i] + friction[i]);

        let wrist = CartesianDynamics::at(&q, &v, &k, &friction, Space::Wrist).unwrap();
        let xdd = pantograph::cartesian_accelerations(&q, &v, &a);
        let want = forces_of_torques(&q, &tau, Space::Wrist).unwrap();
        assert_close(&wrist.force(&xdd), &want, 1e-10, "wrist");

        // Motors: x_1 = -y_r, x_2 = x_r move 7 and 6 times less than the wrist.
        let motor = CartesianDynamics::at(&q, &v, &k, &friction, Space::Motor).unwrap();
        let moved = [xdd[0] / 7.0, xdd[1] / 6.0, xdd[2], xdd[3]];
        let want = actuation::torques_to_forces(&q, &tau).unwrap();
        assert_close(&motor.force(&moved), &want, 1e-10, "motor");
    }
}

#[test]
fn cartesian_inertia_keeps_the_kinetic_energy() {
    let oracle = Oracle::load();
    let k = Coefficients::from_theta12(&oracle.theta);
    let mut draw = Draw::new(32);
    for _ in 0..100 {
        let (q, v, _) = draw.state();
        let m = dynamics::inertia(&q, &k);
        let form = |m: &[[f64; 4]; 4], v: &[f64; 4]| -> f64 {
            (0..4)
                .map(|i| (0..4).map(|j| v[i] * m[i][j] * v[j]).sum::<f64>())
                .sum()
        };
        let dynamics = CartesianDynamics::at(&q, &v, &k, &[0.0; 4], Space::Wrist).unwrap();
        let xd = pantograph::cartesian_velocities(&q, &v);
        let (joint, cartesian) = (form(&m, &v), form(&dynamics.inertia, &xd));
        assert!(
            (joint - cartesian).abs() < 1e-11 * joint,
            "{joint} and {cartesian}"
        );
    }
}

#[test]
fn one_kilogram_at_the_wrist_needs_7_g_on_x_c1_and_nothing_on_x_c2_in_any_pose() {
    let mut theta = [0.0; 12];
    theta[11] = 1.0;
    let mut draw = Draw::new(33);
    for _ in 0..200 {
        let (q, _, _) = draw.state();
        let force = actuation::torques_to_forces(&q, &dynamics::gravity(&q, &theta)).unwrap();
        assert!(
            (force[0] + 7.0 * 9.81).abs() < 1e-11,
            "F_xc1 = {}",
            force[0]
        );
        assert!(force[1].abs() < 1e-11, "F_xc2 = {}", force[1]);
        assert_eq!((force[2], force[3]), (0.0, 0.0));
        // At the wrist itself it is g, downwards along x_c1.
        let k = Coefficients::from_theta12(&theta);
        let still = CartesianDynamics::at(&q, &[0.0; 4], &k, &[0.0; 4], Space::Wrist).unwrap();
        assert_close(&still.gravity, &[-9.81, 0.0, 0.0, 0.0], 1e-12, "G_x");
    }
}

#[test]
fn the_synthetic_arm_at_rest_needs_the_volts_of_the_model_page() {
    let oracle = Oracle::load();
    // Mid-workspace: the offsets of the report's trajectory.
    let q = pantograph::joints(&[-0.1343, 0.2766, 2.4, 0.0869]).unwrap();
    let g = dynamics::gravity(&q, &oracle.theta);
    assert!(
        (g[2] + 3.67).abs() < 0.01 && (g[3] + 13.71).abs() < 0.01,
        "G = {g:?}"
    );
    let force = actuation::torques_to_forces(&q, &g).unwrap();
    assert!(
        (force[0] + 284.2).abs() < 0.1 && (force[1] - 66.8).abs() < 0.1,
        "F = {force:?}"
    );
    let volts = Setup::Tuedacs.torques_to_volts(&q, &g).unwrap();
    assert!(
        (volts[0] + 0.66).abs() < 0.005 && (volts[1] - 0.16).abs() < 0.005,
        "{volts:?}"
    );
}

#[test]
fn forces_and_volts_return_over_the_workspace_of_both_setups() {
    let mut draw = Draw::new(34);
    for setup in [Setup::Tuedacs, Setup::Dspace] {
        for _ in 0..500 {
            let x = draw.position(&setup.limits());
            let q = pantograph::joints(&x).unwrap();
            let volts: [f64; 4] = draw.vector(-10.0, 10.0);
            let tau = setup.volts_to_torques(&q, &volts);
            assert_close(
                &setup.torques_to_volts(&q, &tau).unwrap(),
                &volts,
                1e-12,
                "volts",
            );
            let forces = setup.volts_to_forces(&volts);
            assert_close(&setup.forces_to_volts(&forces), &volts, 1e-14, "K_T");
            // Virtual work: F'dx = tau'dq on what the motors move.
            let v: [f64; 4] = draw.vector(-1.0, 1.0);
            let xd = pantograph::cartesian_velocities(&q, &v);
            let moved = [xd[0] / 7.0, xd[1] / 6.0, xd[2], xd[3]];
            let power: f64 = (0..4).map(|i| forces[i] * moved[i]).sum();
            let joint: f64 = (0..4).map(|i| tau[i] * v[i]).sum();
            assert!(
                (power - joint).abs() < 1e-10 * (1.0 + power.abs()),
                "{power}, {joint}"
            );
        }
    }
}

#[test]
fn gains_follow_from_amplifier_motor_and_gears_of_table_6() {
    // K_T = K_a K_t / (K_g K_c).
    for (setup, amplifier) in [(Setup::Tuedacs, 1.6), (Setup::Dspace, 0.4)] {
        let motor = amplifier * 0.107;
        let tau = std::f64::consts::TAU;
        let screw = motor / (0.5 * 0.005 / tau);
        let turn = motor / (6.16 / (182.0 * tau));
        let travel = motor / (0.06 / tau / 6.0);
        for (got, want) in setup.gains().iter().zip([screw, screw, turn, travel]) {
            assert!((got / want - 1.0).abs() < 1e-5, "{got} and not {want}");
        }
    }
}

#[test]
fn counts_round_to_half_a_count_and_return() {
    let mut draw = Draw::new(35);
    for _ in 0..500 {
        let x = draw.position(&Setup::Tuedacs.limits());
        let back = actuation::coordinates_of_counts(&actuation::counts(&x));
        for i in 0..4 {
            assert!((x[i] - back[i]).abs() <= 0.5001 * actuation::ENCODER_SCALE[i]);
        }
        assert_eq!(actuation::counts(&back), actuation::counts(&x));
    }
}

#[test]
fn limits_find_the_coordinate_that_is_outside() {
    let limits = Setup::Dspace.limits();
    assert_eq!(limits.first_outside(&limits.middles()), None);
    assert_eq!(limits.first_outside(&[-0.1, 0.2, 2.0, 0.06]), Some(3));
    assert_eq!(
        Setup::Tuedacs
            .limits()
            .first_outside(&[-0.1, 0.2, 2.0, 0.06]),
        None
    );
    assert_eq!(limits.first_outside(&[f64::NAN, 0.2, 2.0, 0.0]), Some(0));
    // The middles that the report's text gives for x_c3 and x_c4 are not the middles of Table 5.
    let middles = Setup::Tuedacs.limits().middles();
    assert_close(
        &middles,
        &[-0.1343, 0.2766, 2.7908, 0.2369],
        1e-12,
        "middles",
    );
}

/// Covariance of samples by plain averaging.
fn sample_covariance(samples: &[[f64; 4]]) -> [[f64; 4]; 4] {
    let n = samples.len() as f64;
    let mean: [f64; 4] = std::array::from_fn(|i| samples.iter().map(|s| s[i]).sum::<f64>() / n);
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            samples
                .iter()
                .map(|s| (s[i] - mean[i]) * (s[j] - mean[j]))
                .sum::<f64>()
                / n
        })
    })
}

#[test]
fn encoder_and_volt_noise_correlate_the_joints_as_the_covariances_say() {
    let mut draw = Draw::new(36);
    let x = [-0.2, 0.4, 1.0, 0.1];
    let q = pantograph::joints(&x).unwrap();
    let (mut joints, mut torques) = (Vec::new(), Vec::new());
    for _ in 0..200_000 {
        let error: [f64; 4] = draw.vector(-0.5, 0.5);
        let read = std::array::from_fn(|i| x[i] + actuation::ENCODER_SCALE[i] * error[i]);
        let moved = pantograph::joints(&read).unwrap();
        joints.push(std::array::from_fn(|i| moved[i] - q[i]));
        torques.push(actuation::forces_to_torques(&q, &error));
    }
    let check = |got: [[f64; 4]; 4], sampled: [[f64; 4]; 4]| {
        for i in 0..4 {
            for j in 0..4 {
                let scale = (sampled[i][i] * sampled[j][j]).sqrt();
                assert!(
                    (got[i][j] - sampled[i][j]).abs() < 0.01 * scale,
                    "({i}, {j})"
                );
            }
        }
        // q4 and q5 do not err independently.
        assert!(got[2][3].abs() > 0.3 * (got[2][2] * got[3][3]).sqrt());
    };
    let variance = actuation::quantisation_variance();
    check(
        actuation::joint_covariance(&q, &variance).unwrap(),
        sample_covariance(&joints),
    );
    check(
        actuation::torque_covariance(&q, &[1.0 / 12.0; 4]),
        sample_covariance(&torques),
    );
}

#[test]
fn friction_derivatives_equal_differences_of_the_law() {
    let law = DoubleTanh::from_parameters([9.0, 7.0, -2.5, 60.0, 6.0]);
    let h = 1e-6;
    for n in -40..=40 {
        let v = 0.013 * f64::from(n);
        let slope = (law.torque(v + h) - law.torque(v - h)) / (2.0 * h);
        assert!((law.slope(v) - slope).abs() < 1e-6 * (1.0 + slope.abs()));
        let gradient = law.gradient(v);
        for (i, value) in gradient.iter().enumerate() {
            let moved = |sign: f64| {
                let mut p = law.parameters();
                p[i] += sign * h;
                DoubleTanh::from_parameters(p).torque(v)
            };
            let difference = (moved(1.0) - moved(-1.0)) / (2.0 * h);
            assert!(
                (value - difference).abs() < 1e-7,
                "{}",
                DoubleTanh::NAMES[i]
            );
        }
        // The printed form of law (18).
        let printed = |b: f64, w: f64| b * (1.0 - 2.0 / (1.0 + (2.0 * w * v).exp()));
        let want = 9.0 * v + printed(7.0, 60.0) + printed(-2.5, 6.0);
        assert!((law.torque(v) - want).abs() < 1e-13);
    }
    let law = ViscousCoulomb {
        viscous: 3.0,
        coulomb: 2.0,
    };
    assert_eq!(
        [law.torque(-0.5), law.torque(0.0), law.torque(0.5)],
        [-3.5, 0.0, 3.5]
    );
    assert_eq!(
        (law.gradient(-0.5), law.gradient(0.0), law.slope(1.0)),
        ([-0.5, -1.0], [0.0, 0.0], 3.0)
    );
}

#[test]
fn a_links_pseudo_inertia_is_the_integral_over_its_points() {
    let mut draw = Draw::new(37);
    let points: Vec<([f64; 3], f64)> = (0..12)
        .map(|_| (draw.vector(-0.4, 0.4), draw.between(0.1, 2.0)))
        .collect();
    let mass: f64 = points.iter().map(|(_, m)| m).sum();
    let centre: [f64; 3] =
        std::array::from_fn(|i| points.iter().map(|(p, m)| m * p[i]).sum::<f64>() / mass);
    let about = |i: usize, j: usize| -> f64 {
        points
            .iter()
            .map(|(p, m)| m * (p[i] - centre[i]) * (p[j] - centre[j]))
            .sum()
    };
    let (xx, yy, zz) = (about(0, 0), about(1, 1), about(2, 2));
    let link = MassProperties {
        mass,
        centre,
        moments: [yy + zz, xx + zz, xx + yy],
        products: [about(0, 1), about(0, 2), about(1, 2)],
    };
    let mut want = [[0.0; 4]; 4];
    for (p, m) in &points {
        let p = [p[0], p[1], p[2], 1.0];
        for i in 0..4 {
            for j in 0..4 {
                want[i][j] += m * p[i] * p[j];
            }
        }
    }
    let got = PseudoInertia::from(&link);
    assert_close_rows(&got.0, &want, 1e-12, "J");
    assert!(got.smallest_eigenvalue() > 0.0);
    let rod = MassProperties {
        mass: 1.0,
        centre: [0.0; 3],
        moments: [3.0, 1.0, 1.0],
        products: [0.0; 3],
    };
    assert!(
        PseudoInertia::from(&rod).smallest_eigenvalue() < 0.0,
        "breaks the triangle inequality"
    );
}
