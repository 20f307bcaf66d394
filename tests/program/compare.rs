//! `compare` through the command line: two small models whose differences are known by hand.

use crate::schema_support;

use std::fmt::Write;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use cft_ident::cli::generate::schema::{SchemaKind, schema};
use predicates::str::{contains, is_empty};
use schema_support::wrong;
use serde_json::Value;

const ROBOT: &str = r#"
[robot]
model = "single-joint"
joint = "JOINT"
kind = "prismatic"

[friction]
law = "LAW"

[filter]
cutoff_hz = 10.0
"#;

/// A model file; `parameters` are name, joint, value, standard deviation and unit.
fn model(joint: &str, law: &str, parameters: &[(&str, bool, f64, Option<f64>, &str)]) -> String {
    let mut text = ROBOT.replace("JOINT", joint).replace("LAW", law);
    for (name, joined, value, std, unit) in parameters {
        writeln!(text, "\n[[parameter]]\nname = \"{name}\"").unwrap();
        if *joined {
            writeln!(text, "joint = \"{joint}\"").unwrap();
        }
        writeln!(text, "value = {value:?}\nunit = \"{unit}\"").unwrap();
        if let Some(std) = std {
            writeln!(text, "std = {std:?}").unwrap();
        }
    }
    text += "\n[provenance]\nversion = \"0.1.0\"\ncommand = \"lsq\"\n";
    text
}

/// A drive of `mass` with friction of two parameters.
fn drive(mass: f64, std: f64) -> String {
    let parameters = [
        ("inertia", false, mass, Some(std), "kg"),
        ("viscous", true, 20.0, Some(0.3), "N s/m"),
        ("coulomb", true, 5.0, None, "N"),
    ];
    model("q1", "viscous-coulomb", &parameters)
}

/// A log of 40 s at 200 Hz of a drive of 10 kg, with a little deterministic scatter.
fn log() -> String {
    let mut text = "t,q_q1,tau_q1\n".to_owned();
    for k in 0..8000 {
        let t = f64::from(k) * 0.005;
        let (w1, w2) = (2.0, 3.3);
        let q = 0.3 * (w1 * t).sin() + 0.1 * (w2 * t).cos();
        let v = 0.3 * w1 * (w1 * t).cos() - 0.1 * w2 * (w2 * t).sin();
        let a = -0.3 * w1 * w1 * (w1 * t).sin() - 0.1 * w2 * w2 * (w2 * t).cos();
        let scatter = f64::from(k * 7919 % 1009) / 1009.0 - 0.5;
        let tau = 10.0 * a + 20.0 * v + 5.0 * v.signum() + 0.5 * scatter;
        writeln!(text, "{t:.3},{q:.12},{tau:.12}").unwrap();
    }
    text
}

fn bench() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("a.toml", drive(10.0, 0.3)),
        ("b.toml", drive(11.0, 0.4)),
        ("log.csv", log()),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn tool(folder: &Path, line: &str) -> Command {
    let mut tool = Command::cargo_bin("cft-ident").unwrap();
    tool.current_dir(folder).args(line.split_whitespace());
    tool
}

fn json(folder: &Path, line: &str) -> Value {
    let run = tool(folder, line)
        .args(["--json", "-", "-q"])
        .assert()
        .code(0);
    serde_json::from_slice(&run.get_output().stdout).unwrap()
}

#[test]
fn the_document_has_its_schema_with_logs_and_without() {
    let folder = bench();
    let schema = schema(SchemaKind::Compare);
    for line in ["compare a.toml b.toml", "compare a.toml b.toml log.csv"] {
        let shown = json(folder.path(), line);
        assert_eq!(wrong(&shown, &schema, &schema, ""), None, "{line}");
        assert_eq!(shown["logs"].is_null(), !line.ends_with("log.csv"));
    }
    let mut less = json(folder.path(), "compare a.toml b.toml");
    less["parameters"][0]["a"] = Value::Null;
    assert!(wrong(&less, &schema, &schema, "").is_some());
}

#[test]
fn a_difference_is_reported_in_root_summed_variances_and_is_null_where_one_is_unknown() {
    let folder = bench();
    let shown = json(folder.path(), "compare a.toml b.toml");
    assert_eq!(shown["schema"], "cft-ident/compare/1");
    assert_eq!(shown["models"][1]["name"], "b.toml");
    assert_eq!(shown["inputs"].as_array().unwrap().len(), 2);
    let found = shown["parameters"].as_array().unwrap();
    assert_eq!(found.len(), 3);
    // 11 - 10 over sqrt(0.3^2 + 0.4^2)
    assert_eq!(found[0]["name"], "inertia");
    assert_eq!(found[0]["difference"], 1.0);
    assert!((found[0]["difference_std"].as_f64().unwrap() - 0.5).abs() < 1e-15);
    assert!((found[0]["deviation"].as_f64().unwrap() - 2.0).abs() < 1e-14);
    assert_eq!(found[1]["deviation"], 0.0);
    let coulomb = &found[2];
    assert_eq!(
        (&coulomb["name"], &coulomb["difference"]),
        (&"coulomb".into(), &0.0.into())
    );
    assert!(coulomb["difference_std"].is_null() && coulomb["deviation"].is_null());
    assert_eq!(shown["logs"], Value::Null);
    assert!(shown["only_in_a"].as_array().unwrap().is_empty());
    // without a log the speeds are assumed, and the document says so
    assert_eq!(shown["friction"][0]["speeds_from"], "assumed");
    let curve = shown["friction"][0]["curve"].as_array().unwrap();
    assert_eq!(curve.len(), 100);
    assert_eq!(
        (&curve[0]["v"], &curve[99]["a"]),
        (&(-1.0).into(), &25.0.into())
    );
}

#[test]
fn both_models_are_judged_on_the_same_rows_as_validate_judges_them() {
    let folder = bench();
    let at = folder.path();
    let shown = json(at, "compare a.toml b.toml log.csv");
    let joint = &shown["logs"]["joints"][0];
    for (side, file) in [("a", "a.toml"), ("b", "b.toml")] {
        let alone = json(at, &format!("validate log.csv -m {file}"));
        for key in ["relative_error", "rmse", "max_abs", "r2"] {
            let (here, there) = (&joint[side][key], &alone["joints"][0][key]);
            let [here, there] = [here, there].map(|x| x.as_f64().unwrap());
            assert!(
                (here / there - 1.0).abs() < 1e-9,
                "{side} {key}: {here} {there}"
            );
        }
        assert_eq!(joint[side]["samples"], alone["joints"][0]["samples"]);
    }
    // one kilogram too many is seen; the interval holds the difference and leaves out 0
    let difference = joint["difference"].as_f64().unwrap();
    let [low, high] = [0, 1].map(|k| joint["interval_95"][k].as_f64().unwrap());
    assert!(
        0.0 < low && low < difference && difference < high,
        "{low} {difference} {high}"
    );
    assert_eq!(joint["unit"], "N");
    assert_eq!(shown["friction"][0]["speeds_from"], "logs");
    tool(at, "compare a.toml b.toml log.csv")
        .assert()
        .code(0)
        .stdout(contains("a.toml is closer on these logs"));
    // a model beside itself differs in nothing
    let same = json(at, "compare a.toml a.toml log.csv");
    assert_eq!(same["logs"]["joints"][0]["difference"], 0.0);
}

#[test]
fn other_laws_and_effects_stand_apart() {
    let folder = bench();
    let at = folder.path();
    let smooth = [
        ("inertia", false, 10.0, Some(0.1), "kg"),
        ("viscous", true, 20.0, Some(0.3), "N s/m"),
        ("coulomb_1", true, 4.0, Some(0.1), "N"),
        ("coulomb_2", true, 1.0, Some(0.1), "N"),
        ("slope_1", true, 900.0, Some(9.0), "s/m"),
        ("slope_2", true, 90.0, Some(1.0), "s/m"),
    ];
    let mut text = model("q1", "double-tanh", &smooth);
    text += "\n[[effect]]\nname = \"torque-offset\"\njoint = \"q1\"\n\n[effect.parameters.c]\nvalue = 0.4\nstd = 0.1\nunit = \"N\"\n";
    fs::write(at.join("smooth.toml"), text).unwrap();
    let shown = json(at, "compare a.toml smooth.toml log.csv");
    let names = |list: &str| -> Vec<String> {
        let list = shown[list].as_array().unwrap().iter();
        list.map(|p| p["name"].as_str().unwrap().to_owned())
            .collect()
    };
    assert_eq!(names("parameters"), ["inertia", "viscous"]);
    assert_eq!(names("only_in_a"), ["coulomb"]);
    let expected = [
        "coulomb_1",
        "coulomb_2",
        "slope_1",
        "slope_2",
        "torque-offset.c",
    ];
    assert_eq!(names("only_in_b"), expected);
    assert_eq!(shown["only_in_b"][0]["reason"], "absent");
}

#[test]
fn the_tables_fit_80_columns_and_the_pictures_are_written() {
    let folder = bench();
    let at = folder.path();
    let line = "compare a.toml b.toml log.csv --plot c.svg --report c.html";
    let run = tool(at, line).assert().code(0);
    let text = String::from_utf8(run.get_output().stdout.clone()).unwrap();
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let svg = fs::read_to_string(at.join("c.svg")).unwrap();
    assert!(svg.contains("a.toml") && svg.contains("b.toml"));
    let page = fs::read_to_string(at.join("c.html")).unwrap();
    for part in [
        "Comparison of a.toml and b.toml",
        "95 % CI",
        "<svg",
        "Where it came from",
    ] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn models_in_deep_folders_have_their_whole_names() {
    let folder = bench();
    let deep = ["of-one-robot-of-many"; 8].join("/");
    fs::create_dir_all(folder.path().join(&deep)).unwrap();
    let long = format!("{}.toml", "a".repeat(60));
    let moved = folder.path().join(&deep).join(&long);
    fs::copy(folder.path().join("a.toml"), moved).unwrap();
    let found = json(folder.path(), &format!("compare {deep}/{long} b.toml"));
    assert_eq!(found["models"][0]["name"], long);
    assert_eq!(found["models"][1]["name"], "b.toml");
}

#[test]
fn models_of_different_robots_are_refused_with_their_joints() {
    let folder = bench();
    let at = folder.path();
    let other = drive(10.0, 0.3).replace("\"q1\"", "\"elbow\"");
    fs::write(at.join("other.toml"), other).unwrap();
    tool(at, "compare a.toml other.toml --json c.json --plot c.svg")
        .assert()
        .code(3)
        .stdout(is_empty())
        .stderr(contains("different robots"))
        .stderr(contains("q1 (m, N)"))
        .stderr(contains("elbow (m, N)"))
        .stderr(contains("hint: "));
    assert!(!at.join("c.json").exists() && !at.join("c.svg").exists());
}

#[test]
fn one_model_is_too_few_and_a_missing_file_is_named() {
    let folder = bench();
    let at = folder.path();
    tool(at, "compare a.toml")
        .assert()
        .code(2)
        .stderr(contains("B.toml"));
    tool(at, "compare a.toml none.toml")
        .assert()
        .code(3)
        .stderr(contains("none.toml"));
    tool(at, "compare a.toml b.toml none.csv")
        .assert()
        .code(3)
        .stderr(contains("none.csv"));
    tool(at, "compare a.toml b.toml --plot a.toml")
        .assert()
        .code(2);
}

#[test]
fn models_of_the_same_log_are_said_to_be_not_independent() {
    let folder = bench();
    let at = folder.path();
    let made = format!(
        "\n[[provenance.inputs]]\nname = \"id.csv\"\nsha256 = \"{}\"\nsamples = 9\nduration_s = 1.0\n",
        "0".repeat(64)
    );
    for name in ["a.toml", "b.toml"] {
        let text = fs::read_to_string(at.join(name)).unwrap() + &made;
        fs::write(at.join(name), text).unwrap();
    }
    tool(at, "compare a.toml b.toml")
        .assert()
        .code(0)
        .stderr(contains("warning: both models are made from id.csv"));
}

#[test]
fn files_of_friction_alone_are_compared_without_logs_and_named_with_them() {
    let folder = bench();
    let friction = |viscous: f64| {
        let parameters = [
            ("viscous", true, viscous, Some(0.3), "N s/m"),
            ("coulomb", true, 5.0, Some(0.1), "N"),
        ];
        model("q1", "viscous-coulomb", &parameters)
    };
    fs::write(folder.path().join("cold.toml"), friction(24.0)).unwrap();
    fs::write(folder.path().join("warm.toml"), friction(20.0)).unwrap();
    let found = json(folder.path(), "compare cold.toml warm.toml");
    let parameters = found["parameters"].as_array().unwrap();
    assert_eq!(parameters.len(), 2, "{parameters:?}");
    assert_eq!(parameters[0]["name"], "viscous");
    assert_eq!(parameters[0]["difference"], -4.0);
    tool(folder.path(), "compare cold.toml warm.toml log.csv")
        .assert()
        .failure()
        .stderr(contains("cold.toml: parameter `inertia` is missing"));
}
