//! Volts, motor forces, and what noise of motors and encoders is at the joints.

use crate::robot_oracle;

use cft_ident_core::robot::cft::{
    LaboratorySetup, ReportCoefficients, actuation, dynamics, pantograph,
};
use cft_ident_core::robot::friction::{DoubleTanh, ViscousCoulomb};
use cft_ident_core::robot::standard::{Body, pseudo_inertia};
use robot_oracle::{Draw, Oracle, assert_close, assert_close_rows};

#[test]
fn one_kilogram_at_the_wrist_needs_7_g_on_x_c1_and_nothing_on_x_c2_in_any_pose() {
    let mut theta = [0.0; 12];
    theta[11] = 1.0;
    let k = ReportCoefficients::from_theta12(&theta);
    let mut draw = Draw::new(33);
    for _ in 0..200 {
        let (q, _, _) = draw.state();
        let force = actuation::torques_to_forces(&q, &dynamics::gravity_torque(&q, &k)).unwrap();
        assert!(
            (force[0] + 7.0 * 9.81).abs() < 1e-11,
            "F_xc1 = {}",
            force[0]
        );
        assert!(force[1].abs() < 1e-11, "F_xc2 = {}", force[1]);
        assert_eq!((force[2], force[3]), (0.0, 0.0));
    }
}

#[test]
fn the_synthetic_arm_at_rest_needs_the_volts_of_the_model_page() {
    let oracle = Oracle::load();
    // Mid-workspace: the offsets of the report's trajectory.
    let q = pantograph::joints(&[-0.1343, 0.2766, 2.4, 0.0869]).unwrap();
    let g = dynamics::gravity_torque(&q, &ReportCoefficients::from_theta12(&oracle.theta));
    assert!(
        (g[2] + 3.67).abs() < 0.01 && (g[3] + 13.71).abs() < 0.01,
        "G = {g:?}"
    );
    let force = actuation::torques_to_forces(&q, &g).unwrap();
    assert!(
        (force[0] + 284.2).abs() < 0.1 && (force[1] - 66.8).abs() < 0.1,
        "F = {force:?}"
    );
    let volts = LaboratorySetup::Tuedacs.torques_to_volts(&q, &g).unwrap();
    assert!(
        (volts[0] + 0.66).abs() < 0.005 && (volts[1] - 0.16).abs() < 0.005,
        "{volts:?}"
    );
}

#[test]
fn forces_and_volts_return_over_the_workspace_of_both_setups() {
    let mut draw = Draw::new(34);
    for setup in [LaboratorySetup::Tuedacs, LaboratorySetup::Dspace] {
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
    for (setup, amplifier) in [
        (LaboratorySetup::Tuedacs, 1.6),
        (LaboratorySetup::Dspace, 0.4),
    ] {
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
fn limits_find_the_coordinate_that_is_outside() {
    let limits = LaboratorySetup::Dspace.limits();
    assert_eq!(limits.first_outside(&limits.middles()), None);
    assert_eq!(limits.first_outside(&[-0.1, 0.2, 2.0, 0.06]), Some(3));
    assert_eq!(
        LaboratorySetup::Tuedacs
            .limits()
            .first_outside(&[-0.1, 0.2, 2.0, 0.06]),
        None
    );
    assert_eq!(limits.first_outside(&[f64::NAN, 0.2, 2.0, 0.0]), Some(0));
    // The middles that the report's text gives for x_c3 and x_c4 are not the middles of Table 5.
    let middles = LaboratorySetup::Tuedacs.limits().middles();
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
fn encoder_noise_correlates_the_joints_as_the_covariance_says() {
    let mut draw = Draw::new(36);
    let x = [-0.2, 0.4, 1.0, 0.1];
    let q = pantograph::joints(&x).unwrap();
    let mut joints = Vec::new();
    for _ in 0..200_000 {
        let error: [f64; 4] = draw.vector(-0.5, 0.5);
        let read = std::array::from_fn(|i| x[i] + actuation::ENCODER_SCALE[i] * error[i]);
        let moved = pantograph::joints(&read).unwrap();
        joints.push(std::array::from_fn(|i| moved[i] - q[i]));
    }
    let variance = actuation::quantisation_variance();
    let got = actuation::joint_covariance(&q, &variance).unwrap();
    let sampled = sample_covariance(&joints);
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
    let link = Body {
        mass,
        centre,
        inertia: [
            yy + zz,
            -about(0, 1),
            -about(0, 2),
            xx + zz,
            -about(1, 2),
            xx + yy,
        ],
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
    let got = pseudo_inertia(&link.standard());
    assert_close_rows(&got.into(), &want, 1e-12, "J");
    assert!(got.symmetric_eigenvalues().min() > 0.0);
    let rod = Body {
        mass: 1.0,
        centre: [0.0; 3],
        inertia: [3.0, 0.0, 0.0, 1.0, 0.0, 1.0],
    };
    let rod = pseudo_inertia(&rod.standard());
    assert!(
        rod.symmetric_eigenvalues().min() < 0.0,
        "breaks the triangle inequality"
    );
}
