//! `drive` as people run it: the servo that comes with the program, and its files for simulators.

use crate::measured_support;

use assert_cmd::Command;
use measured_support::run;
use predicates::str::contains;

#[test]
fn the_servo_that_comes_with_the_program_is_found_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let written = run(folder.path(), &["example", "servo"]);
    let files = written["written"]["files"].as_array().unwrap();
    let logs = files
        .iter()
        .map(|file| format!("servo/{}", file.as_str().unwrap()));
    let logs: Vec<String> = logs.filter(|file| file.ends_with(".json")).collect();
    let mut arguments = vec!["drive"];
    arguments.extend(logs.iter().map(String::as_str));
    let more = [
        "--holdout-where",
        "kp=16",
        "-o",
        "servo.toml",
        "--report",
        "r.html",
        "--duty-max",
        "0.97",
    ];
    arguments.extend(more);
    let found = run(folder.path(), &arguments);
    let steps = found["steps"].as_array().unwrap();
    let written = steps.iter().filter(|step| step["written"] == true);
    let mut names: Vec<&str> = written
        .map(|step| step["effect"].as_str().unwrap())
        .collect();
    names.sort_unstable();
    assert_eq!(names, ["command-delay", "speed-limit"]);
    let error = |which: &str| found[which]["holdout"]["mae"].as_f64().unwrap();
    assert!(error("after") < 0.2 * error("before"));
    let page = std::fs::read_to_string(folder.path().join("r.html")).unwrap();
    assert!(page.contains("Positions, measured and rolled out"));
    let exported = [
        "export",
        "-m",
        "servo.toml",
        "--kp",
        "16",
        "--mjcf-actuators",
        "s.xml",
        "--isaaclab",
        "s.py",
        "--bam",
        "s.json",
    ];
    let exported = run(folder.path(), &exported);
    let left_out = exported["left_out"].to_string();
    assert!(left_out.contains("there is no key for it"), "{left_out}");
    let xml = std::fs::read_to_string(folder.path().join("s.xml")).unwrap();
    assert!(xml.contains("<dcmotor name=\"servo\""), "{xml}");
}

#[test]
fn a_held_out_gain_that_no_log_has_is_an_error_that_names_those_there_are() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &["example", "servo"]);
    Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder.path())
        .args(["drive", "servo/m0.6_l0.15_kp16_step.json", "-o", "a.toml"])
        .args(["--holdout-where", "kp=17"])
        .assert()
        .code(2)
        .stderr(contains("no log has it"))
        .stderr(contains("kp=16"));
}
