//! Over all measured logs: what `diagnose` adds does not make the torque of unseen data worse than the
//! declared model by more than its interval, and its covariance is one. A further set is one line in
//! [`SETS`].

use crate::measured_support;

use measured_support::{run, shared};
use serde_json::Value;

/// A measured set: robot file, logs that are fitted, held-out logs; paths below
/// ../shared/data, with their spans.
struct Set {
    robot: &'static str,
    fitted: &'static [&'static str],
    unseen: &'static [&'static str],
}

const SETS: &[Set] = &[
    set(
        "configs/emps-symmetric.toml",
        &["emps/emps_id.csv"],
        &["emps/emps_pulses_val.csv"],
    ),
    set(
        "configs/emps.toml",
        &["emps/emps_id.csv"],
        &["emps/emps_pulses_val.csv"],
    ),
    // the other way round: fitted on pulses
    set(
        "configs/emps.toml",
        &["emps/emps_pulses_val.csv"],
        &["emps/emps_id.csv"],
    ),
    set(
        "configs/bldc.toml",
        &["bldc-cogging/speed_test1.txt@15.2..23s"],
        &["bldc-cogging/speed_test1.txt@23..29.5s"],
    ),
    set(
        "configs/panda.toml",
        &["panda/panda_exciting.csv@0..70%"],
        &["panda/panda_exciting.csv@70..100%"],
    ),
    set(
        "configs/ur10.toml",
        &["ur10/ur10_exciting_trajectory.mcap@0..70%"],
        &["ur10/ur10_exciting_trajectory.mcap@70..100%"],
    ),
    set(
        "configs/tx40.toml",
        &["tx40/tx40_joint.csv@0..70%"],
        &["tx40/tx40_joint.csv@70..100%"],
    ),
    set(
        "configs/pendulum.toml",
        &["pendulum/060143.csv"],
        &["pendulum/060245.csv"],
    ),
];

const fn set(
    robot: &'static str,
    fitted: &'static [&'static str],
    unseen: &'static [&'static str],
) -> Set {
    Set {
        robot,
        fitted,
        unseen,
    }
}

/// Paths of the logs; none, said aloud, where one is not there.
fn logs(names: &[&str]) -> Option<Vec<String>> {
    let path = |name: &&str| Some(shared(name)?.to_string_lossy().into_owned());
    names.iter().map(path).collect()
}

/// The covariance of a model is one: no variance below zero, no correlation above one, and what has a
/// standard deviation stands in it.
#[track_caller]
fn assert_covariance(model: &toml::Value) {
    // beside effects that predict with a part the covariance is that of the estimates
    let own = ["covariance", "estimate_covariance"].map(|key| model.get(key));
    let covariance = own.into_iter().flatten().next().unwrap();
    let matrix = covariance["matrix"].as_array().unwrap();
    let at = |i: usize, j: usize| matrix[i].as_array().unwrap()[j].as_float().unwrap();
    for i in 0..matrix.len() {
        assert!(at(i, i) > 0.0, "variance {i} is {}", at(i, i));
        for j in 0..i {
            let correlation = at(i, j) / (at(i, i) * at(j, j)).sqrt();
            assert!(correlation.abs() <= 1.0 + 1e-9, "{i} {j}: {correlation}");
        }
    }
    let names = covariance["names"].as_array().unwrap();
    for p in model["parameter"].as_array().unwrap() {
        let name = p["name"].as_str().unwrap();
        let key = match p.get("joint").and_then(toml::Value::as_str) {
            Some(joint) => format!("{name}:{joint}"),
            None => name.to_owned(),
        };
        let there = names.iter().any(|n| n.as_str() == Some(&key));
        assert!(there || p.get("std").is_none(), "{key}");
    }
}

/// No effect has a number that no machine has.
#[track_caller]
fn assert_names(found: &Value) {
    for step in found["steps"].as_array().unwrap() {
        let value = |key: &str| step["parameters"][key]["value"].as_f64().unwrap();
        let turns = step["parameters"]["gap"]["unit"] == "rad";
        let holds = match step["effect"].as_str().unwrap() {
            "stribeck" => value("c") >= 0.0,
            "smooth-coulomb" => value("fc") >= 0.0,
            "load-friction" => value("mu_c") >= 0.0,
            "drive-efficiency" => (0.0..=0.6).contains(&value("k")),
            "backlash" => value("gap") <= if turns { 0.03 } else { 2e-3 },
            "presliding" => value("sigma0") > 0.0,
            "elasticity" => value("damping") <= 0.5 && value("inertia") > 0.0,
            "delay" => value("d").abs() <= 0.1,
            "warm-up" => value("T") >= 5.0,
            "rotor-inertia" => value("J") > 0.0,
            _ => true,
        };
        assert!(holds, "{step}");
    }
}

#[test]
fn a_model_of_which_its_data_determine_nothing_is_refused() {
    let Some(log) = shared("emps/emps_id.csv") else {
        return;
    };
    let log = log.display().to_string();
    let folder = tempfile::tempdir().unwrap();
    let fit = ["lsq", &log, "-r", "configs/emps.toml", "-o", "model.toml"];
    run(folder.path(), &fit);
    let path = folder.path().join("model.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let open = |line: &str| match line.starts_with("verdict = ") {
        true => "verdict = \"not-identifiable\"\n".to_owned(),
        false => format!("{line}\n"),
    };
    std::fs::write(&path, text.lines().map(open).collect::<String>()).unwrap();
    let refused = assert_cmd::Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder.path())
        .args(["diagnose", &log, "-m", "model.toml", "-o", "refined.toml"])
        .assert()
        .code(4);
    let message = String::from_utf8_lossy(&refused.get_output().stderr).into_owned();
    let says = "model.toml: its data determine none of its parameters";
    assert!(message.contains(says), "{message}");
    assert!(!folder.path().join("refined.toml").exists());
}

#[test]
fn an_accepted_effect_that_the_data_do_not_hold_is_bounded_and_costs_no_other_its_place() {
    let Some(fitted) = logs(&[
        "ur10/ur10_exciting.csv@0..33%",
        "ur10/ur10_exciting.csv@33..67%",
    ]) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let fit = words("-o model.toml -r configs/ur10.toml");
    run(folder.path(), &[words("lsq"), fitted.clone(), fit].concat());
    let written = |more: &str| {
        let model = words(&format!("-m model.toml{more}"));
        let found = run(
            folder.path(),
            &[words("diagnose"), fitted.clone(), model].concat(),
        );
        let steps = found["steps"].as_array().unwrap().clone();
        let written = steps.into_iter().filter(|step| step["written"] == true);
        written.collect::<Vec<Value>>()
    };
    let name = |step: &Value| format!("{}:{}", step["effect"], step["joint"]);
    let alone: Vec<String> = written("").iter().map(name).collect();
    assert!(!alone.is_empty());
    // one reversal of the wrist within the corner: least squares alone would say half a million newton metres
    let with = written(" --accept smooth-coulomb:q6");
    let wanted = with.iter().find(|step| step["accepted_by_user"] == true);
    let torque = &wanted.unwrap()["parameters"]["fc"]["value"];
    assert!(torque.as_f64().unwrap() < 20.0, "{torque}");
    let with: Vec<String> = with.iter().map(name).collect();
    assert!(
        alone.iter().all(|step| with.contains(step)),
        "{alone:?} {with:?}"
    );
}

#[test]
#[ignore = "measured logs, up to a minute; `cargo test -- --ignored`"]
fn the_final_model_is_no_worse_on_unseen_data_than_the_declared_one() {
    for set in SETS {
        let (Some(fitted), Some(unseen)) = (logs(set.fitted), logs(set.unseen)) else {
            continue;
        };
        let folder = tempfile::tempdir().unwrap();
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let lsq = [
            words("lsq"),
            fitted.clone(),
            words("-o model.toml -r"),
            words(set.robot),
        ];
        run(folder.path(), &lsq.concat());
        let mut diagnose = [words("diagnose"), fitted, words("-m model.toml")].concat();
        for log in unseen {
            diagnose.extend(["--holdout".to_owned(), log]);
        }
        diagnose.extend(words("-o refined.toml"));
        let found = run(folder.path(), &diagnose);
        assert_names(&found);
        let text = std::fs::read_to_string(folder.path().join("refined.toml")).unwrap();
        assert_covariance(&toml::from_str(&text).unwrap());
        let joints = |when: &str| found[when]["holdout"]["joints"].as_array().unwrap().clone();
        for (before, after) in joints("before").iter().zip(&joints("after")) {
            // while it moves, which is what the interval is of; not worse: it reaches down to the error before
            let error = |j: &Value| {
                let moving = j["relative_error_moving"].as_f64();
                moving.unwrap_or_else(|| j["relative_error"].as_f64().unwrap())
            };
            let low = after["interval_95"][0].as_f64().unwrap();
            println!(
                "{} {:?}: {} -> {}",
                set.robot,
                set.fitted,
                error(before),
                error(after)
            );
            assert!(low <= error(before), "{}: {before} {after}", set.robot);
        }
    }
}
