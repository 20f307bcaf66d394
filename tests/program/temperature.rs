//! Temperatures of drives, from the column that the robot file names to the effect that they make: what is left of a
//! residual, formulas, models, exports; and the error where a temperature is missing or is no number.

mod missing;

use crate::serial_arm;

use std::fs;
use std::path::Path;

use cft_ident::config::RobotFile;
use cft_ident::identify::{Control, Log, LogData, RobotSetup, read_whole};
use cft_ident::log::LogSpec;
use serde_json::Value;
use serial_arm::{ASKEW, done, run, simulate, write};

/// An axis whose drive warms up in 8 s and cools down in its pauses.
const AXIS: &str = r#"
[robot]
model = "single-joint"
joint = "x"
kind = "prismatic"

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true
offset = true

[log]
torque_is = "joint"
torque_held = true

[log.joint.x]
temperature = "motor_temperature"

[sensors]
torque_noise = [1.0]

[sensors.temperature.x]
start = 20.0
rise = 40.0
time_constant_s = 8.0
cycle_s = 22.0

[filter]
position_cutoff_hz = 200.0
cutoff_hz = 20.0

[limits.x]
position = [0.0, 0.4]
speed = 0.3
acceleration = 2.0
"#;

/// Mass, friction and offset of the axis.
const TRUTH: [(&str, f64, &str); 4] = [
    ("inertia", 40.0, "kg"),
    ("viscous", 150.0, "N s/m"),
    ("coulomb", 12.0, "N"),
    ("offset", -2.0, "N"),
];

/// Grease that is thinner where it is warm.
const GREASE: &str = r#"
[[candidate]]
name = "grease"
joints = ["x"]
formulas = { c = "exp(-k * (temperature - 20)) * v" }
units = { c = "N s/m" }
shapes = { k = { from = 0.005, to = 0.2, unit = "1/K" } }
friction = true
"#;

/// Its numbers.
const SIZE: f64 = 80.0;
const FALL: f64 = 0.03;

fn axis(folder: &Path) {
    let mut model = AXIS.to_owned();
    for (name, value, unit) in TRUTH {
        let joint = match name {
            "inertia" => "",
            _ => "joint = \"x\"\n",
        };
        model += &format!(
            "\n[[parameter]]\nname = \"{name}\"\n{joint}value = {value:?}\nunit = \"{unit}\"\nmeaning = \"of the test\"\n"
        );
    }
    fs::write(folder.join("robot.toml"), AXIS).unwrap();
    fs::write(folder.join("truth.toml"), model).unwrap();
    fs::write(folder.join("own.toml"), GREASE).unwrap();
}

/// A log of the axis with its grease.
fn with_grease(folder: &Path, log: &str, words: &[&str]) {
    let effect = format!("grease:x:c={SIZE},k={FALL}");
    let own = ["--candidates", "own.toml", "--effect", &effect];
    simulate(folder, log, &[&own[..], words].concat());
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

/// Value and deviation of a number of a step.
fn value_and_std(step: &Value, key: &str) -> [f64; 2] {
    let of = &step["parameters"][key];
    [number(&of["value"]), number(&of["std"])]
}

/// The first two signals on which the residual of a joint depends.
fn signals(document: &Value, joint: &str) -> Vec<String> {
    let all = document["dependence"].as_array().unwrap().iter();
    let of = all.filter(|d| d["joint"] == joint);
    let signals = of.flat_map(|d| d["signals"].as_array().unwrap());
    signals
        .map(|s| s.as_str().unwrap().to_owned())
        .take(2)
        .collect()
}

/// Root mean square error of a model along a log.
fn rms(folder: &Path, log: &str, model: &str, joint: usize) -> f64 {
    let document = done(folder, &["validate", log, "-m", model]);
    number(&document["joints"][joint]["rmse"])
}

/// A diagnosis with the user's own formulas, after these checks: a signal is among the first
/// two of what is left without the formulas; with them one step is found and leaves the noise of a log without it.
fn found_by_its_formula(
    at: &Path,
    (joint, number): (&str, usize),
    signal: &str,
    name: &str,
) -> Value {
    let words = [
        "diagnose",
        "id.csv",
        "-m",
        "truth.toml",
        "--holdout",
        "unseen.csv",
    ];
    let left = done(at, &words);
    let signals = signals(&left, joint);
    assert!(
        signals.iter().any(|s| s == signal),
        "{signals:?} {}",
        left["steps"]
    );
    let own = ["--candidates", "own.toml", "-o", "refined.toml"];
    let found = done(at, &[&words[..], &own].concat());
    let steps = found["steps"].as_array().unwrap();
    let written: Vec<_> = steps.iter().filter(|s| s["written"] == true).collect();
    assert!(
        written.len() == 1 && steps[0]["effect"] == name,
        "{steps:?}"
    );
    let floor = rms(at, "plain.csv", "truth.toml", number);
    let [without, with] = ["truth.toml", "refined.toml"].map(|m| rms(at, "unseen.csv", m, number));
    assert!(
        with < 1.1 * floor && without > 3.0 * floor,
        "{floor} {without} {with}"
    );
    found
}

#[test]
fn grease_that_thins_is_seen_in_what_is_left_and_found_by_its_formula() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    axis(at);
    with_grease(at, "id.csv", &["--seconds", "90"]);
    with_grease(at, "unseen.csv", &["--seconds", "40", "--seed", "5"]);
    simulate(at, "plain.csv", &["--seconds", "40", "--seed", "5"]);
    let header = fs::read_to_string(at.join("id.csv")).unwrap();
    assert!(header.starts_with("t,q_x,tau_x,motor_temperature\n"));
    let found = found_by_its_formula(at, ("x", 0), "temperature", "grease");
    for (key, truth) in [("c", SIZE), ("k", FALL)] {
        let [value, std] = value_and_std(&found["steps"][0], key);
        assert!((value - truth).abs() < 3.0 * std, "{key}: {value} +- {std}");
        assert!(std < 0.2 * truth, "{key}: {value} +- {std}");
    }
    // nothing depends on the temperature any more
    assert_eq!(found["dependence"].as_array().unwrap().len(), 0);

    // the same torque by every command: along the unseen log it is what was measured less its noise
    let torque = [
        "torque",
        "unseen.csv",
        "-m",
        "refined.toml",
        "-o",
        "torque.csv",
    ];
    done(at, &torque);
    let compared = done(at, &["compare", "truth.toml", "refined.toml", "unseen.csv"]);
    let with = rms(at, "unseen.csv", "refined.toml", 0);
    let b = &compared["logs"]["joints"][0]["b"]["rmse"];
    assert!((number(b) - with).abs() < 1e-9 * with, "{b} {with}");
}

#[test]
fn a_joint_of_an_arm_hangs_on_the_temperature_of_another() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let warm = "\n[log.joint.elbow]\ntemperature = \"warmth\"\n\n[sensors.temperature.elbow]\nstart = 25.0\n\
        rise = 30.0\ntime_constant_s = 6.0\ncycle_s = 18.0\n";
    write(at, ASKEW, warm);
    let own = "[[candidate]]\nname = \"sump\"\njoints = [\"shoulder\"]\n\
        formulas = { c = \"(temperature_elbow - 40) * v\" }\nfriction = true\n";
    fs::write(at.join("own.toml"), own).unwrap();
    let effect = [
        "--candidates",
        "own.toml",
        "--effect",
        "sump:shoulder:c=-0.06",
    ];
    simulate(at, "plain.csv", &["--seconds", "20", "--seed", "5"]);
    simulate(at, "id.csv", &[&["--seconds", "60"], &effect[..]].concat());
    let more = ["--seconds", "20", "--seed", "5"];
    simulate(at, "unseen.csv", &[&more[..], &effect].concat());
    let found = found_by_its_formula(at, ("shoulder", 0), "temperature of elbow", "sump");
    let [value, std] = value_and_std(&found["steps"][0], "c");
    assert!((value + 0.06).abs() < 3.0 * std, "{value} +- {std}");
}

/// What the simulator says of the formula where the robot file declares no temperature.
fn unnamed_plant(at: &Path) -> String {
    let start = AXIS.find("[sensors.temperature.x]").unwrap();
    let end = AXIS.find("[filter]").unwrap();
    let plain = format!("{}{}", &AXIS[..start], &AXIS[end..]);
    fs::write(at.join("plain.toml"), &plain).unwrap();
    let truth = fs::read_to_string(at.join("truth.toml")).unwrap();
    fs::write(at.join("plain_truth.toml"), truth.replace(AXIS, &plain)).unwrap();
    let words = "simulate -r plain.toml -m plain_truth.toml --candidates own.toml --effect grease:x:c=1,k=0.1 -o new.csv";
    let words: Vec<&str> = words.split(' ').collect();
    let (status, message, _) = run(at, &words);
    assert_eq!(status, 3, "{message}");
    message
}

#[test]
fn a_recording_and_arrays_hold_temperatures_as_a_text_log_does() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    axis(at);
    let model = fs::read_to_string(at.join("truth.toml")).unwrap();
    let effect = format!(
        "{GREASE}\n[[effect]]\nname = \"grease\"\njoint = \"x\"\n[effect.parameters]\n\
         c = {{ value = {SIZE:?}, unit = \"1\" }}\nk = {{ value = {FALL:?}, unit = \"1\" }}\n"
    );
    fs::write(at.join("with.toml"), format!("{model}{effect}")).unwrap();
    with_grease(at, "id.csv", &["--seconds", "10"]);
    with_grease(at, "id.mcap", &["--seconds", "10"]);
    let wanted = rms(at, "id.csv", "with.toml", 0);
    assert_eq!(rms(at, "id.mcap", "with.toml", 0), wanted);
    // a topic of its own, where the joints' names stand for their temperatures
    done(at, &["convert", "id.csv", "named.csv", "-r", "robot.toml"]);
    let text = fs::read_to_string(at.join("named.csv")).unwrap();
    assert!(text.starts_with("t,q_x,tau_x,temperature_x\n"));
    done(at, &["convert", "named.csv", "named.mcap"]);
    let named = "[log.joint.x]\ntemperature = \"temperature_x\"\n";
    let plain = "[log.joint.x]\ntemperature = \"motor_temperature\"\n";
    let topic = "torque_is = \"joint\"\ntemperature_topic = \"/temperature\"\n";
    let model = format!("{model}{effect}").replace(plain, named);
    fs::write(
        at.join("named.toml"),
        model.replace("torque_is = \"joint\"\n", topic),
    )
    .unwrap();
    assert_eq!(rms(at, "named.mcap", "named.toml", 0), wanted);
    fs::write(at.join("lost.toml"), &model).unwrap();
    let (status, message, _) = run(at, &["validate", "named.mcap", "-m", "lost.toml"]);
    assert!(
        status == 3 && message.contains("no topic holds the temperature of x"),
        "{message}"
    );

    // in memory: the same temperatures beside the same rows
    let machine = RobotSetup::new("robot.toml", RobotFile::parse("robot.toml", AXIS).unwrap());
    let rows: Vec<Vec<f64>> = fs::read_to_string(at.join("id.csv"))
        .unwrap()
        .lines()
        .skip(1)
        .map(|row| row.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    let column = |k: usize| -> Vec<f64> { rows.iter().map(|row| row[k]).collect() };
    let log = Log::of_rows("arrays", &column(0), &column(1), &column(2)).unwrap();
    let arrays = log.clone().with_temperature(0, &column(3)).unwrap();
    let file = Log::from(LogSpec::whole(at.join("id.csv")));
    let of = |log: &Log| {
        let control = Control::default();
        let log = LogData::read(&machine, log, &control).unwrap();
        let read = read_whole(&machine, &[log], &control).unwrap();
        let stretch = &read.stretches[0];
        assert!(stretch.temperature.iter().all(|x| x.len() == stretch.len()));
        stretch.temperature.clone()
    };
    assert_eq!(of(&arrays), of(&file));
    assert_eq!(of(&arrays).len(), 1);
    assert_eq!(of(&log), Vec::<Vec<f64>>::new());
    let mut broken = column(3);
    broken[7] = f64::NAN;
    let error = log.clone().with_temperature(0, &broken).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("arrays, row 8: column `the temperature` holds NaN"),
        "{error}"
    );
    let error = log
        .with_temperature(0, &broken[1..])
        .unwrap_err()
        .to_string();
    assert!(error.contains("give one temperature per row"), "{error}");
}

#[test]
fn inspect_says_what_is_wrong_with_a_temperature_and_new_proposes_its_column() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    axis(at);
    with_grease(at, "id.csv", &["--seconds", "10"]);
    let text = fs::read_to_string(at.join("id.csv")).unwrap();
    let rows: Vec<&str> = text.lines().collect();
    let changed = |name: &str, of: &dyn Fn(usize, &str) -> String| {
        let rows = rows.iter().enumerate().map(|(k, row)| match k {
            0 => (*row).to_owned(),
            _ => {
                let (head, last) = row.rsplit_once(',').unwrap();
                format!("{head},{}", of(k, last))
            }
        });
        let rows: Vec<String> = rows.collect();
        fs::write(at.join(name), rows.join("\n") + "\n").unwrap();
    };
    changed("constant.csv", &|_, _| "31.5".to_owned());
    changed("leap.csv", &|k, x| match k {
        0..5000 => x.to_owned(),
        _ => format!("{:?}", x.parse::<f64>().unwrap() - 12.0),
    });
    changed("nan.csv", &|k, x| {
        if k == 900 { "nan" } else { x }.to_owned()
    });
    fs::write(
        at.join("lost.csv"),
        text.replacen("motor_temperature", "warmth", 1),
    )
    .unwrap();
    let faults = |log: &str| -> Vec<String> {
        let found = done(at, &["inspect", log, "-r", "robot.toml"]);
        let all = found["faults"].as_array().unwrap().iter();
        let of = all.filter(|f| {
            let channel = f["channel"].as_str().unwrap_or("motor_temperature");
            channel == "motor_temperature" && f["severity"] != "info"
        });
        let words = of.map(|f| {
            format!(
                "{}: {}",
                f["kind"].as_str().unwrap(),
                f["effect"].as_str().unwrap()
            )
        });
        words.collect()
    };
    assert_eq!(faults("id.csv"), Vec::<String>::new());
    for (log, kind, says) in [
        ("constant.csv", "stuck-channel", "31.5 in all"),
        ("leap.csv", "temperature-step", "up to 12.0 degC"),
        ("nan.csv", "nan", "1 row without a finite number"),
        (
            "lost.csv",
            "missing-channel",
            "no column `motor_temperature`",
        ),
    ] {
        let found = faults(log);
        let one = found.iter().find(|f| f.starts_with(kind));
        assert!(one.is_some_and(|f| f.contains(says)), "{log}: {found:?}");
    }
    let found = done(at, &["inspect", "id.csv", "-r", "robot.toml"]);
    let channels = found["channels"].as_array().unwrap();
    let warm = channels.iter().find(|c| c["name"] == "motor_temperature");
    assert_eq!(warm.unwrap()["unit"], "degC");

    // a family of columns that fits the joints is proposed, and nothing reads it unasked
    let arm = "t,q_1,q_2,tau_1,tau_2,motor_temp_1,motor_temp_2\n";
    let rows: Vec<String> = (0..2000)
        .map(|k| {
            let t = f64::from(k) * 0.002;
            let (q, v) = ((3.0 * t).sin(), 3.0 * (3.0 * t).cos());
            format!(
                "{t},{q},{},{},{},{},{}\n",
                0.5 * q,
                2.0 * v,
                v,
                20.0 + t,
                21.0 + t
            )
        })
        .collect();
    fs::write(at.join("arm.csv"), format!("{arm}{}", rows.concat())).unwrap();
    done(at, &["new", "arm", "--log", "arm.csv"]);
    let text = fs::read_to_string(at.join("arm.toml")).unwrap();
    for line in [
        "# CHECK IT: temperatures of the drives?",
        "#   q1: temperature = \"motor_temp_1\"",
        "#   q2: temperature = \"motor_temp_2\"",
    ] {
        assert!(text.contains(line), "{text}");
    }
}
