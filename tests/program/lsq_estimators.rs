//! The estimators of `lsq` and `--feasible`, from the command line to the files.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

/// Two joints in a vertical plane; friction of law (18) in the log, viscous-coulomb where asked.
const ARM: &str = r#"
[robot]
model = "serial"
gravity = [0.0, -9.81, 0.0]
drive_inertia = false

[[robot.link]]
joint = "q1"

[[robot.link]]
joint = "q2"
xyz = [0.4, 0.0, 0.0]

[friction]
law = "LAW"
fitted_with_inertias = true

[log]
torque_is = "joint"
torque_held = false

[log.joint.q1]
reference = "ref_q1"

[log.joint.q2]
reference = "ref_q2"

[filter]
cutoff_hz = 20.0
"#;

/// Base parameters Izz1 + 0.16 m2, mx1 + 0.4 m2, my1, Izz2, mx2, my2.
const TRUTH: [f64; 6] = [0.512, 1.28, 0.02, 0.13, 0.39, -0.01];

/// Twenty seconds of both joints at 500 Hz.
fn log() -> String {
    let mut text = String::from("t,q_q1,q_q2,ref_q1,ref_q2,tau_q1,tau_q2\n");
    let mut noise = 1u64;
    let mut draw = || {
        noise = noise
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (noise >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let waves = [
        [(0.9, 1.3, 0.0), (0.4, 3.1, 0.5), (0.1, 7.9, 1.0)],
        [(0.8, 1.7, 0.3), (0.5, 2.9, 1.5), (0.1, 9.1, 0.2)],
    ];
    let [izz1, mx1, my1, izz2, mx2, my2] = TRUTH;
    for k in 0..10_000 {
        let t = f64::from(k) * 0.002;
        let at = |j: usize, f: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
            waves[j].iter().map(|(a, w, p)| f(*a, *w, w * t + p)).sum()
        };
        let q: [f64; 2] = std::array::from_fn(|j| at(j, &|a, _, x| a * x.sin()));
        let v: [f64; 2] = std::array::from_fn(|j| at(j, &|a, w, x| a * w * x.cos()));
        let a: [f64; 2] = std::array::from_fn(|j| at(j, &|a, w, x| -a * w * w * x.sin()));
        let (s, c) = q[1].sin_cos();
        let (l, g) = (0.4, 9.81);
        let both = q[0] + q[1];
        // double pendulum whose second centre of gravity is at (mx2, my2)/m2
        let x = mx2 * c - my2 * s;
        let y = mx2 * s + my2 * c;
        let lower = g * (mx2 * both.cos() - my2 * both.sin());
        let mut tau = [
            izz1 * a[0] + izz2 * (a[0] + a[1]) + l * x * (2.0 * a[0] + a[1])
                - l * y * (2.0 * v[0] * v[1] + v[1] * v[1])
                + g * (mx1 * q[0].cos() - my1 * q[0].sin())
                + lower,
            izz2 * (a[0] + a[1]) + l * x * a[0] + l * y * v[0] * v[0] + lower,
        ];
        for (tau, v) in tau.iter_mut().zip(v) {
            *tau += 0.8 * v + 1.5 * (30.0 * v).tanh() - 0.5 * (4.0 * v).tanh() + 0.05 * draw();
        }
        let _ = writeln!(
            text,
            "{t:.3},{:.9},{:.9},{:.9},{:.9},{:.6},{:.6}",
            q[0] + 2e-6 * draw(),
            q[1] + 2e-6 * draw(),
            q[0],
            q[1],
            tau[0],
            tau[1]
        );
    }
    text
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("log.csv", &log());
    write("tanh.toml", &ARM.replace("LAW", "double-tanh"));
    write("sign.toml", &ARM.replace("LAW", "viscous-coulomb"));
    folder
}

fn lsq(folder: &Path, robot: &str, words: &[&str]) -> (Value, String) {
    let output = Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder)
        .args(["lsq", "log.csv", "-r", robot, "-o", "model.toml"])
        .args(words)
        .args(["--json", "fit.json", "--verbose"])
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words:?}: {errors}");
    let json = fs::read_to_string(folder.join("fit.json")).unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    (serde_json::from_str(&json).unwrap(), text)
}

fn parameter<'a>(json: &'a Value, key: &str) -> &'a Value {
    let all = json["parameters"].as_array().unwrap();
    all.iter().find(|p| p["key"] == key).unwrap()
}

fn check_inertias(json: &Value, sigmas: f64) {
    for (key, truth) in ["Izz1", "mx1", "my1", "Izz2", "mx2", "my2"]
        .iter()
        .zip(TRUTH)
    {
        let p = parameter(json, key);
        let (value, std) = (
            p["value"].as_f64().unwrap_or(0.0),
            p["std"].as_f64().unwrap_or(1.0),
        );
        assert!(
            (value - truth).abs() < sigmas * std + 0.004,
            "{key}: {value} {std} {truth}"
        );
    }
}

#[test]
fn a_saturating_law_is_found_with_the_inertias_of_a_serial_robot() {
    let folder = folder();
    let (json, _) = lsq(folder.path(), "tanh.toml", &[]);
    assert_eq!(json["estimator"]["law_refined"], true);
    assert_eq!(json["estimator"]["status"], "converged");
    check_inertias(&json, 4.0);
    for joint in ["q1", "q2"] {
        for (key, truth) in [
            ("viscous", 0.8),
            ("coulomb_1", 1.5),
            ("coulomb_2", -0.5),
            ("slope_1", 30.0),
        ] {
            let all = json["parameters"].as_array().unwrap();
            let p = all
                .iter()
                .find(|p| p["key"] == key && p["joint"] == joint)
                .unwrap();
            let off = p["value"].as_f64().unwrap() / truth - 1.0;
            assert!(off.abs() < 0.15, "{key} of {joint}: {p}");
        }
    }
    let warnings = json["warnings"].to_string();
    assert!(
        warnings.contains("then the law of (18) by refinement"),
        "{warnings}"
    );
    // the model is one that other commands can use
    let mut validate = Command::cargo_bin("cft-ident").unwrap();
    let words = [
        "validate",
        "log.csv",
        "-m",
        "model.toml",
        "--max-relative-error",
        "0.02",
        "-q",
    ];
    validate
        .current_dir(folder.path())
        .args(words)
        .assert()
        .success();
}

#[test]
fn a_linear_estimator_says_that_it_cannot_fit_the_law() {
    let folder = folder();
    let mut command = Command::cargo_bin("cft-ident").unwrap();
    let words = [
        "lsq",
        "log.csv",
        "-r",
        "tanh.toml",
        "-o",
        "m.toml",
        "--estimator",
        "irls",
        "-q",
    ];
    let output = command
        .current_dir(folder.path())
        .args(words)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(errors.contains("--estimator oe"), "{errors}");
}

#[test]
fn every_estimator_says_how_it_ended_and_names_parameters_by_grouping_and_key() {
    let folder = folder();
    for estimator in ["wls", "ols", "irls", "iv", "oe"] {
        let (json, text) = lsq(folder.path(), "sign.toml", &["--estimator", estimator]);
        assert_eq!(json["estimator"]["name"], estimator);
        assert_eq!(json["estimator"]["status"], "converged", "{estimator}");
        let first = parameter(&json, "Izz1");
        assert_eq!(first["name"], "Izz1 + 0.16 m2");
        assert!(first["essential"].is_boolean());
        assert!(text.contains("Izz1 + 0.16 m2") && text.contains("are significant"));
        let groupings = text.split("stand for combinations\n").nth(1).unwrap();
        let groupings = groupings.lines().take_while(|line| !line.is_empty());
        assert!(groupings.into_iter().all(|line| line.chars().count() <= 80));
        match estimator {
            "irls" => assert!(json["estimator"]["joints"][0]["down_weighted"].is_number()),
            "iv" => {
                assert_eq!(json["estimator"]["reference"], "logged");
                assert!(
                    json["estimator"]["joints"][1]["proportional"]
                        .as_f64()
                        .unwrap()
                        > 0.0
                );
            }
            _ => {}
        }
    }
}

#[test]
fn feasible_links_stand_in_the_document_and_in_the_model_file() {
    let folder = folder();
    let (json, text) = lsq(folder.path(), "tanh.toml", &[]);
    let links = json["feasible"]["links"].as_array().unwrap();
    assert_eq!(links.len(), 2);
    assert!(
        links
            .iter()
            .all(|l| l["smallest_eigenvalue"].as_f64().unwrap() > 0.0)
    );
    // both of the rows in which the joint moves
    let written = json["joints"][0]["relative_error_moving"].as_f64().unwrap();
    let plain = json["unconstrained_residual"][0]["relative_error"]
        .as_f64()
        .unwrap();
    assert!(written < 1.05 * plain + 1e-4, "{written} {plain}");
    assert_eq!(json["feasible"]["status"], "converged");
    assert!(text.contains("duality gap"));
    check_inertias(&json, 5.0);
    let model: toml::Table = fs::read_to_string(folder.path().join("model.toml"))
        .unwrap()
        .parse()
        .unwrap();
    let links = model["link"].as_array().unwrap();
    let number = |i: usize, key: &str| links[i][key].as_float().unwrap();
    let centre = |i: usize| {
        links[i]["centre"].as_array().unwrap()[0]
            .as_float()
            .unwrap()
    };
    let inertia = links[1]["inertia"].as_array().unwrap()[5]
        .as_float()
        .unwrap();
    // the links give the model's own base parameters
    let m2 = number(1, "mass");
    let base: Vec<f64> = model["parameter"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["consistent"].as_float().unwrap())
        .collect();
    assert!((m2 * centre(1) - base[4]).abs() < 1e-9);
    assert!((number(0, "mass") * centre(0) + 0.4 * m2 - base[1]).abs() < 1e-9);
    let y = links[1]["centre"].as_array().unwrap()[1]
        .as_float()
        .unwrap();
    assert!((inertia + m2 * (centre(1).powi(2) + y * y) - base[3]).abs() < 1e-9);
}
