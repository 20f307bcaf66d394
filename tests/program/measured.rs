//! Measured machines through the commands, beside the numbers published with their logs. Skipped
//! aloud where ../shared/data is not there.

use crate::measured_support;

use measured_support::{run, shared};
use serde_json::Value;

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[track_caller]
fn assert_near(found: f64, expected: f64, relative: f64) {
    let off = (found / expected - 1.0).abs();
    assert!(
        off <= relative,
        "{found} is {:.3} % off {expected}",
        100.0 * off
    );
}

/// Values of `lsq` by name.
fn parameter(fit: &Value, name: &str) -> f64 {
    let parameters = fit["parameters"].as_array().unwrap();
    let found = parameters.iter().find(|p| p["name"] == name).unwrap();
    number(&found["value"])
}

fn relative_error(validation: &Value) -> f64 {
    number(&validation["joints"][0]["relative_error"])
}

/// Published with the EMPS set: M, Fv, Fc, offset.
const EMPS: [(&str, f64); 4] = [
    ("inertia", 95.1089),
    ("viscous", 203.5034),
    ("coulomb", 20.3935),
    ("offset", -3.1648),
];

#[test]
fn the_emps_fit_and_its_errors_are_the_published_ones() {
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let Some(unseen) = shared("emps/emps_pulses_val.csv") else {
        return;
    };
    let (log, unseen) = (log.to_str().unwrap(), unseen.to_str().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    for estimator in ["wls", "ols"] {
        let line = [
            "lsq",
            log,
            "-r",
            "configs/emps.toml",
            "--estimator",
            estimator,
        ];
        let fit = run(here, &[&line[..], &["-o", "emps.toml"]].concat());
        // published are plain least squares; weighed by where the axis stands, the rows give another offset
        if estimator == "ols" {
            for (name, published) in EMPS {
                assert_near(parameter(&fit, name), published, 0.02);
            }
            assert_near(number(&fit["condition"]["raw"]), 25.9883, 0.002);
        }
        assert_eq!(fit["rank"], 4);
        let identification = run(here, &["validate", log, "-m", "emps.toml"]);
        let validation = run(here, &["validate", unseen, "-m", "emps.toml"]);
        assert!(relative_error(&identification) <= 0.041);
        assert!(relative_error(&validation) <= 0.060);
        // not far below the published 4.0834 and 5.9824 % either: the same processing
        assert_near(relative_error(&identification), 0.040834, 0.02);
        assert_near(relative_error(&validation), 0.059824, 0.02);
    }
}

#[test]
fn without_an_offset_emps_has_the_error_of_the_symmetric_model() {
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let log = log.to_str().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let robot = [
        "-r",
        "configs/emps-symmetric.toml",
        "-o",
        "m.toml",
        "--estimator",
        "ols",
    ];
    run(folder.path(), &[&["lsq", log][..], &robot].concat());
    let fit = run(folder.path(), &["validate", log, "-m", "m.toml"]);
    assert_near(relative_error(&fit), 0.071, 0.02);
}

#[test]
fn the_filters_friction_curve_of_emps_is_the_published_one() {
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let line = ["friction", log.to_str().unwrap(), "-r", "configs/emps.toml"];
    let found = run(folder.path(), &[&line[..], &["-o", "f.toml"]].concat());
    let joint = &found["joints"][0];
    let published = |v: f64| EMPS[1].1 * v + EMPS[2].1 * v.signum();
    let (mut difference, mut size) = (0.0, 0.0);
    let curve = joint["curve"].as_array().unwrap();
    for point in curve {
        let v = number(&point["v"]);
        difference += (number(&point["torque"]) - published(v)).powi(2);
        size += published(v).powi(2);
    }
    let distance = f64::sqrt(difference / size);
    assert!(distance <= 0.03, "{:.2} %", 100.0 * distance);
    assert_eq!(curve.len(), 100);
    let covered = &joint["speeds_covered"];
    assert!(
        number(&covered[0]) < 0.01 && number(&covered[1]) > 0.12,
        "{covered}"
    );
    // Coulomb friction jumps at 0, so the steeper slope is bounded from below only
    let steep = &joint["parameters"]["slope_1"];
    assert_eq!(steep["verdict"], "lower-bound");
    assert!(steep["std"].is_null());
    let warnings = found["warnings"].to_string();
    assert!(
        warnings.contains("slope_1 is only known to be above"),
        "{warnings}"
    );
}

#[test]
fn the_bldc_log_is_predicted_where_its_compensation_is_off() {
    let Some(log) = shared("bldc-cogging/speed_test1.txt") else {
        return;
    };
    let log = log.to_str().unwrap();
    let span = |span: &str| format!("{log}@{span}");
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let robot = ["-r", "configs/bldc.toml", "-o", "m.toml"];
    let fit = run(here, &[&["lsq", &span("0..7.5s")][..], &robot].concat());
    assert_eq!(fit["parameters"][0]["unit"], "A s^2/rad");
    for (part, expected) in [
        ("0..7.5s", 0.0453),
        ("7.5..15s", 0.0453),
        ("15.2..23s", 0.305),
    ] {
        let validation = run(here, &["validate", &span(part), "-m", "m.toml"]);
        assert_near(relative_error(&validation), expected, 0.02);
        assert_eq!(validation["joints"][0]["unit"], "A");
        assert_eq!(validation["inputs"][0]["span"], part);
    }
    // with the compensation on, this model has no place for it
    run(here, &[&["lsq", &span("15.2..23s")][..], &robot].concat());
    let unseen = run(here, &["validate", &span("23..29.5s"), "-m", "m.toml"]);
    assert_near(relative_error(&unseen), 0.298, 0.02);
}

/// Numbers of a committed result and of a fresh run, found at the same places, must agree.
fn assert_same(place: &str, committed: &Value, fresh: &Value) {
    match (committed, fresh) {
        (Value::Object(a), Value::Object(b)) => {
            let keys = |object: &serde_json::Map<String, Value>| -> Vec<String> {
                object.keys().cloned().collect()
            };
            assert_eq!(keys(a), keys(b), "{place}");
            for (key, value) in a {
                assert_same(&format!("{place}.{key}"), value, &b[key]);
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            assert_eq!(a.len(), b.len(), "{place}");
            for (k, (a, b)) in a.iter().zip(b).enumerate() {
                assert_same(&format!("{place}[{k}]"), a, b);
            }
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            // another processor may round otherwise, and a search end a little elsewhere
            let near = (a - b).abs() <= 0.01 * a.abs().max(b.abs()) + 1e-9;
            assert!(near, "{place}: committed {a}, now {b}; run docs/generate");
        }
        (a, b) if place.ends_with("version") => assert!(a.is_string() && b.is_string()),
        (a, b) => assert_eq!(a, b, "{place}; run docs/generate"),
    }
}

#[test]
fn the_committed_results_are_those_of_this_version() {
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let Some(unseen) = shared("emps/emps_pulses_val.csv") else {
        return;
    };
    let Some(motor) = shared("bldc-cogging/speed_test1.txt") else {
        return;
    };
    let (log, unseen) = (log.to_str().unwrap(), unseen.to_str().unwrap());
    let motor = |span: &str| format!("{}@{span}", motor.display());
    let folder = tempfile::tempdir().unwrap();
    let emps = ["-r", "configs/emps.toml", "-o", "emps.toml"];
    let bldc = ["-r", "configs/bldc.toml", "-o", "bldc.toml"];
    let (early, late) = (motor("0..7.5s"), motor("7.5..15s"));
    let lines: [(&str, Vec<&str>); 6] = [
        (
            "emps_fit",
            [&["lsq", "--unconstrained", log][..], &emps].concat(),
        ),
        (
            "emps_identification",
            vec!["validate", log, "-m", "emps.toml"],
        ),
        (
            "emps_validation",
            vec!["validate", unseen, "-m", "emps.toml"],
        ),
        ("bldc_fit", [&["lsq", &early][..], &bldc].concat()),
        (
            "bldc_identification",
            vec!["validate", &early, "-m", "bldc.toml"],
        ),
        (
            "bldc_validation",
            vec!["validate", &late, "-m", "bldc.toml"],
        ),
    ];
    for (name, line) in lines {
        let file = format!("{}/docs/results/{name}.json", cft_ident_support::ROOT);
        let committed = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
        assert_same(name, &committed, &run(folder.path(), &line));
    }
}
