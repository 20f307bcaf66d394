//! `diagnose` through the command line: on measured logs against what others reached, and on
//! simulated logs with an effect in them that the declared model lacks.

use std::path::{Path, PathBuf};
use std::process::Command;

use rand::SeedableRng;
use rand_distr::Distribution;
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
    let file = PathBuf::from(cft_ident_support::ROOT)
        .join("../shared/data")
        .join(path);
    if file.exists() {
        return Some(file.to_string_lossy().into_owned());
    }
    println!("SKIPPED: {path} is not there (docs/results/measured/data.md says where it is from)");
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
    let robot = Path::new(cft_ident_support::ROOT).join("configs/emps-symmetric.toml");
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

/// Effects of the model that is written.
fn effects(document: &Value) -> Vec<(&str, Option<&str>)> {
    let steps = document["steps"].as_array().unwrap().iter();
    steps
        .filter(|s| s["written"] == true)
        .map(|s| (s["effect"].as_str().unwrap(), s["joint"].as_str()))
        .collect()
}

/// Value and standard deviation of a step's parameter.
fn number(step: &Value, key: &str) -> (f64, f64) {
    let p = &step["parameters"][key];
    (p["value"].as_f64().unwrap(), p["std"].as_f64().unwrap())
}

/// Each part of this log holds about one stroke, in which friction of one direction is a constant: few parts hold both,
/// and so few must agree the better.
#[test]
fn the_few_strokes_of_a_short_log_agree_on_asymmetric_friction_and_unseen_data_gain() {
    let (Some(id), Some(unseen)) = (
        measured("emps/emps_id.csv"),
        measured("emps/emps_pulses_val.csv"),
    ) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let symmetric = "configs/emps-symmetric.toml";
    run(at, &["lsq", &id, "-r", symmetric, "-o", "declared.toml"]);
    let mut arguments = vec!["diagnose", &id, "-m", "declared.toml"];
    arguments.extend(["--holdout", &unseen, "-o", "refined.toml"]);
    let found = run(at, &arguments);
    assert_eq!(found["schema"], "cft-ident/diagnose/4");
    let first = &found["steps"][0];
    assert_eq!(first["effect"], "asymmetric-friction");
    assert_eq!(
        (&first["status"], &first["written"]),
        (&"confirmed".into(), &true.into())
    );
    assert!(first["share"].as_f64().unwrap() > 0.5, "{first}");
    let written = effects(&found);
    assert!(written.contains(&("asymmetric-friction", Some("q1"))));
    let refined = std::fs::read_to_string(at.join("refined.toml")).unwrap();
    assert_eq!(refined.matches("[[effect]]").count(), written.len());
    let (before, after) = (
        mean(&found, "before", "holdout"),
        mean(&found, "after", "holdout"),
    );
    assert!(after < 0.8 * before, "{before} {after}");
    // what is left has its signals, the strongest first, each beyond chance
    let dependence = found["dependence"].as_array().unwrap();
    let share = |shown: &Value| shown["share"].as_f64().unwrap();
    assert!(!dependence.is_empty());
    assert!(dependence.windows(2).all(|w| share(&w[0]) >= share(&w[1])));
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
    assert!(effects(&found).contains(&("ripple", Some("q1"))));
    let steps = found["steps"].as_array().unwrap();
    let step = steps.iter().find(|s| s["effect"] == "ripple").unwrap();
    let size = |key: &str| number(step, key).0;
    let amplitude = size("sin").hypot(size("cos"));
    assert!(
        (amplitude / 1.5f64.hypot(0.5) - 1.0).abs() < 0.03,
        "{amplitude}"
    );
    // the order is refined from the residual's spectrum
    let (order, std) = number(step, "order");
    assert!((order - 20.0).abs() < 0.1, "{order}");
    assert!((order - 20.0).abs() < 3.0 * std, "{order} +- {std}");
    let blocks = found["blocks"]["count"].as_u64().unwrap();
    assert!((24..=26).contains(&blocks), "{blocks}");
    assert!(step["parts"].as_array().unwrap().len() >= 20);
    assert!(step["deviations"].as_f64().unwrap() > 11.0);
    assert!(step["shrinkage"].as_f64().unwrap() > 0.9);
    let (before, after) = (
        mean(&found, "before", "holdout"),
        mean(&found, "after", "holdout"),
    );
    assert!(after < 0.9 * before, "{before} {after}");
    // one joint: its error is the mean, and the interval of the change says that it falls
    let joint = &step["joints"][0];
    assert_eq!(joint["joint"], "q1");
    for (key, mean) in [("before", "holdout_before"), ("after", "holdout_after")] {
        assert_eq!(joint[key], step[mean]);
    }
    assert!(joint["interval_95"][1].as_f64().unwrap() < 0.0, "{joint}");
    assert_eq!(joint["worsened"], false);
    assert_eq!(step["holdout_worsened"], false);
    assert_eq!(step["status"], "confirmed", "{step}");
    assert_eq!(found, diagnose("1"));
}

/// A torque of position and speed.
type Torque<'a> = &'a dyn Fn(f64, f64) -> f64;

/// Writes a log anew with a torque of position and speed added, and noise of 0.5 N.
fn add_torque(from: &Path, to: &Path, torque: Torque) {
    let mut log = csv::Reader::from_path(from).unwrap();
    // time, position and torque come first
    let header: Vec<String> = log
        .headers()
        .unwrap()
        .iter()
        .take(3)
        .map(str::to_owned)
        .collect();
    let first = |row: csv::StringRecord| std::array::from_fn(|i| row[i].parse().unwrap());
    let rows: Vec<[f64; 3]> = log.records().map(|row| first(row.unwrap())).collect();
    let noise = rand_distr::Normal::new(0.0, 0.5).unwrap();
    let mut chance = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let mut out = csv::Writer::from_path(to).unwrap();
    out.write_record(&header).unwrap();
    for (i, [t, q, tau]) in rows.iter().enumerate() {
        let (a, b) = (rows[i.saturating_sub(5)], rows[(i + 5).min(rows.len() - 1)]);
        let speed = (b[1] - a[1]) / (b[0] - a[0]);
        let tau = tau + torque(*q, speed) + noise.sample(&mut chance);
        out.serialize([*t, *q, tau]).unwrap();
    }
    out.flush().unwrap();
}

#[test]
fn what_the_catalogue_does_not_have_is_unexplained_and_not_its_nearest_neighbour() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "log.csv", "25", "2", &[]);
    simulate(at, "unseen.csv", "25", "3", &[]);
    // waves whose order goes with the speed
    let wave =
        |q: f64, v: f64| 3.0 * (std::f64::consts::TAU * 20.0 * q * (1.0 + 4.0 * v.abs())).sin();
    let travelling = |q: f64, v: f64| 3.0 * (std::f64::consts::TAU * 30.0 * q + 40.0 * v).sin();
    let torques: [(&str, Torque); 2] = [("wave", &wave), ("travelling", &travelling)];
    for (name, torque) in torques {
        let (log, unseen) = (format!("{name}.csv"), format!("{name}-unseen.csv"));
        add_torque(&at.join("log.csv"), &at.join(&log), torque);
        add_torque(&at.join("unseen.csv"), &at.join(&unseen), torque);
        run(at, &["lsq", &log, "-r", ROBOT, "-o", "declared.toml"]);
        let found = run(
            at,
            &[
                "diagnose",
                &log,
                "-m",
                "declared.toml",
                "--holdout",
                &unseen,
            ],
        );
        assert_eq!(found["verdict"], "unexplained-residual", "{name}");
        let left = &found["unexplained"][0];
        assert_eq!(left["joint"], "q1");
        // 3 N of some 50 N in amplitude, squared and halved
        let share = left["share"].as_f64().unwrap();
        assert!((0.0005..0.003).contains(&share), "{name}: {share}");
        assert!(left["over_floor"].as_f64().unwrap() > 50.0, "{name}");
    }
}

/// Robot and model of a slide whose friction is smooth at rest.
const SMOOTH: &str = r#"
[robot]
model = "single-joint"
joint = "q1"
kind = "prismatic"

[friction]
law = "double-tanh"

[filter]
cutoff_hz = 20.0

[limits.q1]
position = [0.0, 0.25]

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
name = "coulomb_1"
joint = "q1"
value = 20.0
unit = "N"

[[parameter]]
name = "coulomb_2"
joint = "q1"
value = 0.0
unit = "N"

[[parameter]]
name = "slope_1"
joint = "q1"
value = 60.0
unit = "s/m"

[[parameter]]
name = "slope_2"
joint = "q1"
value = 10.0
unit = "s/m"
"#;

#[test]
fn friction_that_varies_along_the_travel_of_a_smooth_law_is_one_effect() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("smooth.toml"), SMOOTH).unwrap();
    let robot = SMOOTH.split("[[parameter]]").next().unwrap();
    std::fs::write(at.join("robot.toml"), robot).unwrap();
    for (log, seed) in [("log.csv", "2"), ("unseen.csv", "3")] {
        let simulate = "simulate -r robot.toml -m smooth.toml --seconds 25 --seed";
        let mut arguments: Vec<&str> = simulate.split(' ').collect();
        arguments.extend([seed, "-o", log]);
        run(at, &arguments);
        let wave = |q: f64| 3.0 * (std::f64::consts::TAU * 20.0 * q + 0.3).sin();
        let friction = |q: f64, v: f64| (60.0 * v).tanh() * wave(q);
        add_torque(&at.join(log), &at.join(format!("with-{log}")), &friction);
    }
    let found = run(
        at,
        &[
            "diagnose",
            "with-log.csv",
            "-m",
            "smooth.toml",
            "--holdout",
            "with-unseen.csv",
        ],
    );
    let friction = |e: &&(&str, Option<&str>)| e.0 != "delay";
    let named: Vec<_> = effects(&found)
        .into_iter()
        .filter(|e| friction(&e))
        .collect();
    assert_eq!(named, [("position-friction", Some("q1"))]);
}

/// Simulator and estimator draw the same curves, each by an algorithm of its own.
#[test]
fn a_curve_of_a_model_file_is_the_torque_that_the_simulator_adds() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "plain.csv", "12", "2", &[]);
    let error = |log: &str, model: &str| {
        let found = run(at, &["validate", log, "-m", model]);
        // friction at rest is no curve
        let error = &found["joints"][0]["relative_error_moving"];
        error.as_f64().unwrap()
    };
    let model = std::fs::read_to_string(at.join("drive.toml")).unwrap();
    // position, position by direction, speed, way since the last reversal
    for (signal, from, to) in [
        (1, 0.0, 0.25),
        (2, 0.0, 0.25),
        (3, -0.2, 0.2),
        (5, 0.0, 0.1),
    ] {
        let mut curve = "[[effect]]\nname = \"empirical\"\njoint = \"q1\"\n".to_owned();
        let knots = [6.0, -18.0, 9.0, 24.0, -12.0, 15.0].into_iter().enumerate();
        let knots = knots.map(|(i, m)| (format!("m_{}", i + 1), m));
        let shape = [("signal", f64::from(signal)), ("from", from), ("to", to)];
        let shape = shape.map(|(key, x)| (key.to_owned(), x));
        for (key, value) in shape.into_iter().chain(knots) {
            curve += &format!("[effect.parameters.{key}]\nvalue = {value:?}\n");
        }
        std::fs::write(at.join("curve.toml"), format!("{model}\n{curve}")).unwrap();
        let simulate = "simulate -r robot.toml -m curve.toml --seconds 12 --seed 2 -o curve.csv";
        run(at, &simulate.split(' ').collect::<Vec<_>>());
        let (with, without) = (
            error("curve.csv", "curve.toml"),
            error("curve.csv", "drive.toml"),
        );
        println!("{signal}: {with} {without}");
        assert!(with < 0.02 && without > 0.1, "{signal}");
    }
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
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            cells[2] = torque(cells[2].parse().unwrap()).to_string();
            out += &(cells.join(",") + "\n");
        }
        out
    };
    std::fs::write(at.join("turned.csv"), with_torque(&|tau| -tau)).unwrap();
    std::fs::write(at.join("dead.csv"), with_torque(&|_| 3.5)).unwrap();
    for log in ["turned.csv", "dead.csv"] {
        let output = Command::new(env!("CARGO_BIN_EXE_cft-ident"))
            .current_dir(at)
            .args(["diagnose", log, "-m", "model.toml", "-o", "none.toml"])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{log}: {said}");
        assert!(!at.join("none.toml").exists(), "{log}");
    }
}

/// A small case; none, said aloud, where the cases are not there.
fn small_case(name: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(cft_ident_support::ROOT).join("../shared/cases/ident");
    let folder = folder.join(name);
    if folder.exists() {
        return Some(folder);
    }
    println!("SKIPPED: {name} is not there");
    None
}

/// The effects that were written and the held-out errors before and after, for a log of one joint.
fn one_joint(case: &Path, robot: &str, fitted: &str, held_out: &str) -> (Vec<Value>, [f64; 2]) {
    let folder = tempfile::tempdir().unwrap();
    let of = |file: &str| case.join(file).to_string_lossy().into_owned();
    let (fitted, held_out) = (of(fitted), of(held_out));
    run(
        folder.path(),
        &["lsq", &fitted, "-r", &of(robot), "-o", "m.toml"],
    );
    let found = run(
        folder.path(),
        &["diagnose", &fitted, "-m", "m.toml", "--holdout", &held_out],
    );
    let steps = found["steps"].as_array().unwrap().iter();
    let written = steps.filter(|step| step["written"] == true).cloned();
    let error = |when: &str| {
        let joint = &found[when]["holdout"]["joints"][0];
        joint["relative_error"].as_f64().unwrap()
    };
    (written.collect(), [error("before"), error("after")])
}

#[test]
fn a_weight_that_no_gravity_is_declared_for_is_a_weight_and_no_spring() {
    let Some(case) = small_case("gravity-called-spring") else {
        return;
    };
    let (written, [before, after]) = one_joint(&case, "s1.toml", "gr1.csv", "gr2.csv");
    assert_eq!(written.len(), 1, "{written:?}");
    assert_eq!(written[0]["effect"], "weight");
    // 6.0 cos(q + 0.3) Nm
    let size = |key: &str| {
        let value = &written[0]["parameters"][key]["value"];
        value.as_f64().unwrap()
    };
    let moment = size("sin").hypot(size("cos"));
    assert!((moment - 6.0).abs() < 0.1, "{moment}");
    assert!(before > 0.3 && after < 0.03, "{before} {after}");
}

#[test]
fn a_drift_is_found_though_the_residual_remembers_it_for_the_whole_log() {
    let Some(case) = small_case("warmup-span-clock") else {
        return;
    };
    let (written, [before, after]) =
        one_joint(&case, "l1.toml", "dr.csv@0..70%", "dr.csv@70..100%");
    assert_eq!(written.len(), 1, "{written:?}");
    assert_eq!(written[0]["effect"], "drift");
    assert!(before > 0.3 && after < 0.02, "{before} {after}");
}
