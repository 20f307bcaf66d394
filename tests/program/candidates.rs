//! What a user tells `diagnose` beside logs and a model: effects of his own by formulas (`--candidates`), and friction
//! that stays as it is (`--hold-friction`).

use crate::serial_arm;

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

/// Adds the first formula, and `level` times the speed, to the shoulder's torque, its speed from the positions.
fn with_drag(folder: &Path, from: &str, to: &str, level: f64) {
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
        let stretched = level + (number(k, "q_shoulder") + number(k, "q_elbow")).cos();
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
    with_drag(at, "plain.csv", "id.csv", 0.0);
    with_drag(at, "plain_2.csv", "unseen.csv", 0.0);
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
    // and not with another formula of the same name, which is refused before the logs are looked at
    let other = OWN.replace("q_shoulder + q_elbow", "q_shoulder - q_elbow");
    fs::write(at.join("own.toml"), other).unwrap();
    let words = [
        "diagnose",
        "none.csv",
        "-m",
        "refined.toml",
        "-o",
        "last.toml",
    ];
    let (status, message, _) = run(at, &[&words[..], &["--candidates", "own.toml"]].concat());
    assert_eq!(status, 3, "{message}");
    assert!(
        message.contains("candidate `cross-drag`: refined.toml has an effect of that name"),
        "{message}"
    );
    // generated code has it
    done(at, &["export", "-m", "refined.toml", "--c", "model.h"]);
    let header = fs::read_to_string(at.join("model.h")).unwrap();
    assert!(header.contains("* (cos(q[0] + q[1]) * v[0]);"), "{header}");
}

#[test]
fn a_search_finds_the_formula_and_writes_it_where_the_user_accepts_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, ASKEW, "");
    simulate(at, "plain.csv", &["--seconds", "40"]);
    simulate(at, "plain_2.csv", &["--seconds", "20", "--seed", "5"]);
    with_drag(at, "plain.csv", "id.csv", 0.0);
    with_drag(at, "plain_2.csv", "unseen.csv", 0.0);
    let search = "diagnose id.csv -m truth.toml --holdout unseen.csv --search -o refined.toml";
    let search: Vec<&str> = search.split(' ').collect();
    let found = done(at, &search);
    let formulas = found["formulas"].as_array().unwrap();
    let formula = formulas.iter().find(|f| f["joint"] == "shoulder");
    let formula = formula.unwrap_or_else(|| panic!("{formulas:?}"));
    assert_eq!(formula["end"], "found", "{formula}");
    let signals = formula["signals"].to_string();
    let own = ["\"speed\"", "\"position\"", "\"position of elbow\""];
    assert!(own.iter().all(|s| signals.contains(s)), "{formula}");
    assert!(formula["kind"].as_str().unwrap().starts_with("friction"));
    // nothing of it stands in the model without the user's word
    let text = fs::read_to_string(at.join("refined.toml")).unwrap();
    assert!(!text.contains("formula-shoulder"), "{text}");
    done(
        at,
        &[&search[..], &["--accept", "formula:shoulder"]].concat(),
    );
    let text = fs::read_to_string(at.join("refined.toml")).unwrap();
    assert!(text.contains("formula-shoulder"), "{text}");
    let error = |model: &str| -> f64 {
        let document = done(at, &["validate", "unseen.csv", "-m", model]);
        document["joints"][0]["relative_error"].as_f64().unwrap()
    };
    let (before, after) = (error("truth.toml"), error("refined.toml"));
    assert!(after < 0.3 * before, "{before} {after}");
    // what it prints is a file that is taken as it is
    let file = formula["candidate"].as_str().unwrap();
    fs::write(at.join("own.toml"), file).unwrap();
    let words = "diagnose id.csv -m truth.toml --holdout unseen.csv --candidates own.toml";
    done(at, &words.split(' ').collect::<Vec<_>>());
    let (status, message, _) = run(at, &[&search[..], &["--accept", "formula:wrist"]].concat());
    assert!(
        status == 4 && message.contains("no formula was found there"),
        "{status} {message}"
    );
}

/// One effect in every signal of the plant, also those that its own torque decides.
const ALL_SIGNALS: &str = r#"
[[candidate]]
name = "all-signals"
joints = ["shoulder", "slide"]
formulas = { inertia = "a + 0.3 * a_elbow", rub = "tanh(w * v) * load", turn = "direction * sin(3 * q_elbow)", slow = "t * q" }
shapes = { w = { from = 1.0, to = 40.0, unit = "s/rad" } }
"#;

#[test]
fn formulas_in_the_plant_are_the_torque_that_the_tool_reckons_along_its_log() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, ASKEW, "");
    fs::write(at.join("own.toml"), ALL_SIGNALS).unwrap();
    let numbers = [
        ("w", 9.0),
        ("inertia", 0.2),
        ("rub", 0.06),
        ("turn", 0.7),
        ("slow", 0.05),
    ];
    let keys: Vec<String> = numbers.iter().map(|(k, x)| format!("{k}={x}")).collect();
    let effect = format!("all-signals:shoulder:{}", keys.join(","));
    let long = ["--seconds", "20"];
    simulate(at, "plain.csv", &long);
    let own = ["--candidates", "own.toml", "--effect", &effect];
    simulate(at, "id.csv", &[&long[..], &own].concat());
    // the same from a model file
    let mut model = fs::read_to_string(at.join("truth.toml")).unwrap();
    model += ALL_SIGNALS;
    model += "[[effect]]\nname = \"all-signals\"\njoint = \"shoulder\"\n[effect.parameters]\n";
    for (key, value) in numbers {
        model += &format!("{key} = {{ value = {value:?}, unit = \"1\" }}\n");
    }
    fs::write(at.join("with.toml"), model).unwrap();
    let words = [
        "simulate",
        "-r",
        "robot.toml",
        "-m",
        "with.toml",
        "-o",
        "again.csv",
    ];
    done(at, &[&words[..], &long].concat());
    let read = |name: &str| fs::read(at.join(name)).unwrap();
    assert!(read("id.csv") == read("again.csv") && read("id.csv") != read("plain.csv"));
    let truth = fs::read_to_string(at.join("id.truth.toml")).unwrap();
    assert!(truth.contains("effect = \"all-signals\"") && truth.contains("family = \"own\""));
    let rms = |log: &str, model: &str| -> f64 {
        let document = done(at, &["validate", log, "-m", model]);
        document["joints"][0]["rmse"].as_f64().unwrap()
    };
    // what is left is the noise of a log without it; without its law much more
    let (floor, without, with) = (
        rms("plain.csv", "truth.toml"),
        rms("id.csv", "truth.toml"),
        rms("id.csv", "with.toml"),
    );
    assert!(
        with < 1.1 * floor && without > 5.0 * floor,
        "{floor} {without} {with}"
    );

    let bad = |own: &[&str]| {
        let words = "simulate -r robot.toml -m truth.toml -o bad.csv".split(' ');
        let words: Vec<&str> = words.chain(own.iter().copied()).collect();
        let (status, message, _) = run(at, &words);
        (status, message)
    };
    for (effect, says) in [
        ("all-signals:shoulder:inertia=1", "`w` has no number"),
        ("all-signals:elbow:w=9", "its `joints` do not name it"),
        ("all-signals:shoulder:w=90", "must be from 1 to 40"),
        ("all-signals:shoulder:x=1", "no key `x`"),
        ("all-signal:shoulder:w=9", "no effect `all-signal`"),
    ] {
        let (status, message) = bad(&["--candidates", "own.toml", "--effect", effect]);
        assert!(status == 2 && message.contains(says), "{status} {message}");
    }
    fs::write(
        at.join("own.toml"),
        ALL_SIGNALS.replace("a_elbow", "a_wrist"),
    )
    .unwrap();
    let (status, message) = bad(&own);
    assert!(
        status == 3 && message.contains("`a_wrist` is no signal") && !at.join("bad.csv").exists(),
        "{status} {message}"
    );
}

#[test]
fn a_formula_that_is_none_on_this_robot_is_reported_with_its_candidate() {
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

/// Values and deviations of the parameters of a model file, by name and joint.
fn parameters(folder: &Path, file: &str) -> Vec<(String, f64, f64)> {
    let text = fs::read_to_string(folder.join(file)).unwrap();
    let model: toml::Value = toml::from_str(&text).unwrap();
    let all = model["parameter"].as_array().unwrap().iter();
    all.map(|p| {
        let joint = p.get("joint").and_then(toml::Value::as_str).unwrap_or("");
        let std = p.get("std").and_then(toml::Value::as_float).unwrap_or(0.0);
        let key = format!("{} {joint}", p["name"].as_str().unwrap());
        (key, p["value"].as_float().unwrap(), std)
    })
    .collect()
}

#[test]
fn friction_that_is_held_stays_to_the_last_bit_and_its_deviation_reaches_what_goes_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write(at, ASKEW, "");
    // a formula that goes with the speed as viscous friction does
    let with_level = OWN.replace(
        "cos(q_shoulder + q_elbow)",
        "(1 + cos(q_shoulder + q_elbow))",
    );
    fs::write(at.join("own.toml"), with_level).unwrap();
    simulate(at, "plain.csv", &["--seconds", "40"]);
    with_drag(at, "plain.csv", "id.csv", 1.0);
    // the shoulder's viscous friction is 5 % off, as its deviation says
    let truth = fs::read_to_string(at.join("truth.toml")).unwrap();
    let viscous = "name = \"viscous\"\njoint = \"shoulder\"\nvalue = 2.0\n";
    assert!(truth.contains(viscous));
    let shown = |std: f64| {
        let with = format!("{}std = {std:?}\n", viscous.replace("2.0", "2.1"));
        truth.replace(viscous, &with)
    };
    fs::write(at.join("sure.toml"), shown(1e-6)).unwrap();
    fs::write(at.join("unsure.toml"), shown(0.1)).unwrap();
    let diagnosed = |model: &str, to: &str, more: &[&str]| {
        let words = [
            "diagnose",
            "id.csv",
            "-m",
            model,
            "--candidates",
            "own.toml",
            "-o",
            to,
        ];
        let found = done(at, &[&words[..], more].concat());
        let steps = found["steps"].as_array().unwrap();
        let drag = steps.iter().find(|s| s["effect"] == "cross-drag").unwrap();
        let of = &drag["parameters"]["c"];
        let shown = [of["value"].as_f64().unwrap(), of["std"].as_f64().unwrap()];
        (parameters(at, to), shown)
    };
    let (sure, [value, small]) = diagnosed("sure.toml", "held_sure.toml", &["--hold-friction"]);
    let (unsure, [same, large]) =
        diagnosed("unsure.toml", "held_unsure.toml", &["--hold-friction"]);
    let (free, [freed, _]) = diagnosed("unsure.toml", "free.toml", &[]);
    let given = parameters(at, "unsure.toml");
    let is_friction = |key: &str| !key.ends_with(' ');
    let mut moved = 0;
    for ((given, held), (sure, free)) in given.iter().zip(&unsure).zip(sure.iter().zip(&free)) {
        assert_eq!((&given.0, &given.0), (&held.0, &free.0));
        if is_friction(&given.0) {
            assert_eq!((given.1, given.2), (held.1, held.2), "{}", given.0);
            moved += usize::from(free.1 != given.1);
        } else {
            // what these data leave alone has none
            assert!(
                held.2 >= 0.99 * sure.2,
                "{}: {} {}",
                given.0,
                held.2,
                sure.2
            );
        }
    }
    assert!(moved >= 1, "{free:?}");
    // viscous friction that is held too high pulls the formula down, by what its deviation says, and only a deviation
    // that is carried on covers the truth
    assert!((value - same).abs() < 1e-3 * SIZE, "{value} {same}");
    assert!(
        (freed - SIZE).abs() < 0.3 * (same - SIZE).abs(),
        "{freed} {same}"
    );
    let off = (same - SIZE).abs();
    assert!(
        off > 3.0 * small && off < 2.0 * large,
        "{off} {small} {large}"
    );
}
