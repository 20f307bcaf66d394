//! Every figure of `lsq` is that of the model that is written: on every measured set there is, `validate` gives the same
//! numbers to the last digit. Skipped aloud where ../shared/data is not there.

use crate::measured_support;

use measured_support::{run, shared};
use serde_json::Value;

/// Sets of measured logs, with their robot files.
const SETS: [(&str, &str); 7] = [
    ("configs/emps.toml", "emps/emps_id.csv"),
    ("configs/bldc.toml", "bldc-cogging/speed_test1.txt@0..7.5s"),
    ("configs/tx40.toml", "tx40/tx40_joint.csv"),
    ("configs/panda.toml", "panda/panda_exciting.csv"),
    (
        "configs/ur10.toml",
        "ur10/ur10_exciting_trajectory.mcap@0..70%",
    ),
    ("configs/kr300.toml", "kr300/A.csv"),
    ("configs/pendulum.toml", "pendulum/055032.csv"),
];

/// Prints of `lsq` beside what `validate` says of the file that it wrote.
fn compare(robot: &str, log: &str, more: &[&str]) {
    let Some(log) = shared(log) else {
        return;
    };
    let log = log.to_str().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let words = [&["lsq", log, "-r", robot, "-o", "m.toml"], more].concat();
    let fit = run(folder.path(), &words);
    let found = run(folder.path(), &["validate", log, "-m", "m.toml"]);
    let joints = |of: &Value| of["joints"].as_array().unwrap().clone();
    let (printed, validated) = (joints(&fit), joints(&found));
    assert_eq!(printed.len(), validated.len());
    for (a, b) in printed.iter().zip(&validated) {
        for key in [
            "joint",
            "rmse",
            "relative_error",
            "relative_error_moving",
            "relative_error_rest",
        ] {
            assert_eq!(a[key], b[key], "{robot} {more:?} {}: {key}", a["joint"]);
        }
    }
    let gap = &fit["feasible"]["duality_gap"];
    if let Some(gap) = gap.as_f64() {
        assert!((0.0..1e-2).contains(&gap), "{robot}: {gap}");
        assert_eq!(fit["feasible"]["status"], "converged", "{robot}");
    }
}

#[test]
fn what_lsq_prints_of_measured_sets_is_what_validate_finds_of_its_file() {
    for (robot, log) in SETS {
        compare(robot, log, &[]);
    }
}

#[test]
fn the_same_holds_for_the_plain_fit_and_other_estimators() {
    let (robot, log) = SETS[0];
    for more in [
        &["--unconstrained"][..],
        &["--estimator", "ols"],
        &["--estimator", "irls"],
    ] {
        compare(robot, log, more);
    }
}
