//! What a model is in a controller: the loops of the manual compile, a joint that sticks follows and rests under them,
//! and ros2_control gets parameters that it knows.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::export_support::{run, there};

const PAGE: &str = include_str!("../../docs/use.md");
const PLANT: &str = include_str!("../../fixtures/controllers/plant.c");
const SCHEMA: &str = include_str!("../../fixtures/controllers/joint_trajectory_controller.txt");

/// A link on a level axis, as `plant.c` has it.
const ROBOT: &str = r#"[robot]
model = "serial"

[[robot.link]]
joint = "axis"
rpy = [1.5707963267948966, 0.0, 0.0]

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true
offset = true

[log]
torque_is = "joint"
torque_held = false

[log.joint]
axis = { name = "lift/axis" }

[filter]
cutoff_hz = 20.0

[limits.axis]
position = [-1.2, 1.2]
speed = 2.0
torque = 40.0
"#;

/// The block of a language on the page.
fn block(language: &str) -> &'static str {
    let (_, rest) = PAGE.split_once(&format!("```{language}\n")).unwrap();
    rest.split_once("```").unwrap().0
}

fn compiled(folder: &Path, words: &[&str], name: &str) {
    let flags = [
        "-std=c99",
        "-pedantic",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Wno-unused-function",
        "-O1",
    ];
    run(Command::new("cc")
        .current_dir(folder)
        .args(flags)
        .args(words)
        .args(["-o", name, "plant.c", "-lm"]));
}

fn tool(folder: &Path, line: &str) -> String {
    let mut command = assert_cmd::Command::cargo_bin("cft-ident").unwrap();
    let output = command.current_dir(folder).args(line.split(' ')).output();
    let output = output.unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{line}\n{said}");
    said
}

/// What the loop leaves: rms and largest error of following, way and switches of the command at rest.
fn followed(folder: &Path, name: &str, gains: [f64; 2]) -> Vec<f64> {
    let gains = gains.map(|x| x.to_string());
    let shown = run(Command::new(folder.join(name)).args(gains));
    let shown = String::from_utf8(shown).unwrap();
    let numbers = shown.split_whitespace().map(|x| x.parse().unwrap());
    numbers.collect()
}

#[test]
fn the_loop_of_the_manual_follows_and_rests_with_a_joint_that_sticks() {
    if !there("cc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let write = |name: &str, text: &str| fs::write(path.join(name), text).unwrap();
    write("plant.c", PLANT);
    write("axis.toml", ROBOT);
    compiled(path, &[], "log");
    fs::write(
        path.join("log.csv"),
        run(&mut Command::new(path.join("log"))),
    )
    .unwrap();
    tool(path, "lsq log.csv -r axis.toml -o model.toml");
    tool(
        path,
        "export -m model.toml --c arm.h --ros2-control gains.yaml --bandwidth 4",
    );
    let yaml = parameters(&fs::read_to_string(path.join("gains.yaml")).unwrap());
    let gain = |key: &str| {
        yaml[&format!("gains.lift/axis.{key}")]
            .parse::<f64>()
            .unwrap()
    };
    let gains = [gain("p"), gain("d")];
    write("loop.c", block("c"));
    compiled(path, &["-DLOOP"], "with");
    let with = followed(path, "with", gains);
    // the same loop without friction
    let plain = block("c").replace("load[j] + friction[j]", "load[j]");
    write("loop.c", &plain);
    compiled(path, &["-DLOOP"], "without");
    let without = followed(path, "without", gains);
    assert!(2.0 * with[0] < without[0], "{with:?} {without:?}");
    assert!(with[1] < without[1], "{with:?} {without:?}");
    // at rest: less than the encoder sees, and a command that stays
    assert!(with[2] < 6e-6 && with[3] == 0.0, "{with:?}");
    // a quarter more friction than there is does not make it grow
    let more = block("c").replace("friction[j] +", "1.25 * friction[j] +");
    write("loop.c", &more);
    compiled(path, &["-DLOOP"], "more");
    let more = followed(path, "more", gains);
    assert!(more[1] < without[1] && more[3] == 0.0, "{more:?}");
}

#[test]
fn the_rust_loop_of_the_manual_compiles() {
    if !there("rustc") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    tool(path, "example ur10");
    tool(path, "new arm --urdf ur10/ur10.urdf --log ur10/ur10.mcap");
    tool(path, "lsq ur10/ur10.mcap@0..70% -r arm.toml -o model.toml");
    tool(
        path,
        "export -m model.toml --rust arm.rs --ros2-control gains.yaml",
    );
    fs::write(path.join("control.rs"), block("rust")).unwrap();
    run(Command::new("rustc").current_dir(path).args([
        "--edition",
        "2024",
        "--crate-type",
        "lib",
        "--emit",
        "metadata",
        "-D",
        "warnings",
        "-A",
        "dead_code",
        "control.rs",
    ]));
    known(&fs::read_to_string(path.join("gains.yaml")).unwrap());
}

/// Keys and values of the parameters of a file: maps by indentation, scalars and flat lists.
fn parameters(yaml: &str) -> BTreeMap<String, String> {
    let mut path: Vec<(usize, String)> = Vec::new();
    let mut found = BTreeMap::new();
    for line in yaml.lines().filter(|line| !line.starts_with('#')) {
        let depth = line.len() - line.trim_start().len();
        let (key, value) = line.trim().split_once(':').unwrap();
        path.retain(|(d, _)| *d < depth);
        path.push((depth, key.trim_matches('"').to_owned()));
        if !value.trim().is_empty() {
            let keys: Vec<&str> = path.iter().skip(2).map(|(_, key)| key.as_str()).collect();
            let twice = found.insert(keys.join("."), value.trim().to_owned());
            assert!(twice.is_none(), "{line}");
        }
    }
    let heads: Vec<&str> = yaml
        .lines()
        .filter(|line| !line.starts_with('#'))
        .take(2)
        .collect();
    assert_eq!(
        heads,
        ["joint_trajectory_controller:", "  ros__parameters:"]
    );
    found
}

/// Holds a file against the keys and types of the controller.
fn known(yaml: &str) {
    let found = parameters(yaml);
    let list = |key: &str| -> Vec<String> {
        let inner = found[key]
            .strip_prefix('[')
            .and_then(|t| t.strip_suffix(']'));
        let words = inner.unwrap().split(", ");
        words
            .map(|word| word.trim_matches('"').to_owned())
            .collect()
    };
    let joints = list("joints");
    let mut types = BTreeMap::new();
    for line in SCHEMA.lines().filter(|line| !line.starts_with('#')) {
        let words: Vec<&str> = line.split(' ').collect();
        for joint in &joints {
            types.insert(words[0].replace("JOINT", joint), words[1..].to_vec());
        }
    }
    for (key, value) in &found {
        match types.get(key).map(|of| (of[0], &of[1..])) {
            Some(("double", _)) => {
                assert!(
                    value.contains('.') && value.parse::<f64>().is_ok(),
                    "{key}: {value}"
                );
            }
            Some(("string_array", ["subset_of", known @ ..])) => {
                let there = |word: &String| known.contains(&word.as_str());
                assert!(list(key).iter().all(there), "{key}: {value}");
            }
            Some(("string_array", ["size_gt", "0"])) => assert!(!list(key).is_empty()),
            other => panic!("{key}: {value} is no parameter of the controller: {other:?}"),
        }
    }
    for joint in &joints {
        let gain = |key: &str| {
            found[&format!("gains.{joint}.{key}")]
                .parse::<f64>()
                .unwrap()
        };
        // viscous friction may damp more than the loop is to
        assert!(gain("p") > 0.0 && gain("d") >= 0.0, "{joint}");
    }
}
