//! Parameters of `lsq` beside those that numpy, scipy and Pinocchio find in the same logs: the numbers stand in
//! `fixtures/oracle/conformance`, beside the script that made them.

use crate::measured_support;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use cft_ident_support::ROOT;
use measured_support::{run, shared};
use serde_json::Value;

/// Largest difference of a parameter, by what it does to the torque over the torque's size.
const LIMIT: f64 = 1e-6;

/// A machine's log, that of an example of the program where it is one; none, said aloud, where it is not there.
fn log_of(numbers: &Value, folder: &Path) -> Option<String> {
    let log: PathBuf = match numbers["example"].as_array() {
        Some(example) => {
            let [name, file] = [0, 1].map(|i| example[i].as_str().unwrap());
            run(folder, &["example", name]);
            folder.join(name).join(file)
        }
        None => shared(numbers["log"].as_str().unwrap())?,
    };
    let log = log.to_str().unwrap();
    Some(match numbers["span_s"].as_array() {
        Some(span) => format!("{log}@{}..{}s", span[0], span[1]),
        None => log.to_owned(),
    })
}

/// Parameters that `lsq` writes by their names, those that torques are computed with where `used`.
fn fitted(folder: &Path, line: &[&str], used: bool) -> BTreeMap<String, f64> {
    run(folder, &[&["lsq", "-o", "model.toml"], line].concat());
    let model = std::fs::read_to_string(folder.join("model.toml")).unwrap();
    let model: toml::Value = toml::from_str(&model).unwrap();
    let of = |p: &toml::Value| {
        let name = p["name"].as_str().unwrap();
        let key = match p.get("joint").and_then(toml::Value::as_str) {
            Some(joint) => format!("{name}:{joint}"),
            None => name.to_owned(),
        };
        let value = p.get("consistent").filter(|_| used).unwrap_or(&p["value"]);
        (key, value.as_float().unwrap())
    };
    model["parameter"]
        .as_array()
        .unwrap()
        .iter()
        .map(of)
        .collect()
}

/// The largest difference to the numbers of a fit, and its parameter.
#[track_caller]
fn difference(found: &BTreeMap<String, f64>, fit: &Value) -> (f64, String) {
    let torque = fit["torque"].as_f64().unwrap();
    let parameters = fit["parameters"].as_array().unwrap();
    assert_eq!(found.len(), parameters.len());
    let off = parameters.iter().map(|p| {
        let name = p["name"].as_str().unwrap();
        let number = |key: &str| p[key].as_f64().unwrap();
        let change = (found[name] - number("value")).abs();
        (change * number("column") / torque, name.to_owned())
    });
    off.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

#[track_caller]
fn assert_conforms(machine: &str) {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let beside = Path::new(ROOT).join("fixtures/oracle/conformance");
    let numbers = std::fs::read_to_string(beside.join(format!("{machine}.json"))).unwrap();
    let numbers: Value = serde_json::from_str(&numbers).unwrap();
    let Some(log) = log_of(&numbers, here) else {
        return;
    };
    let robot = beside.join(format!("{machine}.toml"));
    let line = [log.as_str(), "-r", robot.to_str().unwrap()];
    let plainly = ["--unconstrained", "--as-declared", "--estimator"];
    for (fit, estimator) in [("plain", "ols"), ("weighed", "wls")] {
        let found = fitted(here, &[&line, &plainly[..], &[estimator]].concat(), false);
        let (off, name) = difference(&found, &numbers[fit]);
        println!("{machine}, {estimator}: {off:.1e} of the torque by {name}");
        assert!(off <= LIMIT, "{machine}, {estimator}: {name} {off:.1e}");
    }
    let found = fitted(here, &line, true);
    let (off, name) = difference(&found, &numbers["plain"]);
    println!("{machine}, the default from ols: {off:.1e} of the torque by {name}");
}

#[test]
fn the_linear_drive_has_the_numbers_of_numpy() {
    assert_conforms("emps");
}

#[test]
fn the_motor_with_cogging_has_the_numbers_of_numpy() {
    assert_conforms("bldc");
}

#[test]
fn the_double_pendulum_has_the_numbers_of_numpy() {
    assert_conforms("pendulum");
}

#[test]
fn the_ur10_has_the_numbers_of_numpy() {
    assert_conforms("ur10");
}

#[test]
fn the_tx40_has_the_numbers_of_numpy() {
    assert_conforms("tx40");
}

#[test]
fn the_panda_has_the_numbers_of_numpy() {
    assert_conforms("panda");
}

#[test]
fn the_kr300_has_the_numbers_of_numpy() {
    assert_conforms("kr300");
}
