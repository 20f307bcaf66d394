//! A serial arm from its one-joint logs to the payload that it carries: friction joint by joint, then the
//! inertias, an unseen motion, and what a loaded log adds.

use crate::serial_arm;

use std::path::Path;
use std::sync::LazyLock;

use serde_json::Value;
use serial_arm::{ASKEW, LAWS, done, law, simulate, write};
use tempfile::TempDir;

const SENSORS: &str = "\n[sensors]\ntorque_noise = [0.05, 0.03, 0.2]\n";

/// A motion that no log of the fits has.
const UNSEEN: &str = r#"kind = "fourier"
coordinates = "joint"
fundamental_hz = 0.13

[[coordinate]]
name = "shoulder"
offset = 0.2
a = [0.6, -0.5, 0.3]
b = [-0.3, 0.5, 0.4]

[[coordinate]]
name = "elbow"
offset = -0.3
a = [-0.8, 0.6, 0.5]
b = [0.5, 0.7, -0.6]

[[coordinate]]
name = "slide"
offset = 0.25
a = [0.05, 0.08, -0.1]
b = [0.06, -0.09, 0.08]
"#;

/// The motion of the fits: quick enough for the inertias.
const EXCITE: &str = r#"kind = "fourier"
coordinates = "joint"
fundamental_hz = 0.25

[[coordinate]]
name = "shoulder"
offset = 0.0
a = [0.9, -1.1, 0.9, 0.8]
b = [-0.6, 0.9, -0.8, 0.9]

[[coordinate]]
name = "elbow"
offset = 0.1
a = [-1.2, 1.0, 1.1, -0.9]
b = [0.9, -1.2, 0.8, 1.2]

[[coordinate]]
name = "slide"
offset = 0.25
a = [0.12, 0.15, -0.2, 0.25]
b = [-0.1, -0.2, 0.15, 0.2]
"#;

/// The arm identified without a load: the folder, and what `friction` found.
static IDENTIFIED: LazyLock<(TempDir, Value)> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    write(path, ASKEW, SENSORS);
    std::fs::write(path.join("unseen.toml"), UNSEEN).unwrap();
    let logs = LAWS.map(|(joint, _)| format!("{joint}.csv"));
    for (seed, (log, (joint, _))) in ["1", "2", "3"].iter().zip(logs.iter().zip(LAWS)) {
        simulate(
            path,
            log,
            &["--move", joint, "--seconds", "20", "--seed", seed],
        );
    }
    std::fs::write(path.join("excite.toml"), EXCITE).unwrap();
    simulate(path, "all.csv", &excited("40", "4", &[]));
    let mut words = vec!["friction", "-r", "robot.toml", "-o", "friction.toml"];
    words.extend(logs.iter().map(String::as_str));
    let found = done(path, &words);
    let fit = [
        "lsq",
        "all.csv",
        "-r",
        "robot.toml",
        "-m",
        "friction.toml",
        "-o",
        "m.toml",
    ];
    done(path, &fit);
    (folder, found)
});

/// Words of `simulate` for a log along the motion of the fits.
fn excited<'a>(seconds: &'a str, seed: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let first = [
        "--reference",
        "excite.toml",
        "--seconds",
        seconds,
        "--seed",
        seed,
    ];
    [&first[..], more].concat()
}

fn identified() -> &'static Path {
    IDENTIFIED.0.path()
}

/// A log along the unseen motion, 20 s.
fn unseen(log: &str, words: &[&str]) {
    let first = ["--reference", "unseen.toml", "--seconds", "20"];
    simulate(identified(), log, &[&first[..], words].concat());
}

/// Steps that the written model has.
fn written(found: &Value) -> Vec<&Value> {
    let steps = found["steps"].as_array().unwrap().iter();
    steps.filter(|s| s["written"] == true).collect()
}

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap_or_else(|| panic!("{key} of {v}"))
}

#[test]
fn the_filter_finds_the_friction_of_turning_and_sliding_joints_in_tilted_gravity() {
    let joints = IDENTIFIED.1["joints"].as_array().unwrap();
    assert_eq!(joints.len(), LAWS.len());
    for (j, joint) in joints.iter().enumerate() {
        assert_eq!(joint["joint"], LAWS[j].0);
        assert_eq!(joint["converged"], true);
        let (truth, curve) = (law(j), joint["curve"].as_array().unwrap());
        let (mut square, mut size) = (0.0, 0.0);
        for point in curve {
            let expected = truth.torque(number(point, "v"));
            square += (number(point, "torque") - expected).powi(2);
            size += expected * expected;
        }
        let error = (square / size).sqrt();
        eprintln!("{}: {error:.1e} of the curve", LAWS[j].0);
        assert!(error < 0.002, "{}: {error}", LAWS[j].0);
    }
}

#[test]
fn an_unseen_motion_is_predicted_to_the_noise() {
    unseen("unseen.csv", &["--seed", "5"]);
    let errors = done(identified(), &["validate", "unseen.csv", "-m", "m.toml"]);
    let error = number(&errors["overall"], "mean_relative_error");
    eprintln!("unseen: {error:.1e}");
    assert!(error < 0.002, "{error}");
}

#[test]
fn a_payload_on_a_serial_robot_is_found_with_mass_and_centre() {
    let (mass, centre) = (0.6, [0.04, -0.03, 0.12]);
    let effect = format!(
        "payload:mass={mass},mx={},my={},mz={}",
        mass * centre[0],
        mass * centre[1],
        mass * centre[2]
    );
    let path = identified();
    simulate(
        path,
        "loaded.csv",
        &excited("40", "6", &["--effect", &effect]),
    );
    unseen("loaded-unseen.csv", &["--seed", "7", "--effect", &effect]);
    let words = [
        "diagnose",
        "loaded.csv",
        "-m",
        "m.toml",
        "--keep",
        "--holdout",
        "loaded-unseen.csv",
        "-o",
        "loaded.toml",
    ];
    let found = done(path, &words);
    let steps = written(&found);
    assert_eq!(steps.len(), 1, "{steps:?}");
    assert_eq!(steps[0]["effect"], "payload");
    let shown = &steps[0]["parameters"];
    let of = |key: &str| (number(&shown[key], "value"), number(&shown[key], "std"));
    let (found_mass, std) = of("mass");
    assert!(
        (found_mass - mass).abs() < 3.0 * std && std < 0.01,
        "{found_mass} +- {std}"
    );
    for (key, centre) in ["mx", "my", "mz"].iter().zip(centre) {
        let (value, std) = of(key);
        assert!(
            (value - mass * centre).abs() < 3.0 * std && std < 0.01,
            "{key}: {value} +- {std}"
        );
    }
    let error = |when: &str| number(&found[when]["holdout"]["overall"], "mean_relative_error");
    let (before, after) = (error("before"), error("after"));
    eprintln!("loaded, unseen: {before:.3e} to {after:.3e}");
    assert!(
        after < 0.02 * before && after < 0.003,
        "{before} to {after}"
    );
    // the model that is written carries it, and can be simulated again
    let again = done(
        path,
        &["validate", "loaded-unseen.csv", "-m", "loaded.toml"],
    );
    let again = number(&again["overall"], "mean_relative_error");
    assert!((again / after - 1.0).abs() < 0.05, "{again} for {after}");
    let words = [
        "simulate",
        "-r",
        "robot.toml",
        "-m",
        "loaded.toml",
        "--seconds",
        "2",
        "-o",
        "again.csv",
    ];
    let truth = done(path, &words);
    assert_eq!(truth["effects"][0]["effect"], "payload");
}

#[test]
fn a_base_that_stands_askew_is_found_by_its_gravity() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // the first axis upright, as most arms stand
    write(path, "", SENSORS);
    let words = [
        "--seconds",
        "90",
        "--seed",
        "8",
        "--effect",
        "gravity-tilt:gx=0.3,gy=-0.2",
    ];
    simulate(path, "askew.csv", &words);
    let found = done(path, &["diagnose", "askew.csv", "-m", "truth.toml"]);
    let steps = written(&found);
    assert_eq!(steps[0]["effect"], "gravity-tilt", "{steps:?}");
    for (key, truth) in [("gx", 0.3), ("gy", -0.2)] {
        let p = &steps[0]["parameters"][key];
        let (value, std) = (number(p, "value"), number(p, "std"));
        assert!(
            (value - truth).abs() < 3.0 * std && std < 0.02,
            "{key}: {value} +- {std}"
        );
    }
}
