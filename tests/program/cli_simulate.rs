//! `simulate` at the boundary of the process: files, streams, statuses.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use cft_ident::config::RobotFile;
use cft_ident::log::{Block, LogSpec, Reader};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::{contains, is_empty, starts_with};
use serde_json::Value;

fn simulate(folder: &Path, line: &str) -> Command {
    let mut command = Command::cargo_bin("cft-ident").unwrap();
    command
        .current_dir(folder)
        .args(["simulate", "-r", "configs/cft.toml"])
        .args(line.split_whitespace());
    command
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn json_on_standard_output_is_one_document_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let run = simulate(
        folder.path(),
        "--seconds 1 --effect torque-offset:q5:c=0.5 -o a.csv --json -",
    )
    .assert()
    .code(0)
    .stderr(is_empty());
    let document: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    assert_eq!(document["schema"], "cft-ident/simulate/1");
    assert_eq!(document["inputs"][0]["name"], "cft.toml");
    assert_eq!(document["effects"][0]["parameters"]["c"]["value"], 0.5);
    let parameters = document["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), 32);
    let mut thetas: Vec<u64> = parameters
        .iter()
        .map(|parameter| parameter["theta"].as_u64().unwrap())
        .collect();
    thetas.sort_unstable();
    assert_eq!(thetas, (1..=32).collect::<Vec<u64>>());
    assert_eq!(names(folder.path()), ["a.csv", "a.truth.toml"]);
}

#[test]
fn the_log_and_the_truth_are_read_back_by_the_tool() {
    let folder = tempfile::tempdir().unwrap();
    simulate(folder.path(), "--move q4 --seconds 15 -o q4.csv")
        .assert()
        .code(0)
        .stdout(starts_with("q4.csv: 15000 samples"));
    let robot = RobotFile::load(Path::new("configs/cft.toml")).unwrap();
    let log = LogSpec::whole(folder.path().join("q4.csv"));
    let mut reader = Reader::open(&log, &robot.layout()).unwrap();
    let mut block = Block::default();
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    while reader.read(&mut block).unwrap() {
        for q in block.q.as_chunks::<4>().0 {
            for j in 0..4 {
                low[j] = low[j].min(q[j]);
                high[j] = high[j].max(q[j]);
            }
        }
    }
    assert_eq!(reader.samples(), 15_000);
    assert!(high[2] - low[2] > 1.5, "q4 moves");
    assert!(high[1] - low[1] < 0.01, "q2 is held");
    let truth = fs::read_to_string(folder.path().join("q4.truth.toml")).unwrap();
    let truth: toml::Table = truth.parse().unwrap();
    assert_eq!(truth["seed"].as_integer(), Some(1));
    let theta_1 = &truth["parameter"][0];
    assert_eq!(theta_1["name"].as_str(), Some("theta_1"));
    assert_eq!(theta_1["value"].as_float(), Some(121.3049));
}

/// Range of a joint over a log.
fn travel(log: &Path, robot: &str, joint: usize) -> f64 {
    let robot = RobotFile::load(Path::new(robot)).unwrap();
    let joints = robot.joint_names().len();
    let mut reader = Reader::open(&LogSpec::whole(log.to_owned()), &robot.layout()).unwrap();
    let mut block = Block::default();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    while reader.read(&mut block).unwrap() {
        for q in block.q.chunks_exact(joints) {
            low = low.min(q[joint]);
            high = high.max(q[joint]);
        }
        block.clear();
    }
    high - low
}

#[test]
fn a_joint_moves_over_the_part_of_its_range_that_is_asked_for_about_the_middle() {
    let folder = tempfile::tempdir().unwrap();
    let of = |part: &str, log: &str| {
        let words = format!("--move q4 --travel {part} --seconds 15 -o {log}");
        simulate(folder.path(), &words).assert().code(0);
        travel(&folder.path().join(log), "configs/cft.toml", 2)
    };
    let (whole, tenth) = (of("1", "whole.csv"), of("0.1", "tenth.csv"));
    assert!(whole > 1.5, "{whole}");
    assert!((tenth / whole - 0.1).abs() < 0.01, "{tenth} of {whole}");
    for words in [
        "--move q4 --travel 0 -o a.csv",
        "--move q4 --travel 1.5 -o a.csv",
        "--move q4 --travel half -o a.csv",
        "--travel 0.5 -o a.csv",
    ] {
        simulate(folder.path(), words).assert().code(2);
        assert!(!folder.path().join("a.csv").exists(), "{words}");
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_at_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    simulate(
        path,
        "--seconds 2 --effect ripple:q5:order=7 --seed 9 -o a.csv",
    )
    .assert()
    .code(0);
    simulate(
        path,
        "--seconds 2 --effect ripple:q5:order=7 --seed 9 --threads 1 -o b.csv",
    )
    .assert()
    .code(0);
    simulate(
        path,
        "--seconds 2 --effect ripple:q5:order=7 --seed 10 -o c.csv",
    )
    .assert()
    .code(0);
    let bytes = |name: &str| fs::read(path.join(name)).unwrap();
    assert!(bytes("a.csv") == bytes("b.csv"));
    assert!(bytes("a.truth.toml") == bytes("b.truth.toml"));
    assert!(bytes("a.csv") != bytes("c.csv"));
}

#[test]
fn a_log_that_ends_at_a_limit_is_a_warning_and_status_0() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    simulate(path, "--seconds 4 -o a.csv").assert().code(0);
    // The recorded volts no longer carry the arm.
    let run = simulate(
        path,
        "--volts a.csv --effect torque-offset:q1:c=20 -o b.csv --json -",
    )
    .assert()
    .code(0)
    .stderr(contains("warning: ").and(contains("the log ends there")));
    let document: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    assert_eq!(document["ending"], "stopped-at-limit");
    assert_eq!(document["warnings"].as_array().unwrap().len(), 1);
    assert_eq!(document["inputs"][1]["samples"], 4000);
}

#[test]
fn what_cannot_be_simulated_ends_with_its_status_a_hint_and_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&str, i32); 8] = [
        ("--move q9 -o a.csv", 2),
        ("--effect frob -o a.csv", 2),
        ("--effect ripple:q4:frob=1 -o a.csv", 2),
        ("-m none.toml -o a.csv", 3),
        ("--reference none.toml -o a.csv", 3),
        ("--volts none.csv -o a.csv", 3),
        ("--move q1 --seconds 1 -o a.csv", 3),
        ("-o none/a.csv", 5),
    ];
    for (arguments, status) in cases {
        simulate(folder.path(), arguments)
            .assert()
            .code(status)
            .stdout(is_empty())
            .stderr(starts_with("error: ").and(contains("\nhint: ")));
        assert!(names(folder.path()).is_empty(), "{arguments:?}");
    }
}

#[test]
fn an_output_never_overwrites_an_input() {
    let folder = tempfile::tempdir().unwrap();
    simulate(folder.path(), "--seconds 1 -o a.csv")
        .assert()
        .code(0);
    let before = fs::read(folder.path().join("a.csv")).unwrap();
    simulate(folder.path(), "--volts a.csv -o a.csv")
        .assert()
        .code(2);
    simulate(folder.path(), "--seconds 1 -o b.csv --json b.csv")
        .assert()
        .code(2);
    assert_eq!(fs::read(folder.path().join("a.csv")).unwrap(), before);
    assert_eq!(names(folder.path()), ["a.csv", "a.truth.toml"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_output_error() {
    let folder = tempfile::tempdir().unwrap();
    simulate(folder.path(), "--seconds 1 -o a.csv --json /dev/full")
        .assert()
        .code(5)
        .stderr(contains("error: /dev/full"));
}

#[cfg(target_os = "linux")]
#[test]
fn ctrl_c_ends_with_130_and_leaves_no_file() {
    use std::process::{Command, Stdio};
    use std::time::Duration;
    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(assert_cmd::cargo::cargo_bin("cft-ident"))
        .current_dir(folder.path())
        .args([
            "simulate",
            "-r",
            "configs/cft.toml",
            "--seconds",
            "120",
            "-o",
            "a.csv",
        ])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !catches_interrupts(child.id()) {
        assert_eq!(
            child.try_wait().unwrap(),
            None,
            "ended before it was interrupted"
        );
        std::thread::sleep(Duration::from_millis(2));
    }
    let sent = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(sent.success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(names(folder.path()).is_empty());
}

/// Whether a process has its handler of SIGINT (2) in place.
#[cfg(target_os = "linux")]
fn catches_interrupts(process: u32) -> bool {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    let mask = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask & 0b10 != 0)
}

#[test]
fn effects_that_cannot_be_are_usage_errors_with_the_way_out() {
    let folder = tempfile::tempdir().unwrap();
    for (effect, message, hint) in [
        (
            "stiction:q4",
            "there is no effect `stiction`",
            "torque-offset",
        ),
        (
            "payload:q4",
            "`payload` has no place at",
            "leave the joint out",
        ),
        ("backlash:q4:gap=-1", "gap is -1", "above 0"),
        ("actuator-friction:q4", "no joint `q4`", "x_r, y_r"),
    ] {
        simulate(
            folder.path(),
            &format!("--seconds 1 --effect {effect} -o a.csv"),
        )
        .assert()
        .code(2)
        .stderr(contains(message).and(contains(hint)));
    }
    assert!(names(folder.path()).is_empty());
}

#[test]
fn joints_of_effects_on_the_whole_robot_are_null_in_the_document_and_absent_in_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let run = simulate(
        folder.path(),
        "--seconds 1 --effect payload:mass=2,mx=0.5 --effect delay:q5 -o a.csv --json -",
    )
    .assert()
    .code(0);
    let document: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    let effects = document["effects"].as_array().unwrap();
    assert!(effects[0].as_object().unwrap()["joint"].is_null());
    assert_eq!(effects[0]["parameters"]["mx"]["unit"], "kg m");
    assert_eq!(effects[1]["joint"], "q5");
    let truth = fs::read_to_string(folder.path().join("a.truth.toml")).unwrap();
    assert_eq!(truth.matches("[[effect]]").count(), 2);
    assert_eq!(truth.matches("joint = \"q5\"").count(), 1 + 5);
}

#[test]
fn a_run_starts_at_the_positions_and_speeds_that_are_given() {
    let folder = tempfile::tempdir().unwrap();
    let run = |speed: &str| -> (Vec<String>, Vec<Vec<f64>>) {
        let line = format!("--seconds 0.1 --position -0.1,0.3,2.5,0.2 {speed} -o a.csv");
        simulate(folder.path(), &line).assert().code(0);
        let text = fs::read_to_string(folder.path().join("a.csv")).unwrap();
        let mut lines = text.lines().map(|line| line.split(','));
        let header = lines.next().unwrap().map(str::to_owned).collect();
        let rows = lines.map(|line| line.map(|x| x.parse().unwrap()).collect());
        (header, rows.collect())
    };
    let (header, rest) = run("");
    let (_, rows) = run("--speed 0.05,0,-0.4,0.1");
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    for (name, position, speed) in [
        ("x_c1", -0.1, 0.05),
        ("x_c2", 0.3, 0.0),
        ("x_c3", 2.5, -0.4),
        ("x_c4", 0.2, 0.1),
    ] {
        let at = column(name);
        // half a count of the coarsest encoder
        assert!((rows[0][at] - position).abs() < 8.5e-6, "{name}");
        // a millisecond's travel beyond that from rest, which the controller's pull makes
        let travelled = rows[1][at] - rest[1][at];
        assert!(
            (travelled - 1e-3 * speed).abs() < 4e-5,
            "{name}: {travelled}"
        );
    }
    simulate(folder.path(), "--seconds 1 --position 0.1,0.3 -o b.csv")
        .assert()
        .failure()
        .stderr(contains("one per motor"));
    simulate(folder.path(), "--seconds 1 --speed 0,0,0,0 -o b.csv")
        .assert()
        .code(2)
        .stderr(contains("--position"));
    assert_eq!(names(folder.path()), ["a.csv", "a.truth.toml"]);
}
