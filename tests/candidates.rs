//! Effects of a user's own: formulas that `diagnose --candidates` tries beside those that it knows.

mod serial_arm;

use std::fs;
use std::path::Path;

use serial_arm::{ASKEW, done, run, simulate, write};

/// Two formulas: what is put into the logs, and one that is not in them.
const OWN: &str = r#"
[[candidate]]
name = "cross-drag"
joints = ["shoulder"]
formulas = { c = "cos(q_shoulder + q_elbow) * v" }
units = { c = "Nm s/rad" }
friction = true
meaning = "a hose that rubs where the arm is stretched"

[[candidate]]
name = "grip"
formulas = { c = "tanh(w * (q_elbow - 0.2)) * load" }
shapes = { w = { from = 1.0, to = 20.0, unit = "1/rad" } }
"#;

/// Size of what is put in \[Nm s/rad\].
const SIZE: f64 = 1.5;

/// Adds the first formula to the shoulder's torque, its speed from the positions.
fn with_drag(folder: &Path, from: &str, to: &str) {
    let mut reader = csv::Reader::from_path(folder.join(from)).unwrap();
    let header = reader.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let number = |row: usize, name: &str| -> f64 { rows[row][column(name)].parse().unwrap() };
    let mut writer = csv::Writer::from_path(folder.join(to)).unwrap();
    writer.write_record(&header).unwrap();
    for k in 0..rows.len() {
        let (before, after) = (k.saturating_sub(10), (k + 10).min(rows.len() - 1));
        let way = number(after, "q_shoulder") - number(before, "q_shoulder");
        let speed = way / (number(after, "t") - number(before, "t"));
        let stretched = (number(k, "q_shoulder") + number(k, "q_elbow")).cos();
        let torque = number(k, "tau_shoulder") + SIZE * stretched * speed;
        let fields = rows[k].iter().enumerate().map(|(i, field)| {
            if i == column("tau_shoulder") {
                format!("{torque:?}")
            } else {
                field.to_owned()
            }
        });
        writer.write_record(fields).unwrap();
    }
    writer.flush().unwrap();
}

#[test]
fn a_formula_that_is_in_the_logs_is_found_kept_in_the_model_and_predicts_unseen_motion() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, ASKEW, "");
    fs::write(at.join("own.toml"), OWN).unwrap();
    simulate(at, "plain.csv", &["--seconds", "40"]);
    simulate(at, "plain_2.csv", &["--seconds", "20", "--seed", "5"]);
    with_drag(at, "plain.csv", "id.csv");
    with_drag(at, "plain_2.csv", "unseen.csv");
    let common = [
        "diagnose",
        "id.csv",
        "-m",
        "truth.toml",
        "--holdout",
        "unseen.csv",
    ];
    let own = ["--candidates", "own.toml", "-o", "refined.toml"];
    let found = done(at, &[&common[..], &own].concat());
    let steps = found["steps"].as_array().unwrap();
    let step = steps.iter().find(|s| s["effect"] == "cross-drag");
    let step = step.unwrap_or_else(|| panic!("{steps:?}"));
    assert_eq!(
        (&step["joint"], &step["family"]),
        (&"shoulder".into(), &"own".into())
    );
    let of = &step["parameters"]["c"];
    let (value, std) = (of["value"].as_f64().unwrap(), of["std"].as_f64().unwrap());
    assert!(
        (value - SIZE).abs() < (3.0 * std).max(0.03 * SIZE),
        "{value} +- {std}"
    );
    assert!(steps.iter().all(|s| s["effect"] != "grip"), "{steps:?}");
    assert!(
        found["candidates"]
            .as_array()
            .unwrap()
            .iter()
            .any(|c| c["effect"] == "grip")
    );

    // the model keeps the formula that it has, and not the other
    let text = fs::read_to_string(at.join("refined.toml")).unwrap();
    assert!(text.contains("cos(q_shoulder + q_elbow) * v") && !text.contains("grip"));
    let error = |model: &str| -> f64 {
        let document = done(at, &["validate", "unseen.csv", "-m", model]);
        let joints = document["joints"].as_array().unwrap();
        joints[0]["relative_error"].as_f64().unwrap()
    };
    let (before, after) = (error("truth.toml"), error("refined.toml"));
    assert!(after < 0.3 * before, "{before} {after}");
    done(
        at,
        &[
            "torque",
            "unseen.csv",
            "-m",
            "refined.toml",
            "-o",
            "torque.csv",
        ],
    );
    // a diagnosis of a model that has it goes on from there
    let again = [
        "diagnose",
        "id.csv",
        "-m",
        "refined.toml",
        "--holdout",
        "unseen.csv",
        "-o",
        "again.toml",
    ];
    let found = done(at, &again);
    assert!(
        found["steps"]
            .as_array()
            .unwrap()
            .iter()
            .all(|s| s["effect"] != "cross-drag")
    );
    assert!(
        fs::read_to_string(at.join("again.toml"))
            .unwrap()
            .contains("cross-drag")
    );
    // generated code has no formula of the user's yet, and says so
    let (status, message, _) = run(at, &["export", "-m", "refined.toml", "--c", "model.h"]);
    assert!(
        status != 0 && message.contains("cross-drag"),
        "{status} {message}"
    );
    assert!(!at.join("model.h").exists());
}

#[test]
fn a_formula_that_is_none_on_this_robot_is_told_with_its_candidate() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, ASKEW, "");
    simulate(at, "id.csv", &["--seconds", "5"]);
    for (from, to, says) in [
        (
            "cos(q_shoulder + q_elbow)",
            "cos(q_wrist)",
            "`q_wrist` is not known",
        ),
        (
            "cos(q_shoulder + q_elbow)",
            "cos(q_shoulder",
            "is no formula",
        ),
        (
            "name = \"cross-drag\"",
            "name = \"spring\"",
            "the name of an effect that is known",
        ),
        (
            "joints = [\"shoulder\"]",
            "joints = [\"wrist\"]",
            "no joint `wrist`",
        ),
        ("from = 1.0", "from = 30.0", "`from` below `to`"),
        ("friction = true", "frictoin = true", "friction"),
    ] {
        assert!(OWN.contains(from), "{from}");
        fs::write(at.join("own.toml"), OWN.replace(from, to)).unwrap();
        let words = [
            "diagnose",
            "id.csv",
            "-m",
            "truth.toml",
            "--candidates",
            "own.toml",
            "-o",
            "new.toml",
        ];
        let (status, message, _) = run(at, &words);
        assert_eq!(status, 3, "{message}");
        assert!(message.contains(says), "{message}");
        assert!(!at.join("new.toml").exists());
    }
}
