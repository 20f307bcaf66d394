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

#[test]
fn a_simulated_torque_drive_is_found_by_its_rig_and_gains() {
    let folder = tempfile::tempdir().unwrap();
    let mut drive = vec!["drive".to_owned()];
    for motion in ["step", "sines", "chirp", "ramps", "places"] {
        for kp in ["10", "30"] {
            let log = format!("{motion}_{kp}.csv");
            let numbers = "armature=0.02,coulomb=0.15,viscous=0.05,command_delay=0.02";
            let simulate = ["simulate", "--servo", motion, "--kp", kp, "--kd", "0.4"];
            let made = [&simulate[..], &["--drive", numbers, "-o", &log]].concat();
            run(folder.path(), &made);
            assert!(
                folder
                    .path()
                    .join(format!("{motion}_{kp}.truth.toml"))
                    .exists()
            );
            if kp == "30" {
                drive.push(log);
            }
        }
    }
    let more = "-r step_30.urdf --command q_des_* --kp 30 --kd 0.4 -o drive.toml";
    drive.extend(more.split(' ').map(str::to_owned));
    let found = run(folder.path(), &drive);
    let value = |name: &str| {
        let all = found["parameters"].as_array().unwrap();
        let of = all.iter().find(|p| p["name"] == name);
        of.unwrap_or_else(|| panic!("{name}: {found}"))["value"]
            .as_f64()
            .unwrap()
    };
    // what is held from one sample to the next is late, and looks like viscous friction
    for (name, expected, within) in [
        ("armature", 0.02, 2e-4),
        ("coulomb", 0.15, 5e-3),
        ("viscous", 0.05, 1e-3),
        ("command_delay", 0.02, 2e-4),
    ] {
        let found = value(name);
        assert!((found - expected).abs() < within, "{name} {found}");
    }
}

#[test]
fn a_simulated_servo_says_what_is_wrong_with_its_arguments() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, says) in [
        ("--servo wave -o a.json", "the motions are step"),
        ("--servo step -o a.csv", "-o LOG.json for a servo"),
        ("--servo step --kd 1 -o a.json", "-o LOG.json for a servo"),
        ("--servo step --drive weight=1 -o a.json", "the names are"),
        (
            "--servo step --drive mass=-1 -o a.json",
            "must be 0 or more",
        ),
        (
            "--servo step --drive command_delay=20 -o a.json",
            "in seconds",
        ),
        (
            "-r configs/cft.toml -o a.json",
            "a .json is the log of a servo",
        ),
        ("-o a.json", "--robot"),
    ] {
        let mut command = Command::cargo_bin("cft-ident").unwrap();
        let arguments = arguments.split(' ');
        let run = command
            .current_dir(&folder)
            .arg("simulate")
            .args(arguments)
            .assert();
        run.code(2).stderr(contains(says));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
