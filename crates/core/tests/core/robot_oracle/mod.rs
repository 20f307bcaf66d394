//! Reads fixtures/oracle/reference.json: numbers of a second derivation to test against.

#![allow(dead_code)]

use cft_ident_core::robot::cft::{ActuationLimits, LaboratorySetup, pantograph};
use rand::{RngExt, SeedableRng};
use serde_json::Value;

pub struct State {
    pub q: [f64; 4],
    pub v: [f64; 4],
    pub a: [f64; 4],
    pub m: [[f64; 4]; 4],
    pub c: [[f64; 4]; 4],
    pub g: [f64; 4],
    pub y: [[f64; 12]; 4],
    pub f: [f64; 4],
    pub tau: [f64; 4],
    pub volts: [f64; 4],
}

pub struct Pose {
    pub x: [f64; 4],
    pub q: [f64; 4],
    pub tool_tip: [f64; 3],
    pub force: [f64; 4],
    pub torque: [f64; 4],
}

pub struct GeneralRobot {
    pub links: [[[f64; 4]; 4]; 8],
    pub q: [f64; 4],
    pub v: [f64; 4],
    pub a: [f64; 4],
    pub m: [[f64; 4]; 4],
    pub cv: [f64; 4],
    pub g: [f64; 4],
}

pub struct Oracle {
    pub theta: [f64; 12],
    pub friction: [f64; 20],
    pub states: Vec<State>,
    pub kinematics: Vec<Pose>,
    pub general: Vec<GeneralRobot>,
}

fn vector<const N: usize>(value: &Value) -> [f64; N] {
    std::array::from_fn(|i| value[i].as_f64().expect("a number"))
}

fn matrix<const R: usize, const C: usize>(value: &Value) -> [[f64; C]; R] {
    std::array::from_fn(|i| vector(&value[i]))
}

impl Oracle {
    pub fn load() -> Self {
        let path =
            std::path::Path::new(cft_ident_support::ROOT).join("fixtures/oracle/reference.json");
        let text = std::fs::read_to_string(path).expect("fixtures/oracle/reference.json");
        let root: Value = serde_json::from_str(&text).expect("JSON");
        let theta: [f64; 32] = vector(&root["theta"]);
        let list = |name: &str| root[name].as_array().expect("a list").clone();
        Self {
            theta: std::array::from_fn(|i| theta[i]),
            friction: std::array::from_fn(|i| theta[12 + i]),
            states: list("states")
                .iter()
                .map(|s| State {
                    q: vector(&s["q"]),
                    v: vector(&s["v"]),
                    a: vector(&s["a"]),
                    m: matrix(&s["M"]),
                    c: matrix(&s["C"]),
                    g: vector(&s["G"]),
                    y: matrix(&s["Y"]),
                    f: vector(&s["F"]),
                    tau: vector(&s["tau"]),
                    volts: vector(&s["volts_tuedacs"]),
                })
                .collect(),
            kinematics: list("kinematics")
                .iter()
                .map(|s| Pose {
                    x: vector(&s["x_c"]),
                    q: vector(&s["q"]),
                    tool_tip: vector(&s["tool_tip"]),
                    force: vector(&s["motor_force"]),
                    torque: vector(&s["joint_torque"]),
                })
                .collect(),
            general: list("general_links")
                .iter()
                .map(|s| GeneralRobot {
                    links: std::array::from_fn(|i| {
                        matrix(&s["pseudo_inertia"][(i + 1).to_string()])
                    }),
                    q: vector(&s["q"]),
                    v: vector(&s["v"]),
                    a: vector(&s["a"]),
                    m: matrix(&s["M"]),
                    cv: vector(&s["Cv"]),
                    g: vector(&s["G"]),
                })
                .collect(),
        }
    }
}

/// Every entry within `tolerance` of its own size, but for rounding at the size of the largest.
pub fn assert_close<const N: usize>(got: &[f64; N], want: &[f64; N], tolerance: f64, what: &str) {
    let rounding = 1e-14 * want.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    for i in 0..N {
        assert!(
            (got[i] - want[i]).abs() <= tolerance * want[i].abs() + rounding,
            "{what}[{i}]: {} and not {}",
            got[i],
            want[i]
        );
    }
}

pub fn assert_close_rows<const R: usize, const C: usize>(
    got: &[[f64; C]; R],
    want: &[[f64; C]; R],
    tolerance: f64,
    what: &str,
) {
    for i in 0..R {
        assert_close(&got[i], &want[i], tolerance, &format!("{what} row {i}"));
    }
}

/// Repeatable random numbers for the tests of the robot room.
pub struct Draw(rand_chacha::ChaCha8Rng);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Self(rand_chacha::ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    pub fn vector<const N: usize>(&mut self, low: f64, high: f64) -> [f64; N] {
        std::array::from_fn(|_| self.between(low, high))
    }

    /// A Cartesian position inside the limits of a set-up.
    pub fn position(&mut self, limits: &ActuationLimits) -> [f64; 4] {
        std::array::from_fn(|i| self.between(limits.lower[i], limits.upper[i]))
    }

    /// A state (q, v, a) inside Table 5.
    pub fn state(&mut self) -> ([f64; 4], [f64; 4], [f64; 4]) {
        let x = self.position(&LaboratorySetup::Tuedacs.limits());
        let q = pantograph::joints(&x).expect("inside Table 5");
        (q, self.vector(-2.0, 2.0), self.vector(-8.0, 8.0))
    }
}

pub fn apply<const R: usize, const C: usize>(matrix: &[[f64; C]; R], x: &[f64; C]) -> [f64; R] {
    std::array::from_fn(|i| (0..C).map(|j| matrix[i][j] * x[j]).sum())
}
