//! `excite` at the boundary of the process: files, streams, statuses.

use crate::excite_support;

use std::fs;

use assert_cmd::Command;
use cft_ident::config::Trajectory;
use predicates::str::{contains, is_empty};
use serde_json::Value;

use excite_support::excite;

/// Options of a search that takes a moment.
const QUICK: &str = "--starts 2 --evaluations 60";

#[test]
fn table_3_keeps_the_limits_of_tuedacs_and_breaks_those_of_dspace() {
    let folder = tempfile::tempdir().unwrap();
    let run = excite(folder.path(), "--check configs/table3.toml --json -")
        .assert()
        .code(0)
        .stderr(is_empty());
    let document: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    assert_eq!(document["schema"], "cft-ident/excite/1");
    let condition = |kind: &str| document["condition"][kind].as_f64().unwrap();
    assert!((condition("raw") - 159.07).abs() < 0.005);
    assert!((condition("normalised") - 91.73).abs() < 0.005);
    let used = document["limits_used"].as_array().unwrap();
    assert_eq!(used.len(), 4);
    assert_eq!(used[3]["coordinate"], "x_c4");
    // 1.742 V of 10 V
    assert!((used[3]["volts"].as_f64().unwrap() - 0.1742).abs() < 1e-4);
    assert_eq!(document["weakest_direction"].as_array().unwrap().len(), 12);
    assert!(document["log_det"].is_f64() && document["evaluations"].is_null());

    let dspace = "--check configs/table3.toml -r configs/cft-dspace.toml";
    excite(folder.path(), dspace)
        .assert()
        .code(1)
        .stderr(contains("position of x_c4"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_design_is_written_with_its_samples_and_its_picture_and_passes_its_own_check() {
    let folder = tempfile::tempdir().unwrap();
    let line = format!(
        "{QUICK} --periods 3 -o d.toml --samples d.csv --rate 100 --plot d.svg --json d.json"
    );
    excite(folder.path(), &line)
        .assert()
        .code(0)
        .stdout(contains("weakest direction"))
        .stdout(contains("written: d.toml"));
    let path = |name: &str| folder.path().join(name);
    let text = fs::read_to_string(path("d.toml")).unwrap();
    let Trajectory::Fourier(file) = Trajectory::parse("d.toml", &text).unwrap() else {
        panic!("a Fourier series");
    };
    assert_eq!((file.periods, file.series.len()), (Some(3), 4));
    let blend = file.blend_s.unwrap();
    let samples = fs::read_to_string(path("d.csv")).unwrap();
    let rows = ((2.0 * blend + 7.5) * 100.0 + 1e-6).floor() as usize + 1;
    assert_eq!(samples.lines().count(), 1 + rows);
    assert!(samples.starts_with("t,q_q1,q_q2,q_q4,q_q5,dq_q1,"));
    assert!(
        fs::read_to_string(path("d.svg"))
            .unwrap()
            .contains("<title>d.toml</title>")
    );
    let document: Value = serde_json::from_slice(&fs::read(path("d.json")).unwrap()).unwrap();
    assert!(document["evaluations"].as_u64().unwrap() <= 240);
    excite(folder.path(), "--check d.toml").assert().code(0);
}

#[test]
fn a_motion_is_written_as_controllers_take_it_and_says_first_what_nobody_checked() {
    let folder = tempfile::tempdir().unwrap();
    let line = "--check configs/table3.toml --rate 50 --samples m.csv --trajectory-message m.yaml";
    excite(folder.path(), line)
        .assert()
        .code(0)
        .stdout(contains("written: m.yaml"));
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let yaml = read("m.yaml");
    assert!(yaml.starts_with("# NOT CHECKED: collisions"), "{yaml}");
    assert!(yaml.contains("# Checked: the limits of cft.toml along the whole motion."));
    assert!(yaml.contains("joint_names:\n  - \"q1\"\n  - \"q2\"\n"));
    // the points are those of the samples
    let samples = read("m.csv");
    let rows: Vec<&str> = samples.lines().skip(1).collect();
    assert_eq!(yaml.matches("  - positions: [").count(), rows.len());
    let last: Vec<&str> = rows[rows.len() - 1].split(',').collect();
    let numbers = last[1..5]
        .iter()
        .map(|x| format!("{:?}", x.parse::<f64>().unwrap()));
    let numbers: Vec<String> = numbers.collect();
    assert!(yaml.contains(&format!("  - positions: [{}]", numbers.join(", "))));

    // a program needs six joints that turn
    excite(
        folder.path(),
        "--check configs/table3.toml --urscript m.script",
    )
    .assert()
    .code(2)
    .stderr(contains("the joints q1, q2, q4, q5"));
    // and what breaks limits says so
    let line = "--check configs/table3.toml -r configs/cft-dspace.toml --rate 50 --trajectory-message b.mcap";
    excite(folder.path(), line).assert().code(1);
    let bytes = fs::read(folder.path().join("b.mcap")).unwrap();
    assert!(String::from_utf8_lossy(&bytes).contains("BREAKS LIMITS: position of x_c4"));
    assert!(!folder.path().join("m.script").exists());
}

#[test]
fn outputs_are_the_same_bytes_at_any_number_of_threads() {
    let outputs = ["1", "3"].map(|threads| {
        let folder = tempfile::tempdir().unwrap();
        let line = format!(
            "{QUICK} --seed 7 --trajectories 2 -o d.toml --plot d.svg --json d.json --threads {threads}"
        );
        excite(folder.path(), &line).assert().code(0);
        ["d-1.toml", "d-2.toml", "d-1.svg", "d.json"]
            .map(|name| fs::read_to_string(folder.path().join(name)).unwrap())
    });
    assert_eq!(outputs[0], outputs[1]);
    assert_ne!(outputs[0][0], outputs[0][1]);
    assert!(!outputs[0].iter().any(|text| text.contains("/tmp")));
}

#[test]
fn logs_and_trajectories_that_exist_count_as_information() {
    let folder = tempfile::tempdir().unwrap();
    let mut simulate = Command::cargo_bin("cft-ident").unwrap();
    simulate
        .current_dir(folder.path())
        .args("simulate -r configs/cft.toml --seconds 8 -o a.csv".split_whitespace())
        .assert()
        .code(0);
    let line = format!(
        "{QUICK} --criterion a-optimal --parameter theta_6 --with a.csv --with configs/table3.toml -o d.toml --json -"
    );
    let run = excite(folder.path(), &line).assert().code(0);
    let document: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    assert_eq!(document["inputs"].as_array().unwrap().len(), 3);
    let std = |part: &Value, k: usize| part["parameters"][k]["relative_std"].as_f64().unwrap();
    for k in 0..12 {
        assert!(std(&document["together"], k) < std(&document, k));
    }
}

#[test]
fn one_joint_experiments_are_designed_for_the_friction_law() {
    let folder = tempfile::tempdir().unwrap();
    let run = excite(folder.path(), "--joint q1 -o q1.toml --json -")
        .assert()
        .code(0);
    let document: Value = serde_json::from_slice(&run.get_output().stdout).unwrap();
    let friction = &document["friction"];
    let names = ["viscous", "coulomb_1", "coulomb_2", "slope_1", "slope_2"];
    for (k, name) in names.iter().enumerate() {
        assert_eq!(friction["parameters"][k]["name"], *name);
    }
    let gain = |k: usize| {
        let usual = friction["usual_relative_std"][k].as_f64().unwrap();
        usual / friction["parameters"][k]["relative_std"].as_f64().unwrap()
    };
    assert!(gain(3) > 1.1 && gain(4) > 1.1, "{} {}", gain(3), gain(4));
    let check = excite(folder.path(), "--check q1.toml").assert().code(0);
    let said = String::from_utf8_lossy(&check.get_output().stdout).into_owned();
    assert!(said.contains("friction of q1"), "{said}");
}

#[test]
fn lines_and_files_that_cannot_be_used_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let code = |line: &str, code: i32, message: &'static str| {
        excite(folder.path(), line)
            .assert()
            .code(code)
            .stderr(contains(message));
    };
    code("-r configs/cft.toml", 2, "--output");
    code(
        "--check configs/table3.toml -o a.toml",
        2,
        "cannot be used with",
    );
    code("--parameter theta_6 -o a.toml", 2, "a-optimal");
    let line = "--criterion a-optimal --parameter theta_66 -o a.toml";
    code(line, 2, "theta_12");
    let line = "-r configs/cft-dspace.toml --offsets configs/table3.toml -o a.toml";
    code(line, 3, "offset 0.0869 of x_c4");
    code("-r configs/emps.toml -o a.toml", 3, "[limits.q1]");
    code("--check nothing.toml", 3, "nothing.toml");
    let weak = "[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\n[limits.x_c1]\nvolts = 0.2\n";
    fs::write(folder.path().join("weak.toml"), weak).unwrap();
    code("-r weak.toml -o a.toml", 3, "at rest already");
    assert!(!folder.path().join("a.toml").exists());
}
