//! `lsq --open-loop`: a single axis fitted to the motion that its torques make, beside the plant of the simulator, and
//! on the EMPS.

use crate::measured_support;

use std::path::Path;

use measured_support::{run, shared};
use serde_json::Value;

const AXIS: &str = r#"
[robot]
model = "single-joint"
joint = "x"
kind = "prismatic"

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true
offset = true

[log]
torque_is = "joint"
torque_held = true

[sensors]
torque_noise = [1.0]

[filter]
position_cutoff_hz = 200.0
cutoff_hz = 20.0

[limits.x]
position = [0.0, 0.4]
speed = 0.3
acceleration = 2.0
"#;

/// Mass, viscous and Coulomb friction, offset.
const TRUTH: [(&str, f64); 4] = [
    ("inertia", 40.0),
    ("viscous", 150.0),
    ("coulomb", 12.0),
    ("offset", -2.0),
];
/// Viscous friction that the plant has more in the forward direction than the declared law knows.
const FORWARD: f64 = -50.0;

/// A model file of the truth.
fn truth() -> String {
    let mut file = AXIS.to_owned();
    for ((name, value), unit) in TRUTH.iter().zip(["kg", "N s/m", "N", "N"]) {
        let joint = if *name == "inertia" {
            ""
        } else {
            "joint = \"x\"\n"
        };
        file += &format!(
            "\n[[parameter]]\nname = \"{name}\"\n{joint}value = {value:?}\nstd = 0.1\nunit = \"{unit}\"\nmeaning = \"\"\nverdict = \"identified\"\n"
        );
    }
    file + "\n[provenance]\nversion = \"0.2.0\"\ncommand = \"lsq\"\ninputs = []\n"
}

/// A log of the plant, in `folder`.
fn simulated(folder: &Path, seed: u64, seconds: &str) {
    std::fs::write(folder.join("axis.toml"), AXIS).unwrap();
    std::fs::write(folder.join("truth.toml"), truth()).unwrap();
    let effect = format!("asymmetric-friction:x:coulomb=0,viscous={FORWARD}");
    let seed = seed.to_string();
    let line = [
        "simulate",
        "-r",
        "axis.toml",
        "-m",
        "truth.toml",
        "--move",
        "x",
        "--seconds",
        seconds,
        "--seed",
        &seed,
        "--effect",
        &effect,
        "-o",
        "log.csv",
    ];
    run(folder, &line);
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

/// Positions simulated from the torques of a log by a model, from begin to end: rms error \[m\].
fn open_loop(folder: &Path, log: &str, model: &str) -> f64 {
    let found = run(folder, &["validate", log, "-m", model, "--open-loop"]);
    number(&found["open_loop"]["joints"][0]["rms"])
}

/// How many deviations each number is off the truth; those of least squares lack what the plant has more forward.
fn off(fit: &Value) -> Vec<(String, f64)> {
    let parameters = fit["parameters"].as_array().unwrap();
    let mut all: Vec<(String, f64)> = TRUTH
        .iter()
        .map(|(name, truth)| {
            let of = parameters.iter().find(|p| p["key"] == *name).unwrap();
            let off = (number(&of["value"]) - truth) / number(&of["std"]);
            ((*name).to_owned(), off)
        })
        .collect();
    if let Some(forward) = fit["open_loop"]["effects"][0]["parameters"].get("viscous") {
        let off = (number(&forward["value"]) - FORWARD) / number(&forward["std"]);
        all.push(("forward".to_owned(), off));
    }
    all
}

#[test]
fn a_simulated_axis_is_found_with_the_friction_that_the_law_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    simulated(here, 5, "30");
    let plain = run(
        here,
        &["lsq", "log.csv", "-r", "axis.toml", "-o", "plain.toml"],
    );
    // least squares without the asymmetry is far from the truth: another start
    let parameters = plain["parameters"].as_array().unwrap();
    let viscous = parameters.iter().find(|p| p["key"] == TRUTH[1].0).unwrap();
    assert!(
        (number(&viscous["value"]) / TRUTH[1].1 - 1.0).abs() > 0.1,
        "{viscous}"
    );
    let line = [
        "lsq",
        "log.csv",
        "-r",
        "axis.toml",
        "--open-loop=1",
        "-o",
        "model.toml",
    ];
    let fit = run(here, &line);
    let motion = &fit["open_loop"];
    assert_eq!(motion["effects"].as_array().unwrap().len(), 1, "{motion}");
    assert_eq!(
        motion["effects"][0]["name"], "asymmetric-friction",
        "{motion}"
    );
    let off = off(&fit);
    assert_eq!(off.len(), 5);
    assert!(off.iter().all(|(_, off)| off.abs() < 3.0), "{off:?}");
    let [before, after] = ["before", "after"].map(|key| number(&motion[key]["blocks"]));
    assert!(after < 0.1 * before, "{before} {after}");
    // another log of the plant, and any model file does it as well
    simulated(here, 6, "30");
    let [plain, fitted] = ["plain.toml", "model.toml"].map(|m| open_loop(here, "log.csv", m));
    assert!(fitted < 0.1 * plain, "{plain} {fitted}");
}

#[test]
fn a_log_that_is_too_short_and_a_robot_of_two_joints_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    simulated(here, 5, "20");
    let refused = |line: &[&str], status: i32, word: &str| {
        let output = assert_cmd::Command::cargo_bin("cft-ident")
            .unwrap()
            .current_dir(here)
            .args(line)
            .output()
            .unwrap();
        let shown = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{shown}");
        assert!(shown.contains(word), "{shown}");
        assert!(!here.join("m.toml").exists());
    };
    let long = [
        "lsq",
        "log.csv",
        "-r",
        "axis.toml",
        "-o",
        "m.toml",
        "--open-loop=30",
    ];
    refused(&long, 4, "give longer logs");
    let given = [
        "lsq",
        "log.csv",
        "-r",
        "axis.toml",
        "-o",
        "m.toml",
        "--open-loop",
        "-m",
        "m.toml",
    ];
    refused(&given, 2, "cannot be used with");
}

#[test]
#[ignore = "measured logs, up to a minute; `cargo test -- --ignored`"]
fn the_emps_moves_as_its_torques_say_on_blocks_that_were_set_aside() {
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let Some(unseen) = shared("emps/emps_pulses_val.csv") else {
        return;
    };
    let (log, unseen) = (log.to_str().unwrap(), unseen.to_str().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let line = [
        "lsq",
        log,
        "-r",
        "configs/emps.toml",
        "--open-loop=1",
        "-o",
        "model.toml",
    ];
    let fit = run(here, &line);
    let motion = &fit["open_loop"];
    assert_eq!(
        motion["effects"][0]["name"], "asymmetric-friction",
        "{motion}"
    );
    let [before, after] = ["before", "after"].map(|key| number(&motion[key]["blocks"]));
    // what least squares leaves on blocks set aside is less by a third
    assert!(after < 0.7 * before, "{before} {after}");
    let whole = open_loop(here, log, "model.toml");
    assert!(whole < 0.004, "{whole}");
    // the other log had more friction in both directions, which no fit of this one knows
    let pulses = open_loop(here, unseen, "model.toml");
    assert!(pulses < 0.0125, "{pulses}");
}
