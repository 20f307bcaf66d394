//! The closed forms against fixtures/oracle/reference.json.

mod robot_oracle;

use cft_ident::robot::cft::{Coefficients, Setup, actuation, dynamics, pantograph, regressor};
use cft_ident::robot::friction::DoubleTanh;
use robot_oracle::{Oracle, assert_close, assert_close_rows};

const TOLERANCE: f64 = 1e-10;

#[test]
fn inertia_coriolis_and_gravity_equal_the_reference() {
    let oracle = Oracle::load();
    for state in &oracle.states {
        let (q, v) = (&state.q, &state.v);
        assert_close_rows(
            &dynamics::mass_matrix(q, &oracle.theta),
            &state.m,
            TOLERANCE,
            "M",
        );
        assert_close_rows(
            &dynamics::coriolis_matrix(q, v, &oracle.theta),
            &state.c,
            TOLERANCE,
            "C",
        );
        assert_close(
            &dynamics::gravity(q, &oracle.theta),
            &state.g,
            TOLERANCE,
            "G",
        );
    }
}

#[test]
fn the_regressor_equals_the_reference() {
    let oracle = Oracle::load();
    for state in &oracle.states {
        let mut y = [[0.0; 12]; 4];
        regressor::regressor12(&state.q, &state.v, &state.a, &mut y);
        assert_close_rows(&y, &state.y, TOLERANCE, "Y");
    }
}

#[test]
fn friction_torque_and_volts_equal_the_reference() {
    let oracle = Oracle::load();
    let laws = DoubleTanh::cft_joints(&oracle.friction);
    let k = Coefficients::from_theta12(&oracle.theta);
    for state in &oracle.states {
        let friction: [f64; 4] = std::array::from_fn(|i| laws[i].torque(state.v[i]));
        assert_close(&friction, &state.f, TOLERANCE, "F");
        let rigid = dynamics::inverse_dynamics(&state.q, &state.v, &state.a, &k);
        let tau: [f64; 4] = std::array::from_fn(|i| rigid[i] + friction[i]);
        assert_close(&tau, &state.tau, TOLERANCE, "tau");
        let volts = Setup::Tuedacs.torques_to_volts(&state.q, &tau).unwrap();
        assert_close(&volts, &state.volts, TOLERANCE, "volts");
        assert_close(
            &Setup::Tuedacs.volts_to_torques(&state.q, &volts),
            &state.tau,
            TOLERANCE,
            "tau of volts",
        );
    }
}

#[test]
fn cartesian_maps_and_motor_forces_equal_the_reference() {
    let oracle = Oracle::load();
    for pose in &oracle.kinematics {
        assert_close(
            &pantograph::joints(&pose.x).unwrap(),
            &pose.q,
            TOLERANCE,
            "q",
        );
        assert_close(&pantograph::cartesian(&pose.q), &pose.x, TOLERANCE, "x_c");
        assert_close(
            &actuation::forces_to_torques(&pose.q, &pose.force),
            &pose.torque,
            TOLERANCE,
            "tau of F",
        );
        assert_close(
            &actuation::torques_to_forces(&pose.q, &pose.torque).unwrap(),
            &pose.force,
            TOLERANCE,
            "F of tau",
        );
    }
}
