//! `diagnose` through the command line: on measured logs against what others reached, and on
//! simulated logs with an effect in them that the declared model lacks.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// Runs the tool in a folder and returns its JSON document.
fn run(folder: &Path, arguments: &[&str]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_cft-ident"))
        .current_dir(folder)
        .args(arguments)
        .args(["--json", "-", "-q"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A measured log; none, said aloud, where the measured logs are not there.
fn measured(path: &str) -> Option<String> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/data")
        .join(path);
    if file.exists() {
        return Some(file.to_string_lossy().into_owned());
    }
    println!("SKIPPED: {path} is not there (docs/data.md says where it is from)");
    None
}

/// A drive like the EMPS as a model file, with a robot file beside it.
const DRIVE: &str = r#"
[[parameter]]
name = "inertia"
value = 95.0
unit = "kg"

[[parameter]]
name = "viscous"
joint = "q1"
value = 200.0
unit = "N s/m"

[[parameter]]
name = "coulomb"
joint = "q1"
value = 20.0
unit = "N"
"#;

/// The drive's robot file.
const ROBOT: &str = "robot.toml";

/// Writes the drive's model file and simulates a log of it.
fn simulate(folder: &Path, log: &str, seconds: &str, seed: &str, effects: &[&str]) {
    let robot = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/emps-symmetric.toml");
    let text = std::fs::read_to_string(robot).unwrap();
    let robot = text + "\n[limits.q1]\nposition = [0.0, 0.25]\n";
    std::fs::write(folder.join(ROBOT), &robot).unwrap();
    std::fs::write(folder.join("drive.toml"), format!("{robot}{DRIVE}")).unwrap();
    let mut arguments = vec!["simulate", "-r", ROBOT, "-m", "drive.toml"];
    arguments.extend(["--seconds", seconds, "--seed", seed, "-o", log]);
    for effect in effects {
        arguments.extend(["--effect", *effect]);
    }
    run(folder, &arguments);
}

fn mean(document: &Value, when: &str, rows: &str) -> f64 {
    document[when][rows]["overall"]["mean_relative_error"]
        .as_f64()
        .unwrap()
}

fn effects(document: &Value) -> Vec<(&str, Option<&str>)> {
    let steps = document["steps"].as_array().unwrap();
    steps
        .iter()
        .map(|s| (s["effect"].as_str().unwrap(), s["joint"].as_str()))
        .collect()
}

/// Value and standard deviation of a step's parameter.
fn number(step: &Value, key: &str) -> (f64, f64) {
    let p = &step["parameters"][key];
    (p["value"].as_f64().unwrap(), p["std"].as_f64().unwrap())
}

#[test]
fn emps_comes_from_seven_to_two_per_cent_and_the_refined_model_does_the_same_in_validate() {
    let (Some(id), Some(unseen)) = (
        measured("emps/emps_id.csv"),
        measured("emps/emps_pulses_val.csv"),
    ) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    run(
        at,
        &[
            "lsq",
            &id,
            "-r",
            "configs/emps-symmetric.toml",
            "-o",
            "declared.toml",
        ],
    );
    let found = run(
        at,
        &[
            "diagnose",
            &id,
            "-m",
            "declared.toml",
            "--holdout",
            &unseen,
            "-o",
            "refined.toml",
        ],
    );
    assert_eq!(found["verdict"], "effects-found");
    let named = effects(&found);
    for effect in ["asymmetric-friction", "delay", "stribeck"] {
        assert!(named.contains(&(effect, Some("q1"))), "{named:?}");
    }
    assert!((mean(&found, "before", "train") - 0.071).abs() < 0.002);
    assert!((mean(&found, "before", "holdout") - 0.082).abs() < 0.002);
    assert!(mean(&found, "after", "train") <= 0.022);
    assert!(mean(&found, "after", "holdout") <= 0.035);
    // the model file carries its effects: validate computes the same torque
    let validated = run(at, &["validate", &unseen, "-m", "refined.toml"]);
    let error = validated["overall"]["mean_relative_error"]
        .as_f64()
        .unwrap();
    assert!(
        (error / mean(&found, "after", "holdout") - 1.0).abs() < 0.01,
        "{error}"
    );
    // and what is found once is not found again
    let again = run(
        at,
        &["diagnose", &id, "-m", "refined.toml", "--holdout", &unseen],
    );
    for effect in ["asymmetric-friction", "delay", "stribeck"] {
        assert!(!effects(&again).contains(&(effect, Some("q1"))), "{effect}");
    }
}

#[test]
fn cogging_is_named_by_its_orders_where_it_is_and_nothing_where_it_is_not() {
    let Some(log) = measured("bldc-cogging/speed_test1.txt") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let span = |span: &str| format!("{log}@{span}");
    let (on, unseen) = (span("15.2..23s"), span("23..29.5s"));
    run(
        at,
        &["lsq", &on, "-r", "configs/bldc.toml", "-o", "on.toml"],
    );
    let found = run(
        at,
        &["diagnose", &on, "-m", "on.toml", "--holdout", &unseen],
    );
    let orders: Vec<f64> = found["steps"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|s| s["effect"] == "ripple")
        .map(|s| number(s, "order").0)
        .collect();
    for known in [12.0, 18.0] {
        assert!(orders.iter().any(|o| (o - known).abs() < 0.1), "{orders:?}");
    }
    assert!((mean(&found, "before", "holdout") - 0.30).abs() < 0.03);
    assert!(mean(&found, "after", "holdout") <= 0.12);

    let off = span("0.5..10s");
    run(
        at,
        &["lsq", &off, "-r", "configs/bldc.toml", "-o", "off.toml"],
    );
    let found = run(at, &["diagnose", &off, "-m", "off.toml"]);
    assert_eq!(effects(&found), []);
}

#[test]
fn a_simulated_effect_is_found_with_its_numbers_whatever_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let ripple = ["ripple:q1:order=20,sin=1.5,cos=0.5"];
    simulate(at, "log.csv", "25", "2", &ripple);
    simulate(at, "unseen.csv", "25", "3", &ripple);
    run(at, &["lsq", "log.csv", "-r", ROBOT, "-o", "declared.toml"]);
    let diagnose = |threads: &str| {
        let arguments = "diagnose log.csv -m declared.toml --holdout unseen.csv --threads";
        let mut arguments: Vec<&str> = arguments.split(' ').collect();
        arguments.push(threads);
        run(at, &arguments)
    };
    let found = diagnose("2");
    let at = effects(&found)
        .iter()
        .position(|e| *e == ("ripple", Some("q1")))
        .unwrap();
    let step = &found["steps"][at];
    for (key, truth) in [("order", 20.0), ("sin", 1.5), ("cos", 0.5)] {
        let (value, std) = number(step, key);
        let off = (value - truth).abs();
        assert!(off < 4.0 * std, "{key}: {value} +- {std}, {truth}");
    }
    let (before, after) = (
        mean(&found, "before", "holdout"),
        mean(&found, "after", "holdout"),
    );
    assert!(after < 0.9 * before, "{before} {after}");
    assert_eq!(found, diagnose("1"));
}

#[test]
fn effects_that_a_model_file_cannot_mean_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "log.csv", "12", "1", &[]);
    run(at, &["lsq", "log.csv", "-r", ROBOT, "-o", "model.toml"]);
    let model = std::fs::read_to_string(at.join("model.toml")).unwrap();
    for (effect, says) in [
        ("name = \"riple\"\njoint = \"q1\"", "riple"),
        ("name = \"ripple\"\njoint = \"q1\"", "order"),
        ("name = \"payload\"\njoint = \"q1\"", "payload"),
    ] {
        std::fs::write(
            at.join("bad.toml"),
            format!("{model}\n[[effect]]\n{effect}\n"),
        )
        .unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_cft-ident"))
            .current_dir(at)
            .args(["validate", "log.csv", "-m", "bad.toml"])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(said.contains(says) && said.contains("bad.toml"), "{said}");
    }
}

#[test]
fn a_turned_torque_and_a_dead_one_are_faults_of_the_data_and_no_physics() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "good.csv", "12", "1", &[]);
    run(at, &["lsq", "good.csv", "-r", ROBOT, "-o", "model.toml"]);
    let text = std::fs::read_to_string(at.join("good.csv")).unwrap();
    let with_torque = |torque: &dyn Fn(f64) -> f64| {
        let mut lines = text.lines();
        let mut out = lines.next().unwrap().to_owned() + "\n";
        for line in lines {
            let (rest, tau) = line.rsplit_once(',').unwrap();
            out += &format!("{rest},{}\n", torque(tau.parse().unwrap()));
        }
        out
    };
    std::fs::write(at.join("turned.csv"), with_torque(&|tau| -tau)).unwrap();
    let found = run(at, &["diagnose", "turned.csv", "-m", "model.toml"]);
    assert_eq!(found["verdict"], "data-fault");
    assert_eq!(found["faults"][0]["kind"], "wrong-sign-or-order");
    assert_eq!(found["steps"].as_array().unwrap().len(), 0);
    std::fs::write(at.join("dead.csv"), with_torque(&|_| 3.5)).unwrap();
    let found = run(at, &["diagnose", "dead.csv", "-m", "model.toml"]);
    assert_eq!(found["verdict"], "data-fault");
    assert_eq!(found["faults"][0]["kind"], "stuck-channel");
}
