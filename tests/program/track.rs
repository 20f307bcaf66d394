//! Parameters over logs: measured robots do not change, simulated ones are followed, and logs that have no order or
//! belong elsewhere are refused.

use crate::measured_support;

use std::path::Path;

use assert_cmd::Command;
use cft_ident::config::RobotFile;
use cft_ident::identify::{
    Control, Dataset, Log, RobotSetup, RobotSources, TrackSource, Tracked, reduce, track,
};
use measured_support::{run, shared};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn slide() -> RobotSetup {
    let text = r#"
        robot = { model = "single-joint", joint = "slide", kind = "prismatic" }
        friction = { law = "viscous-coulomb", fitted_with_inertias = true, offset = true }
        filter = { cutoff_hz = 20.0, position_cutoff_hz = 80.0 }
    "#;
    RobotSetup::new("slide.toml", RobotFile::parse("slide.toml", text).unwrap())
}

/// A log of 8 s that begins at `from`, of a slide with this Coulomb friction.
fn log(seed: u64, from: f64, coulomb: f64) -> Log {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let mut noise = || (0..12).map(|_| chance.random::<f64>()).sum::<f64>() - 6.0;
    let waves = [(0.11, 1.9), (0.05, 4.7), (0.02, 9.1)];
    let (mut t, mut q, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..1600 {
        let now = 0.005 * f64::from(k);
        let phase = seed as f64;
        let sum = |of: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(a, w)| of(*a, *w)).sum::<f64>();
        let v = sum(&|a, w| a * w * (w * now + phase).cos());
        let a = sum(&|a, w| -a * w * w * (w * now + phase).sin());
        t.push(from + now);
        q.push(sum(&|a, w| a * (w * now + phase).sin()));
        tau.push(12.0 * a + 30.0 * v + coulomb * v.signum() + 4.0 + noise());
    }
    Log::of_rows(&format!("log{seed}"), &t, &q, &tau).unwrap()
}

/// Sources of a robot from its logs, each in a file of its own.
fn sources(name: &str, logs: &[Log]) -> RobotSources {
    let machine = slide();
    let of = |(file, log): (usize, &Log)| {
        let parts = reduce(
            &Dataset::read(&machine, std::slice::from_ref(log), &Control::default()).unwrap(),
            None,
            &Control::default(),
        )
        .unwrap();
        TrackSource::Part {
            log: parts.logs()[0].clone(),
            file,
        }
    };
    RobotSources {
        name: name.to_owned(),
        sources: logs.iter().enumerate().map(of).collect(),
    }
}

fn tracked(robots: &[RobotSources]) -> Tracked {
    track(robots, &Control::default()).unwrap()
}

#[test]
fn a_robot_whose_friction_grows_is_found_among_those_that_stay() {
    let mut fleet = Vec::new();
    for robot in 0..5 {
        let coulomb = |k: u64| if robot == 4 && k >= 8 { 10.0 } else { 8.0 };
        let logs: Vec<Log> = (0..14)
            .map(|k| log(100 * robot + k, 3600.0 * k as f64, coulomb(k)))
            .collect();
        fleet.push(sources(&format!("slide{robot}"), &logs));
    }
    let found = tracked(&fleet);
    for (k, robot) in found.robots.iter().enumerate() {
        assert_eq!(robot.parameters.len(), 4);
        let changes: Vec<(&str, usize)> = robot
            .changes
            .iter()
            .map(|c| (c.parameter.as_str(), c.log))
            .collect();
        match k {
            4 => assert_eq!(changes, [("coulomb", 8)], "{:?}", robot.changes),
            _ => assert_eq!(changes, [], "{k}"),
        }
    }
    let change = &found.robots[4].changes[0];
    assert_eq!(change.time, 8.0 * 3600.0);
    assert!((change.size - 2.0).abs() < 3.0 * change.std, "{change:?}");
    assert!((change.relative.unwrap() - 0.25).abs() < 0.1);
    // of five robots one that differs has to stand far apart
    assert!(found.fleet.iter().all(|one| one.robot == "slide4"));
}

#[test]
fn the_order_of_files_does_not_count_where_clocks_tell_it() {
    let logs: Vec<Log> = (0..6).map(|k| log(k, 3600.0 * k as f64, 8.0)).collect();
    let mut backwards = logs.clone();
    backwards.reverse();
    let [a, b] = [logs, backwards].map(|logs| tracked(&[sources("slide", &logs)]));
    assert_eq!(
        serde_json::to_value(&a.robots).unwrap(),
        serde_json::to_value(&b.robots).unwrap()
    );
    assert!(a.notes.is_empty(), "{:?}", a.notes);
    says(&b, "out of order");
}

fn says(found: &Tracked, words: &str) {
    let first = found.notes[0].to_string();
    assert!(first.contains(words), "{:?}", found.notes);
}

#[test]
fn clocks_that_overlap_or_jump_and_single_logs_are_reported() {
    let overlap: Vec<Log> = (0..3).map(|k| log(k, 0.0, 8.0)).collect();
    let found = tracked(&[sources("slide", &overlap)]);
    says(&found, "overlap");
    assert_eq!(found.robots[0].parameters[0].times, [0.0, 1.0, 2.0]);
    let jump: Vec<Log> = [0.0, 60.0, 120.0, 1e9]
        .map(|t| log(t as u64, t, 8.0))
        .to_vec();
    let found = tracked(&[sources("slide", &jump)]);
    says(&found, "clock jumps");
    let found = tracked(&[sources("slide", &jump[..1])]);
    says(&found, "one log");
    // one file of logs whose clocks overlap has no order
    let mut one = sources("slide", &overlap);
    for source in &mut one.sources {
        if let TrackSource::Part { file, .. } = source {
            *file = 0;
        }
    }
    let error = track(&[one], &Control::default()).unwrap_err().to_string();
    assert!(error.contains("has no other order"), "{error}");
    let twice = [overlap[0].clone(), overlap[0].clone()];
    let error = track(&[sources("slide", &twice)], &Control::default()).unwrap_err();
    assert!(error.to_string().contains("same rows"), "{error}");
}

#[test]
fn spans_of_one_log_that_meet_and_a_log_under_two_names_are_reported() {
    let Some(emps) = shared("emps/emps_id.csv") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::copy(&emps, at.join("a.csv")).unwrap();
    std::fs::copy(&emps, at.join("b.csv")).unwrap();
    let reduced = |log: &str, part: &str| {
        let robot = ["-r", "configs/emps.toml", "--as-declared", "-o", part];
        run(at, &[&["reduce", log], robot.as_slice()].concat());
    };
    // the first and the last meet, and others stand between them
    let spans = [
        "0..20%", "20..40%", "40..60%", "60..80%", "10..20%", "80..100%",
    ];
    for (k, span) in spans.iter().enumerate() {
        reduced(&format!("a.csv@{span}"), &format!("{k}.cfi"));
    }
    reduced("b.csv@45..50%", "b.cfi");
    let parts = |names: &[&str]| refused(at, &[&["track"], names].concat());
    let message = parts(&["0.cfi", "1.cfi", "2.cfi", "3.cfi", "4.cfi"]);
    assert!(
        message.contains("a.csv@0..20% and a.csv@10..20% hold the same rows"),
        "{message}"
    );
    let message = parts(&["2.cfi", "1.cfi", "b.cfi"]);
    assert!(
        message.contains("a.csv@40..60% and b.csv@45..50% hold the same rows"),
        "{message}"
    );
    let line = ["track", "0.cfi", "1.cfi", "2.cfi", "3.cfi", "5.cfi"];
    assert_eq!(
        run(at, &line)["robots"][0]["logs"]
            .as_array()
            .unwrap()
            .len(),
        5
    );
    // models of the same rows by two estimators
    for how in ["wls", "ols"] {
        let name = format!("{how}.toml");
        let line = [
            "lsq",
            "a.csv",
            "-r",
            "configs/emps.toml",
            "--estimator",
            how,
            "-o",
        ];
        run(at, &[line.as_slice(), &[&name]].concat());
    }
    assert!(parts(&["wls.toml", "ols.toml"]).contains("hold the same rows"));
}

fn refused(folder: &Path, line: &[&str]) -> String {
    let output = Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder)
        .args(line)
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(3), "{message}");
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn measured_robots_cut_into_pieces_show_no_change() {
    for (log, robot, pieces) in [
        ("emps/emps_id.csv", "configs/emps.toml", 12),
        ("ur10/ur10_exciting.csv", "configs/ur10.toml", 8),
    ] {
        let Some(path) = shared(log) else { continue };
        let folder = tempfile::tempdir().unwrap();
        let mut names = Vec::new();
        for k in 0..pieces {
            let span = format!("{}..{}%", 100 * k / pieces, 100 * (k + 1) / pieces);
            let piece = format!("{}@{span}", path.display());
            let name = format!("{k}.cfi");
            run(
                folder.path(),
                &["reduce", &piece, "-r", robot, "--as-declared", "-o", &name],
            );
            names.push(name);
        }
        let mut line = vec!["track", "-o", "course.csv", "--report", "course.html"];
        line.extend(names.iter().map(String::as_str));
        let found = run(folder.path(), &line);
        assert_eq!(
            found["robots"][0]["changes"],
            serde_json::json!([]),
            "{log}"
        );
        assert_eq!(found["robots"][0]["logs"].as_array().unwrap().len(), pieces);
        let csv = std::fs::read_to_string(folder.path().join("course.csv")).unwrap();
        let parameters = found["robots"][0]["parameters"].as_array().unwrap().len();
        assert_eq!(csv.lines().count(), 1 + pieces * parameters);
        let page = std::fs::read_to_string(folder.path().join("course.html")).unwrap();
        assert!(page.contains("<svg") && !page.contains("NaN"));
    }
}

#[test]
fn files_of_two_robots_in_one_folder_and_other_files_are_refused() {
    let (Some(emps), Some(ur10)) = (shared("emps/emps_id.csv"), shared("ur10/ur10_exciting.csv"))
    else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let (emps, ur10) = (emps.to_string_lossy(), ur10.to_string_lossy());
    run(
        at,
        &["reduce", &emps, "-r", "configs/emps.toml", "-o", "a.cfi"],
    );
    run(
        at,
        &["reduce", &ur10, "-r", "configs/ur10.toml", "-o", "b.cfi"],
    );
    let message = refused(at, &["track", "a.cfi", "b.cfi"]);
    assert!(message.contains("folder of its own"), "{message}");
    let message = refused(
        at,
        &[
            "reduce",
            "a.cfi",
            "b.cfi",
            "-r",
            "configs/emps.toml",
            "-o",
            "c.cfi",
        ],
    );
    assert!(
        message.contains("is of a robot with the joints"),
        "{message}"
    );
    assert!(refused(at, &["track", &emps]).contains("emps_id.csv"));
    std::fs::write(at.join("empty.cfi"), "").unwrap();
    assert!(refused(at, &["track", "empty.cfi"]).contains("no file of reduced logs"));
    // models have no clock
    for (name, span) in [("m1.toml", "@0..50%"), ("m2.toml", "@50..100%")] {
        run(
            at,
            &[
                "lsq",
                &format!("{emps}{span}"),
                "-r",
                "configs/emps.toml",
                "-o",
                name,
            ],
        );
    }
    let found = run(at, &["track", "m1.toml", "m2.toml"]);
    assert_eq!(
        found["robots"][0]["parameters"][0]["times"],
        serde_json::json!([0.0, 1.0])
    );
}
