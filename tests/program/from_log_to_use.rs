//! From a log to a model in use: what one command writes every other takes, on an arm whose data want what no
//! machine has.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use cft_ident::config::{ModelFile, RobotFile};
use cft_ident::robot::friction::ViscousCoulomb;
use cft_ident::robot::model::{JointFriction, Model};
use cft_ident::robot::standard::Body;

/// Two links on level axes, in a log of its own words.
const ARM: &str = r#"[robot]
model = "serial"

[[robot.link]]
joint = "shoulder"
rpy = [1.5707963267948966, 0.0, 0.0]

[[robot.link]]
joint = "elbow"
xyz = [0.4, 0.0, 0.0]

[friction]
law = "viscous-coulomb"
fitted_with_inertias = true
offset = true

[log]
time = "stamp"
torque_is = "joint"

[log.joint]
shoulder = { position = "pos_a", torque = "eff_a" }
elbow = { position = "pos_b", torque = "eff_b" }

[filter]
cutoff_hz = 10.0

[limits.shoulder]
position = [-1.6, 1.6]
speed = 4.0
torque = 80.0

[limits.elbow]
position = [-1.6, 1.6]
speed = 5.0
torque = 40.0

[control]
rate_hz = 200.0
"#;

/// Bodies that can exist, and friction of the elbow that would drive it.
fn truth(coulomb: f64) -> Model {
    let robot = RobotFile::parse("arm.toml", ARM).unwrap().robot();
    let body = |mass: f64, x: f64| Body {
        mass,
        centre: [x, 0.02, 0.0],
        inertia: [0.02, 0.0, 0.0, 0.05, 0.0, 0.05],
    };
    let mut standard = vec![0.0; robot.standard_parameters()];
    standard[..10].copy_from_slice(&body(4.0, 0.2).standard());
    standard[10..20].copy_from_slice(&body(2.0, 0.15).standard());
    standard[20..].fill(0.1);
    let law = |viscous, coulomb| JointFriction::ViscousCoulomb(ViscousCoulomb { viscous, coulomb });
    Model {
        theta: robot.base_of(&standard),
        friction: vec![law(1.2, 1.5), law(0.9, coulomb)],
        offset: vec![0.0; 2],
        robot,
    }
}

/// A log of 25 s with positions times `scale`.
fn log(truth: &Model, phase: f64, scale: f64) -> String {
    let waves = [[(0.8, 1.7), (0.3, 4.3)], [(0.7, 2.3), (0.35, 5.1)]];
    let mut text = "stamp,pos_a,pos_b,eff_a,eff_b\n".to_owned();
    let mut chance = 1u64;
    for k in 0..5000 {
        let t = 0.005 * f64::from(k);
        let sum = |of: &dyn Fn(f64, f64) -> f64| {
            waves.map(|w| w.iter().map(|(a, w)| of(*a, *w)).sum::<f64>())
        };
        let q = sum(&|a, w| a * (w * t + phase).sin());
        let v = sum(&|a, w| a * w * (w * t + phase).cos());
        let a = sum(&|a, w| -a * w * w * (w * t + phase).sin());
        let mut tau = [0.0; 2];
        truth.torque(&q, &v, &a, &mut tau);
        let mut noise = || {
            chance = chance
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (chance >> 33) as f64 / f64::from(1u32 << 31) - 0.5
        };
        let tau = tau.map(|x| x + 0.2 * noise());
        let q = q.map(|x| scale * x);
        writeln!(text, "{t},{},{},{},{}", q[0], q[1], tau[0], tau[1]).unwrap();
    }
    text
}

/// Runs a command in a folder: status and standard error.
fn run(folder: &Path, line: &str) -> (i32, String, String) {
    let output = assert_cmd::Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder)
        .args(line.split_whitespace())
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (
        output.status.code().unwrap(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

fn good(folder: &Path, line: &str) -> String {
    let (status, out, err) = run(folder, line);
    assert_eq!(status, 0, "{line}\n{err}");
    out + &err
}

/// A folder with the arm, two logs of it, and what `lsq` made of the first.
fn fitted(coulomb: f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("arm.toml"), ARM).unwrap();
    let truth = truth(coulomb);
    fs::write(path("fit.csv"), log(&truth, 0.0, 1.0)).unwrap();
    fs::write(path("new.csv"), log(&truth, 0.7, 1.0)).unwrap();
    good(folder.path(), "lsq fit.csv -r arm.toml -o model.toml");
    folder
}

fn model(folder: &Path, name: &str) -> ModelFile {
    ModelFile::parse(name, &fs::read_to_string(folder.join(name)).unwrap()).unwrap()
}

#[test]
fn the_plain_fit_stands_in_the_file_and_beside_it_what_can_exist() {
    let folder = fitted(-0.6);
    let path = folder.path();
    let found = model(path, "model.toml");
    let coulomb = found.find("coulomb", Some("elbow")).unwrap();
    assert!(
        (coulomb.value + 0.6).abs() < 5.0 * coulomb.std.unwrap(),
        "{coulomb:?}"
    );
    // it is better on blocks left out and on the fastest of them, so torques are computed with it
    assert_eq!(coulomb.in_use(), coulomb.value);
    assert_eq!(found.links.len(), 2);
    let said = good(path, "lsq fit.csv -r arm.toml -o again.toml");
    assert!(
        said.contains("the fit is unphysical") && said.contains("coulomb:elbow -0.6"),
        "{said}"
    );
    assert!(
        said.contains("better on blocks of these logs and no worse on the fastest"),
        "{said}"
    );
    assert_eq!(
        fs::read(path.join("model.toml")).unwrap(),
        fs::read(path.join("again.toml")).unwrap()
    );
    good(
        path,
        "lsq fit.csv -r arm.toml -o plain.toml --unconstrained",
    );
    let plain = model(path, "plain.toml");
    assert!(!plain.is_consistent() && plain.links.is_empty());
    for (a, b) in plain.parameters.iter().zip(&found.parameters) {
        assert_eq!((a.value, a.std), (b.value, b.std));
    }
    assert_eq!(plain.covariance, found.covariance);
}

#[test]
fn where_the_truth_can_exist_consistency_costs_nothing() {
    let folder = fitted(0.8);
    let found = model(folder.path(), "model.toml");
    for p in &found.parameters {
        let off = (p.in_use() - p.value).abs();
        assert!(off < 0.5 * p.std.unwrap() + 1e-6, "{p:?}");
    }
}

#[test]
fn what_a_command_writes_every_other_takes() {
    let folder = fitted(-0.6);
    let path = folder.path();
    // models: of the fit, of a diagnosis, of an export
    good(path, "diagnose fit.csv -m model.toml -o refined.toml");
    good(
        path,
        "export -m model.toml --urdf id.urdf --c id.h --rust id.rs --mjcf id.xml --sdf id.sdf --usd id.usda",
    );
    for name in ["model.toml", "refined.toml", "id.toml"] {
        let lines = [
            "show MODEL --report show.html",
            "torque new.csv -m MODEL -o tau.csv",
            "validate new.csv -m MODEL -o residual.csv",
            "export -m MODEL --c x.h --rust x.rs --urdf x.urdf --mjcf x.xml --sdf x.sdf --usd x.usda",
            "simulate -r arm.toml -m MODEL --seconds 12 -o sim.csv",
            "excite -r arm.toml -m MODEL --harmonics 2 --periods 2 -o motion.toml --samples motion.csv",
            "torque motion.toml -m MODEL -o along.csv",
            "torque motion.csv -m MODEL -o along.csv",
            "excite -r arm.toml -m MODEL --check motion.toml",
            "simulate -r arm.toml -m MODEL --reference motion.toml -o sim2.csv",
            "compare model.toml MODEL new.csv",
            "diagnose new.csv -m MODEL -o again.toml",
        ];
        for line in lines {
            good(path, &line.replace("MODEL", name));
        }
    }
    // logs: of the simulator, in the robot's own words or not
    for line in [
        "inspect sim.csv -r arm.toml",
        "lsq sim.csv sim2.csv -r arm.toml -o sim.toml",
        "validate sim2.csv -m sim.toml",
        "torque sim.csv -m sim.toml -o tau.csv",
        "watch new.csv -m model.toml -o external.csv",
        "watch sim.csv -m sim.toml -o external.csv",
    ] {
        good(path, line);
    }
}

#[test]
fn planned_torques_are_the_same_from_a_trajectory_and_from_its_samples() {
    let folder = fitted(0.8);
    let path = folder.path();
    good(
        path,
        "excite -r arm.toml -m model.toml --harmonics 2 --periods 2 -o motion.toml --samples motion.csv",
    );
    good(path, "torque motion.toml -m model.toml -o a.csv");
    good(path, "torque motion.csv -m model.toml -o b.csv");
    let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();
    let rows = |text: &str| -> Vec<Vec<f64>> {
        let numbers = |line: &str| line.split(',').map(|x| x.parse().unwrap()).collect();
        text.lines().skip(1).map(numbers).collect()
    };
    let (a, b) = (rows(&read("a.csv")), rows(&read("b.csv")));
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(&b) {
        for (x, y) in a.iter().zip(b).take(3) {
            assert!((x - y).abs() < 1e-6 * (1.0 + x.abs()), "{a:?} {b:?}");
        }
    }
}

#[test]
fn another_robots_log_is_refused_by_its_positions_and_shown_by_its_torques() {
    let folder = fitted(0.8);
    let path = folder.path();
    let truth = truth(0.8);
    fs::write(path.join("degrees.csv"), log(&truth, 0.3, 57.3)).unwrap();
    let (status, _, err) = run(path, "validate degrees.csv -m model.toml");
    assert_eq!(status, 3, "{err}");
    assert!(
        err.contains("another robot") && err.contains("shoulder"),
        "{err}"
    );
    // the same joints, other masses
    let mut heavy = truth.clone();
    heavy.theta.iter_mut().for_each(|x| *x *= -1.5);
    fs::write(path.join("heavy.csv"), log(&heavy, 0.3, 1.0)).unwrap();
    let (status, out, _) = run(path, "validate heavy.csv -m model.toml");
    assert_eq!(status, 0);
    assert!(out.contains("not a validation"), "{out}");
    let (status, ..) = run(
        path,
        "validate heavy.csv -m model.toml --max-relative-error 0.5",
    );
    assert_eq!(status, 1);
    let out = good(path, "validate new.csv -m model.toml");
    assert!(!out.contains("not a validation"), "{out}");
}

#[test]
fn a_motion_whose_torques_nobody_foresees_says_so_in_every_file() {
    let folder = fitted(0.8);
    let path = folder.path();
    let quick = "--harmonics 2 --periods 2 -o m.toml --samples m.csv --plot m.svg --report m.html";
    let out = good(path, &format!("excite -r arm.toml {quick} --json m.json"));
    assert!(out.starts_with("TORQUES ARE NOT FORESEEN"), "{out}");
    for name in ["m.toml", "m.csv", "m.html", "m.json"] {
        let text = fs::read_to_string(path.join(name)).unwrap();
        assert!(text.contains("TORQUES ARE NOT FORESEEN"), "{name}");
    }
    assert!(
        fs::read_to_string(path.join("m.svg"))
            .unwrap()
            .contains("not foreseen")
    );
    assert!(
        !out.contains("shoulder torque"),
        "no limit of torque is named: {out}"
    );
    // with a model the limits of torque hold, and hold for its band
    let out = good(path, &format!("excite -r arm.toml -m model.toml {quick}"));
    assert!(
        out.contains("Torques are foreseen with the model given"),
        "{out}"
    );
    assert!(out.contains("shoulder torque"), "{out}");
    assert!(
        !fs::read_to_string(path.join("m.csv"))
            .unwrap()
            .contains('#')
    );
}

#[test]
fn a_motion_that_is_checked_has_the_deviations_that_its_design_said() {
    let folder = fitted(0.8);
    let path = folder.path();
    let document = |line: &str| -> serde_json::Value {
        good(path, &format!("{line} --json d.json"));
        let text = fs::read_to_string(path.join("d.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    };
    let designed = document("excite -m model.toml --harmonics 2 --periods 2 -o motion.toml");
    let said = good(path, "excite --check motion.toml -m model.toml");
    let checked = document("excite --check motion.toml -m model.toml");
    let slower = document("excite --check motion.toml -m model.toml --rate 100");
    for of in [&designed, &checked, &slower] {
        assert_eq!(of["noise_source"], "model");
        assert_eq!(of["friction_fitted"], true);
        let each = of["parameters"].as_array().unwrap();
        assert!(!each.is_empty());
        for (a, b) in each.iter().zip(designed["parameters"].as_array().unwrap()) {
            let [a, b] = [a, b].map(|p| p["std"].as_f64().unwrap());
            // rows are independent at the rate of the filter, whatever that of the log is
            assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
        }
    }
    // the robot file gives no acceleration: what the log reached is named as such, with the line to write
    let limits = checked["limits"].as_array().unwrap();
    let of_logs = limits.iter().filter(|l| l["from_logs"] == true);
    let kinds: Vec<&str> = of_logs.map(|l| l["quantity"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["acceleration", "acceleration"]);
    for words in ["no limit of acceleration", "`acceleration = ", "(logs)"] {
        assert!(said.contains(words), "{words}: {said}");
    }
}

#[test]
fn a_log_that_disagrees_with_the_others_is_named_and_the_error_of_each_is_printed() {
    let folder = fitted(0.8);
    let path = folder.path();
    let truth = truth(0.8);
    for (name, phase) in [("a.csv", 0.0), ("b.csv", 0.9), ("c.csv", 1.7)] {
        fs::write(path.join(name), log(&truth, phase, 1.0)).unwrap();
    }
    fs::write(path.join("loaded.csv"), loaded(3, 1.5, [1.0; 2])).unwrap();
    let (status, out, err) = run(path, "lsq a.csv b.csv c.csv -r arm.toml -o m.toml");
    assert_eq!(status, 0);
    assert!(!err.contains("disagree"), "{err}");
    assert!(out.contains("relative error in each log"), "{out}");
    let line = "lsq a.csv loaded.csv b.csv c.csv -r arm.toml -o m.toml --json m.json";
    let (status, _, err) = run(path, line);
    assert_eq!(status, 0);
    let words = "loaded.csv disagrees with the other logs";
    assert!(err.contains(words), "{err}");
    let document: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(path.join("m.json")).unwrap()).unwrap();
    let logs = document["by_log"].as_array().unwrap();
    let names: Vec<&str> = logs.iter().map(|l| l["log"].as_str().unwrap()).collect();
    assert_eq!(names, ["a.csv", "loaded.csv", "b.csv", "c.csv"]);
}

/// A log with a body of `mass` at (0.1, 0.05, 0) of the last link, whose torque channels show `gains` times the torque.
fn loaded(seed: u64, mass: f64, gains: [f64; 2]) -> String {
    let truth = truth(0.8);
    let body = Body {
        mass,
        centre: [0.1, 0.05, 0.0],
        inertia: [0.003, 0.0, 0.0, 0.003, 0.0, 0.003].map(|x| mass * x),
    };
    let mut loaded = truth.clone();
    let mut standard = vec![0.0; truth.robot.standard_parameters()];
    standard[10..20].copy_from_slice(&body.standard());
    for (x, more) in loaded.theta.iter_mut().zip(truth.robot.base_of(&standard)) {
        *x += more;
    }
    // another day: other friction
    loaded.friction[0] = JointFriction::ViscousCoulomb(ViscousCoulomb {
        viscous: 1.4,
        coulomb: 1.7,
    });
    let text = log(&loaded, 0.13 * seed as f64, 1.0);
    let row = |line: &str| {
        let x: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        format!(
            "{},{},{},{},{}",
            x[0],
            x[1],
            x[2],
            gains[0] * x[3],
            gains[1] * x[4]
        )
    };
    let mut lines = text.lines();
    let head = lines.next().unwrap().to_owned();
    std::iter::once(head)
        .chain(lines.map(row))
        .collect::<Vec<_>>()
        .join("\n")
        + "\n"
}

#[test]
fn a_payload_is_found_with_intervals_that_hold_it_and_stands_in_the_loaded_model() {
    let folder = fitted(0.8);
    let path = folder.path();
    let (mut inside, mut logs) = ([0; 2], 0);
    for seed in 1..=12 {
        fs::write(path.join("loaded.csv"), loaded(seed, 1.5, [1.0; 2])).unwrap();
        good(
            path,
            "payload loaded.csv -m model.toml -o loaded.toml --json p.json",
        );
        let json: serde_json::Value =
            serde_json::from_slice(&fs::read(path.join("p.json")).unwrap()).unwrap();
        for (k, count) in inside.iter_mut().enumerate() {
            let mass = &json["readings"][k]["mass"];
            let value = mass["value"].as_f64().unwrap();
            assert!((value - 1.5).abs() < 0.15, "{mass}");
            let end = |i: usize| mass["interval_95"][i].as_f64().unwrap();
            *count += usize::from(end(0) <= 1.5 && 1.5 <= end(1));
        }
        let x = json["readings"][0]["centre"][0]["value"].as_f64().unwrap();
        assert!((x - 0.1).abs() < 0.02, "{x}");
        logs += 1;
    }
    assert!(
        inside.iter().all(|n| 10 * n >= 8 * logs),
        "{inside:?} of {logs}"
    );
    let (_, out, _) = run(path, "validate loaded.csv -m loaded.toml --json -");
    let json: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!(
        json["overall"]["mean_relative_error"].as_f64().unwrap() < 0.1,
        "{json}"
    );
}

#[test]
fn gains_that_are_off_are_distinguished_from_the_payload() {
    let folder = fitted(0.8);
    let path = folder.path();
    fs::write(path.join("loaded.csv"), loaded(3, 1.5, [1.1; 2])).unwrap();
    good(path, "payload loaded.csv -m model.toml --json p.json");
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(path.join("p.json")).unwrap()).unwrap();
    let gain = json["readings"][1]["gains"][0]["error"]["value"]
        .as_f64()
        .unwrap();
    assert!((gain - 0.1).abs() < 0.05, "{gain}");
}

#[test]
fn a_log_without_a_load_says_that_none_is_seen_and_leaves_the_model_as_it_was() {
    let folder = fitted(0.8);
    let path = folder.path();
    let mut none = 0;
    for seed in 1..=6 {
        fs::write(path.join("empty.csv"), loaded(seed, 0.0, [1.0; 2])).unwrap();
        let out = good(path, "payload empty.csv -m model.toml -o loaded.toml");
        if out.contains("no payload; one above") {
            let text = |name: &str| fs::read(path.join(name)).unwrap();
            assert!(text("loaded.toml") == text("model.toml"), "{out}");
            none += 1;
        }
    }
    // one interval of 95 % in forty lies above zero
    assert!(none >= 5, "{none} of 6");
}

#[test]
fn a_body_that_spoils_a_joint_is_announced_first_and_is_not_written() {
    let folder = fitted(0.8);
    let path = folder.path();
    // no body makes one joint carry more and leaves the other as it was
    fs::write(path.join("odd.csv"), loaded(5, 0.0, [1.6, 1.0])).unwrap();
    let out = good(
        path,
        "payload odd.csv -m model.toml -o loaded.toml --json p.json",
    );
    assert!(out.contains("the body makes errors larger: "), "{out}");
    let json: serde_json::Value =
        serde_json::from_slice(&fs::read(path.join("p.json")).unwrap()).unwrap();
    let joints = json["readings"][0]["joints"].as_array().unwrap().iter();
    let worse: Vec<&serde_json::Value> = joints.filter(|joint| joint["worse"] == true).collect();
    assert!(!worse.is_empty());
    for joint in worse {
        assert!(
            joint["after"].as_f64() > joint["before"].as_f64(),
            "{joint}"
        );
    }
    let text = |name: &str| fs::read(path.join(name)).unwrap();
    assert!(text("loaded.toml") == text("model.toml"), "{out}");
}
