//! What `inspect` says of measured logs of other groups, where the folder with them lies beside the
//! repository.

use crate::altered_log;

use std::path::Path;

use altered_log::{assert_faults, faults, inspect};
use serde_json::Value;

fn shared(file: &str) -> Option<String> {
    let path = Path::new(cft_ident_support::ROOT)
        .join("../shared/data")
        .join(file);
    if path.exists() {
        return Some(path.to_string_lossy().into_owned());
    }
    eprintln!("SKIPPED: {} is absent", path.display());
    None
}

fn kinds(found: &Value) -> Vec<String> {
    let mut kinds: Vec<String> = faults(found).into_iter().map(|fault| fault.1).collect();
    kinds.sort();
    kinds.dedup();
    kinds
}

#[test]
fn the_benchmark_axis_has_no_fault_with_its_robot_file_and_without() {
    for file in ["emps/emps_id.csv", "emps/emps_pulses_val.csv"] {
        let Some(path) = shared(file) else { return };
        for robot in [None, Some("configs/emps.toml")] {
            let found = inspect(&path, robot);
            assert_faults(&found, &[]);
            assert!((found["rate_hz"].as_f64().unwrap() - 1000.0).abs() < 0.1);
        }
    }
}

#[test]
fn the_arm_at_5_khz_has_no_fault() {
    let Some(path) = shared("tx40/tx40_joint.csv") else {
        return;
    };
    let found = inspect(&path, None);
    assert_faults(&found, &[]);
    assert!((found["rate_hz"].as_f64().unwrap() - 5000.0).abs() < 0.5);
    let joints = found["joints"].as_array().unwrap();
    assert!(joints.len() == 6 && joints.iter().all(|joint| joint["moves"] == true));
}

#[test]
fn the_arm_with_an_irregular_clock_repeats_1255_rows_and_has_four_gaps() {
    let Some(path) = shared("panda/panda_exciting.csv") else {
        return;
    };
    let found = inspect(&path, None);
    assert_eq!(
        kinds(&found),
        ["dropout", "irregular-clock", "repeated-rows"]
    );
    assert_eq!(found["gaps"].as_array().unwrap().len(), 4);
    let all = found["faults"].as_array().unwrap();
    let repeats = all
        .iter()
        .find(|fault| fault["kind"] == "repeated-rows")
        .unwrap();
    assert_eq!(repeats["rows"], 1255);
    assert!(found["jitter"].as_f64().unwrap() > 0.2);
}

#[test]
fn the_motor_s_velocity_channel_lags_and_its_recorder_lost_and_repeated_samples() {
    let Some(path) = shared("bldc-cogging/speed_test1.txt") else {
        return;
    };
    let found = inspect(&path, Some("configs/bldc.toml"));
    assert_eq!(kinds(&found), ["dropout", "filter", "repeated-rows"]);
    let lag = faults(&found)
        .into_iter()
        .find(|fault| fault.1 == "filter")
        .unwrap();
    assert_eq!(lag.2, "Velocity");
    let units: Vec<&Value> = found["channels"]
        .as_array()
        .unwrap()
        .iter()
        .map(|c| &c["unit"])
        .collect();
    assert_eq!((units[0], units[3]), (&"rad".into(), &"A".into()));
}

#[test]
fn positions_without_noise_are_reported_as_what_may_be_a_command() {
    let Some(path) = shared("ur10/ur10_exciting.csv") else {
        return;
    };
    let found = inspect(&path, None);
    assert_faults(&found, &[]);
    let all = found["faults"].as_array().unwrap();
    let shown = all
        .iter()
        .filter(|fault| fault["kind"] == "command-as-measurement");
    assert_eq!(shown.count(), 6);
}
