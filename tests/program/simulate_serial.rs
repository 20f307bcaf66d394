//! A simulated serial robot, and what is identified from its logs.

use crate::serial_arm;

use std::fs;

use serde_json::Value;
use serial_arm::run;

/// Two links in a vertical plane, 0.4 m between the axes.
const ROBOT: &str = r#"[robot]
model = "serial"
drive_inertia = false
gravity = [0.0, -9.81, 0.0]

[[robot.link]]
joint = "shoulder"

[[robot.link]]
joint = "elbow"
a = 0.4

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true

[filter]
cutoff_hz = 10.0

[limits.shoulder]
position = [-1.5, 1.5]

[limits.elbow]
position = [-2.0, 2.0]
"#;

const TRUTH: [(&str, &str, f64); 10] = [
    ("Izz1", "", 0.9),
    ("mx1", "", 1.4),
    ("my1", "", 0.1),
    ("Izz2", "", 0.15),
    ("mx2", "", 0.35),
    ("my2", "", -0.02),
    ("viscous", "shoulder", 2.0),
    ("coulomb", "shoulder", 1.5),
    ("viscous", "elbow", 0.8),
    ("coulomb", "elbow", 0.6),
];

fn model(inertia: f64) -> String {
    let mut text = ROBOT.to_owned();
    for (name, joint, value) in TRUTH {
        let value = if name == "Izz2" { inertia } else { value };
        let joint = match joint {
            "" => String::new(),
            joint => format!("joint = \"{joint}\"\n"),
        };
        text += &format!(
            "\n[[parameter]]\nname = \"{name}\"\n{joint}value = {value}\nunit = \"1\"\nmeaning = \"of the test\"\n"
        );
    }
    text
}

#[test]
fn what_was_simulated_is_identified_and_holds_on_another_motion() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("robot.toml"), ROBOT).unwrap();
    fs::write(path.join("truth.toml"), model(0.15)).unwrap();
    let simulate = ["simulate", "-r", "robot.toml", "-m", "truth.toml"];
    let all = [&simulate[..], &["--seconds", "20", "-o", "all.csv"]].concat();
    let (status, message, document) = run(path, &all);
    assert_eq!(status, 0, "{message}");
    assert_eq!(
        document["parameters"].as_array().unwrap().len(),
        TRUTH.len()
    );
    let elbow = ["--move", "elbow", "--seconds", "15", "-o", "elbow.csv"];
    let (status, message, _) = run(path, &[&simulate[..], &elbow].concat());
    assert_eq!(status, 0, "{message}");

    let (status, message, fit) = run(
        path,
        &["lsq", "all.csv", "-r", "robot.toml", "-o", "m.toml"],
    );
    assert_eq!(status, 0, "{message}");
    let found = fit["parameters"].as_array().unwrap();
    assert_eq!(found.len(), TRUTH.len());
    // joint by joint in both, and the base parameters first
    for (p, (name, _, truth)) in found.iter().zip(TRUTH) {
        let number = |key: &str| p[key].as_f64().unwrap();
        let off = (number("value") - truth).abs();
        // the sign of the fitted law is a steep tanh in the plant, which the friction shows
        let allowed = match p["joint"].is_null() {
            true => 3.0 * number("std") + 0.005 * truth.abs(),
            false => 0.05 * truth,
        };
        assert!(off < allowed, "{name}: {p} {truth}");
    }
    let identified = |p: &&Value| p["verdict"] == "identified";
    assert!(found.iter().filter(identified).count() >= 8);
    let (_, message, errors) = run(path, &["validate", "elbow.csv", "-m", "m.toml"]);
    let error = &errors["overall"]["mean_relative_error"];
    // one joint moves and the other is held, where a law with a jump at rest is worst
    assert!(error.as_f64().unwrap() < 0.1, "{error} {message}");
}

#[test]
fn a_model_of_no_body_is_refused_with_the_pose() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("robot.toml"), ROBOT).unwrap();
    fs::write(path.join("wrong.toml"), model(-0.05)).unwrap();
    let words = [
        "simulate",
        "-r",
        "robot.toml",
        "-m",
        "wrong.toml",
        "-o",
        "a.csv",
    ];
    let (status, message, _) = run(path, &words);
    assert_eq!(status, 3, "{message}");
    assert!(message.contains("positive definite"), "{message}");
    assert!(!path.join("a.csv").exists());
    let (status, message, _) = run(path, &["simulate", "-r", "robot.toml", "-o", "a.csv"]);
    assert_eq!(status, 3);
    assert!(message.contains("give a model with -m"), "{message}");
}
