//! `excite` at the boundary of the process: files, streams, statuses.

use crate::excite_support;

use std::fs;

use assert_cmd::Command;
use cft_ident::config::Trajectory;
use predicates::str::{contains, is_empty};
use serde_json::Value;

use excite_support::excite;

/// Options of a search that takes a moment.
const QUICK: &str = "--harmonics 2";

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
        .stdout(contains("least certain combination"))
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
    assert!(document["evaluations"].as_u64().unwrap() > 0);
    excite(folder.path(), "--check d.toml").assert().code(0);
}

#[test]
fn a_program_of_a_controller_needs_six_joints_that_turn() {
    let folder = tempfile::tempdir().unwrap();
    excite(
        folder.path(),
        "--check configs/table3.toml --urscript m.script",
    )
    .assert()
    .code(2)
    .stderr(contains("the joints q1, q2, q4, q5"));
    assert!(!folder.path().join("m.script").exists());
}

#[test]
fn an_option_that_went_says_what_stands_for_it() {
    let folder = tempfile::tempdir().unwrap();
    for (line, now) in [
        ("excite --starts 3 -o m.toml", "takes as many as it needs"),
        (
            "excite --evaluations=9 -o m.toml",
            "takes as many as it needs",
        ),
        ("excite --offsets a.toml -o m.toml", "chooses the offsets"),
        ("excite --trajectory-message m.yaml -o m.toml", "--samples"),
        ("diagnose a.csv -m m.toml --cautious", "leave it out"),
        ("diagnose a.csv -m m.toml --veto b.csv", "--holdout"),
        ("lsq a.csv -r r.toml -o m.toml --feasible", "always there"),
        ("fit a.csv -r r.toml -o m.toml --feasible", "always there"),
        ("validate a.csv -m m.toml --plot v.png", "--plot v.svg"),
        ("drive a.json -o d.toml --plot=v.PNG", "--plot v.svg"),
    ] {
        let mut command = Command::cargo_bin("cft-ident").unwrap();
        command.current_dir(folder.path()).args(line.split(' '));
        let run = command.assert().code(2);
        let run = run.stderr(contains("any more")).stderr(contains(now));
        run.stdout(is_empty());
    }
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
    code("-r configs/emps.toml -o a.toml", 3, "[limits.q1]");
    code("--check nothing.toml", 3, "nothing.toml");
    let weak = "[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\n[limits.x_c1]\nvolts = 0.2\n";
    fs::write(folder.path().join("weak.toml"), weak).unwrap();
    code("-r weak.toml -o a.toml", 3, "at rest already");
    assert!(!folder.path().join("a.toml").exists());
}
