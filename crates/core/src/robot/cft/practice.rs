//! How the CFT robot is run where nothing says otherwise: numbers of a synthetic one, gains, speeds and
//! accelerations of one-joint experiments, the excitation of the report's Table 3.
//!
//! The gains put each motor coordinate's own mode at about 60 rad/s (x_c1, x_c2) and 45 rad/s (x_c3,
//! x_c4) with a damping of 0.6, for the inertia that its motor sees in the middle of the limits (229 kg
//! on y_r, 270 kg on x_r, 1.3 kg m^2 on x_c3, 129 kg on x_c4).

use super::actuation::LaboratorySetup;
use super::pantograph::{DOWNWARD_RATIO, OUTWARD_RATIO};
use crate::robot::practice::{Excitation, OperatingDefaults};

/// theta_1..theta_12: the three values of Table 4 that survive, and synthetic ones that make M
/// positive definite over the workspace.
pub const INERTIA: [f64; 12] = [
    121.3049, 0.3107, 4.1955, 0.95, -0.07, 0.0012, 0.08, 0.0128, -0.94, -0.02, 4.67, 2.83,
];

/// theta_13..theta_32, synthetic: Bv, Bf1, Bf2, w1, w2, each for q1, q2, q4, q5.
pub const FRICTION: [f64; 20] = [
    120.0, 9.0, 5.0, 4.0, 55.0, 9.0, 7.0, 5.0, -20.0, -3.0, -2.5, -1.8, 200.0, 60.0, 60.0, 60.0,
    20.0, 6.0, 6.0, 6.0,
];

/// Slowest plateaus \[m/s, rad/s\]: a third of the speed at which friction of slope 200 s/m or 60 s/rad bends.
const SLOWEST: [f64; 4] = [0.0015, 0.005, 0.005, 0.005];
/// Largest voltage of the amplifiers \[V\].
const AMPLIFIER: f64 = 10.0;
/// Least sin q5 of a designed motion: links 4 and 5 stay 12 degrees off the line. Inside Table 5 it is above 0.6.
const CLEARANCE: f64 = 0.2;
/// Top speed of every motor: 4000 revolutions per minute \[rad/s\].
const MOTOR_SPEED: f64 = 4000.0 * std::f64::consts::TAU / 60.0;

/// Motor angle to y_r, x_r, x_c3, x_c4, gear and conversion ratio of Table 6 \[m/rad, rad/rad\].
const CONVERSION: [f64; 4] = [
    0.5 * 0.005 / std::f64::consts::TAU,
    0.5 * 0.005 / std::f64::consts::TAU,
    6.16 / (182.0 * std::f64::consts::TAU),
    0.06 / (6.0 * std::f64::consts::TAU),
];

/// Table 3 of the report, of 0.4 Hz: offsets of x_c1..x_c4, then a_l and b_l for l = 1..4; inside Table 5 on TUeDACS.
const TABLE_3: ([f64; 4], [[f64; 4]; 4], [[f64; 4]; 4]) = (
    [-0.1343, 0.2766, 2.4, 0.0869],
    [
        [-0.1102, 0.1629, 1.9698, 0.0002],
        [0.0042, -0.0118, 0.0014, -0.0302],
        [-0.0014, 0.1438, -0.0267, 0.0021],
        [-0.0173, -0.0043, 0.0021, -0.0800],
    ],
    [
        [0.0037, 0.0188, 0.0011, -0.0347],
        [0.0009, -0.0257, 0.0005, 0.0273],
        [0.0005, 0.0033, -0.0060, 0.0294],
        [-0.0168, -0.0277, 0.0024, 0.0447],
    ],
);
/// Top speeds of the motor coordinates (x_c1, x_c2, x_c3, x_c4) at 4000 revolutions per minute:
/// 0.167 m/s on y_r and x_r (seven and six times that on x_c1 and x_c2), 2.26 rad/s, 0.667 m/s.
pub fn coordinate_speeds() -> [f64; 4] {
    let ratio = [DOWNWARD_RATIO, OUTWARD_RATIO, 1.0, 1.0];
    std::array::from_fn(|i| ratio[i] * CONVERSION[i] * MOTOR_SPEED)
}

pub fn of(setup: LaboratorySetup) -> OperatingDefaults {
    // Volts per newton differ by a factor of four between the set-ups.
    let scale = LaboratorySetup::Tuedacs.gains()[0] / setup.gains()[0];
    let gains = |of_tuedacs: [f64; 4]| of_tuedacs.map(|gain| scale * gain).to_vec();
    let joint = ladders(setup);
    // The motor's own share of the joint values: x_c4 is q1, x_c3 is q2.
    let part = |j: usize| joint[j].map(|x| 0.3 * x);
    OperatingDefaults {
        volts: AMPLIFIER,
        speeds: coordinate_speeds().to_vec(),
        control: [
            gains([270.0, 375.0, 80.0, 2400.0]),
            gains([5.4, 7.5, 2.1, 64.0]),
        ],
        joint_ladders: joint.to_vec(),
        coordinate_ladders: vec![part(2), part(3), joint[1], joint[0]],
        excitation: excitation(setup),
        clearance: (3, CLEARANCE),
        uniform: 3,
    }
}

/// Slowest plateau, and an acceleration that leaves the amplifiers a reserve, for q1, q2, q4, q5.
fn ladders(setup: LaboratorySetup) -> [[f64; 2]; 4] {
    let accelerations = match setup {
        LaboratorySetup::Tuedacs => [3.0, 8.0, 10.0, 10.0],
        LaboratorySetup::Dspace => [0.6, 6.0, 6.0, 6.0],
    };
    std::array::from_fn(|j| [SLOWEST[j], accelerations[j]])
}

/// Table 3 on the set-up: on dSPACE x_c4 moves about the middle of its own limits.
fn excitation(setup: LaboratorySetup) -> Excitation {
    let (mut offset, a, b) = TABLE_3;
    if setup == LaboratorySetup::Dspace {
        offset[3] = setup.limits().middles()[3];
    }
    let rows = |rows: [[f64; 4]; 4]| rows.map(|row| row.to_vec()).to_vec();
    Excitation {
        offset: offset.to_vec(),
        a: rows(a),
        b: rows(b),
        fundamental_hz: 0.4,
    }
}
