//! A tilted arm of two turning joints and a slide, its links with numbers of their own, as files in a
//! folder; what the command line makes of them.

#![allow(dead_code, reason = "each test takes what it needs")]

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use cft_ident::config::RobotFile;
use cft_ident::robot::Robot;
use cft_ident::robot::friction::DoubleTanh;
use cft_ident::robot::standard::{Body, STANDARD};
use serde_json::Value;

/// A base that stands askew, a shoulder, an elbow whose axis is tilted against it, and a slide.
pub const ROBOT: &str = r#"[robot]
model = "serial"
drive_inertia = false
GRAVITY

[[robot.link]]
joint = "shoulder"

[[robot.link]]
joint = "elbow"
a = 0.4
alpha = 0.6

[[robot.link]]
joint = "slide"
kind = "prismatic"
a = 0.2
alpha = -1.2

[limits.shoulder]
position = [-1.5, 1.5]

[limits.elbow]
position = [-2.0, 2.0]

[limits.slide]
position = [0.0, 0.5]

[noise.joint.shoulder]
position_resolution = 1e-5

[noise.joint.elbow]
position_resolution = 1e-5

[noise.joint.slide]
position_resolution = 2e-6

[log]
torque_is = "joint"
torque_held = true

[friction]
law = "double-tanh"
"#;

/// Gravity in the frame of a base that stands askew.
pub const ASKEW: &str = "gravity = [3.0, -9.0, -2.5]";

/// Names of the joints, with their friction: viscous, heights and slopes of law (18).
pub const LAWS: [(&str, [f64; 5]); 3] = [
    ("shoulder", [2.0, 1.8, -0.5, 80.0, 6.0]),
    ("elbow", [0.9, 0.9, 0.3, 60.0, 5.0]),
    ("slide", [25.0, 8.0, -2.0, 200.0, 15.0]),
];

/// Law (18) of joint `j`.
pub fn law(j: usize) -> DoubleTanh {
    let [viscous, coulomb_1, coulomb_2, slope_1, slope_2] = LAWS[j].1;
    DoubleTanh {
        viscous,
        coulomb_1,
        coulomb_2,
        slope_1,
        slope_2,
    }
}

/// Standard parameters of a body.
fn standard_of(mass: f64, centre: &[f64; 3], inertia: &[f64; 6]) -> [f64; STANDARD] {
    let (centre, inertia) = (*centre, *inertia);
    Body {
        mass,
        centre,
        inertia,
    }
    .standard()
}

/// Standard parameters of the three links.
pub fn standard() -> Vec<f64> {
    let links = [
        standard_of(
            4.0,
            &[0.18, 0.03, 0.02],
            &[0.03, 0.002, 0.0, 0.09, 0.001, 0.08],
        ),
        standard_of(
            2.5,
            &[0.09, -0.02, 0.01],
            &[0.02, 0.0, 0.001, 0.03, 0.0, 0.03],
        ),
        standard_of(
            1.5,
            &[0.02, 0.01, 0.06],
            &[0.01, 0.0, 0.0, 0.012, 0.0, 0.004],
        ),
    ];
    links.concat()
}

/// Base parameters of the arm by name.
pub fn base(robot: &Robot) -> Vec<(String, f64)> {
    assert_eq!(robot.standard_parameters(), 3 * STANDARD);
    let values = robot.base_of(&standard());
    let names = robot.parameters().iter().map(|p| p.name.to_string());
    names.zip(values).collect()
}

/// Writes `robot.toml` and `truth.toml`, the robot file with its line on gravity and `extra` sections.
pub fn write(folder: &Path, gravity: &str, extra: &str) {
    let robot = format!("{ROBOT}{extra}").replace("GRAVITY", gravity);
    let parsed = RobotFile::parse("robot.toml", &robot).unwrap().robot();
    let mut truth = robot.clone();
    let mut parameter = |name: &str, joint: &str, value: f64| {
        let joint = match joint {
            "" => String::new(),
            joint => format!("joint = \"{joint}\"\n"),
        };
        writeln!(
            truth,
            "\n[[parameter]]\nname = \"{name}\"\n{joint}value = {value:?}\nunit = \"SI\"\nmeaning = \"of the test\""
        )
        .unwrap();
    };
    for (name, value) in base(&parsed) {
        parameter(&name, "", value);
    }
    for (joint, values) in LAWS {
        for (name, value) in DoubleTanh::NAMES.iter().zip(values) {
            parameter(name, joint, value);
        }
    }
    fs::write(folder.join("robot.toml"), robot).unwrap();
    fs::write(folder.join("truth.toml"), truth).unwrap();
}

/// Runs the command; status, what it said, and its JSON document.
pub fn run(folder: &Path, words: &[&str]) -> (i32, String, Value) {
    let output = Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder)
        .args(words)
        .args(["--json", "-", "-q"])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    let document = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    (output.status.code().unwrap(), message, document)
}

/// The same where it must succeed.
pub fn done(folder: &Path, words: &[&str]) -> Value {
    let (status, message, document) = run(folder, words);
    assert_eq!(status, 0, "{words:?}: {message}");
    document
}

/// Simulates a log of the arm's truth.
pub fn simulate(folder: &Path, log: &str, words: &[&str]) {
    let first = [
        "simulate",
        "-r",
        "robot.toml",
        "-m",
        "truth.toml",
        "-o",
        log,
    ];
    done(folder, &[&first[..], words].concat());
}
