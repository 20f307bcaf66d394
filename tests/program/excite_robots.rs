//! What one robot can do every robot can: ladders, checks, limits and simulations on a serial arm, on a single
//! joint and on an arm of many joints, as on the CFT robot.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use serde_json::Value;

/// Two links in a vertical plane, 0.4 m between the axes.
const ARM: &str = r#"[robot]
model = "serial"
drive_inertia = false
gravity = [0.0, -9.81, 0.0]

[[robot.link]]
joint = "shoulder"

[[robot.link]]
joint = "elbow"
a = 0.4

[friction]
law = "double-tanh"

[limits.shoulder]
position = [-1.5, 1.5]
speed = 3.0
torque = 60.0

[limits.elbow]
position = [-2.0, 2.0]
speed = 2.0
torque = 20.0
"#;

const SLIDE: &str = r#"[robot]
model = "single-joint"
joint = "slide"
kind = "prismatic"

[limits.slide]
position = [0.0, 0.25]
speed = 0.4
torque = 900.0
"#;

/// A double-tanh law: Bv, Bf1, Bf2, w1, w2.
const LAW: [&str; 5] = ["viscous", "coulomb_1", "coulomb_2", "slope_1", "slope_2"];

fn parameter(text: &mut String, name: &str, joint: &str, value: f64) {
    let joint = match joint {
        "" => String::new(),
        joint => format!("joint = \"{joint}\"\n"),
    };
    let words = "unit = \"1\"\nmeaning = \"of the test\"";
    writeln!(
        text,
        "\n[[parameter]]\nname = \"{name}\"\n{joint}value = {value:?}\n{words}"
    )
    .unwrap();
}

/// The arm and the slide with their models, in a folder.
fn robots() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let inertias = [
        ("Izz1", 0.9),
        ("mx1", 1.4),
        ("my1", 0.1),
        ("Izz2", 0.15),
        ("mx2", 0.35),
        ("my2", -0.02),
    ];
    let mut arm = ARM.to_owned();
    for (name, value) in inertias {
        parameter(&mut arm, name, "", value);
    }
    for (joint, scale) in [("shoulder", 1.0), ("elbow", 0.5)] {
        for (name, value) in LAW.iter().zip([2.0, 1.6, -0.6, 40.0, 6.0]) {
            let factor = if name.starts_with("slope") {
                1.0
            } else {
                scale
            };
            parameter(&mut arm, name, joint, factor * value);
        }
    }
    let mut slide = SLIDE.to_owned();
    parameter(&mut slide, "inertia", "", 95.0);
    parameter(&mut slide, "viscous", "slide", 200.0);
    parameter(&mut slide, "coulomb", "slide", 20.0);
    for (name, text) in [
        ("arm.toml", ARM),
        ("slide.toml", SLIDE),
        ("arm-model.toml", &arm),
        ("slide-model.toml", &slide),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn run(folder: &Path, line: &str) -> (i32, String, Value) {
    let output = Command::cargo_bin("cft-ident")
        .unwrap()
        .current_dir(folder)
        .args(line.split_whitespace())
        .args(["--json", "-", "-q"])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    let document = serde_json::from_slice(&output.stdout).unwrap_or(Value::Null);
    (output.status.code().unwrap(), message, document)
}

/// Expected relative deviations of the friction law.
fn relative(document: &Value) -> Vec<f64> {
    let parameters = document["friction"]["parameters"].as_array().unwrap();
    let of = |p: &Value| p["relative_std"].as_f64().unwrap();
    parameters.iter().map(of).collect()
}

#[test]
fn ladders_are_designed_checked_and_run_on_a_serial_arm() {
    let folder = robots();
    let path = folder.path();
    let arm = "-r arm.toml -m arm-model.toml --seconds 12";
    for joint in ["shoulder", "elbow"] {
        let file = format!("{joint}.toml");
        let (status, message, design) =
            run(path, &format!("excite {arm} --joint {joint} -o {file}"));
        assert_eq!(status, 0, "{message}");
        let names = design["friction"]["parameters"].as_array().unwrap();
        for (p, name) in names.iter().zip(LAW) {
            assert_eq!(p["name"], name);
        }
        let usual = design["friction"]["usual_relative_std"].as_array().unwrap();
        let usual: Vec<f64> = usual.iter().map(|u| u.as_f64().unwrap()).collect();
        let found = relative(&design);
        // the slopes are what it is designed for
        assert!(
            found[3] < usual[3] && found[4] < usual[4],
            "{found:?} {usual:?}"
        );

        let (status, message, check) = run(path, &format!("excite {arm} --check {file}"));
        assert_eq!(status, 0, "{message}");
        for (a, b) in relative(&check).iter().zip(found) {
            assert!((a - b).abs() < 1e-9 * b, "{a} {b}");
        }
        let simulate = format!("simulate {arm} --reference {file} -o {joint}.csv");
        let (status, message, log) = run(path, &simulate);
        assert_eq!(status, 0, "{message}");
        assert_eq!(log["ending"], "completed");
        assert!(log["limits_reached"].as_array().unwrap().is_empty());
    }
}

#[test]
fn ladders_of_a_single_joint_need_its_friction_and_nothing_else_of_a_model() {
    let folder = robots();
    let path = folder.path();
    let line =
        "excite -r slide.toml -m slide-model.toml --seconds 10 --joint slide -o slide-l.toml";
    let (status, message, design) = run(path, line);
    assert_eq!(status, 0, "{message}");
    let found = relative(&design);
    let check = "excite -r slide.toml -m slide-model.toml --seconds 10 --check slide-l.toml";
    let (status, message, check) = run(path, check);
    assert_eq!(status, 0, "{message}");
    for (a, b) in relative(&check).iter().zip(found) {
        assert!((a - b).abs() < 1e-9 * b, "{a} {b}");
    }
    let (status, message, _) = run(path, "excite -r slide.toml --joint slide -o b.toml");
    assert_eq!(status, 3);
    assert!(message.contains("no friction in the model"), "{message}");
}

#[test]
fn a_ladder_for_a_law_that_bends_at_once_stays_within_the_travel() {
    let folder = robots();
    let path = folder.path();
    let robot = format!("{SLIDE}acceleration = 4.0\n\n[friction]\nlaw = \"double-tanh\"\n");
    let mut sharp = robot.clone();
    parameter(&mut sharp, "inertia", "", 95.0);
    // such slopes show best in slow reversals, which fast strokes have no room for
    for (name, value) in LAW.iter().zip([200.0, 14.0, 6.0, 2400.0, 800.0]) {
        parameter(&mut sharp, name, "slide", value);
    }
    fs::write(path.join("slide.toml"), robot).unwrap();
    fs::write(path.join("sharp.toml"), sharp).unwrap();
    for seed in 1..=5 {
        let made = format!(
            "excite -r slide.toml -m sharp.toml --joint slide --seed {seed} -o sharp-{seed}.toml"
        );
        let (status, message, design) = run(path, &made);
        assert_eq!(status, 0, "{message}");
        for used in design["limits_used"].as_array().unwrap() {
            assert!(used["position"].as_f64().unwrap() <= 1.0, "{used}");
        }
    }
    fs::write(
        path.join("slow-turns.toml"),
        "kind = \"single-joint\"\njoint = \"slide\"\nspeeds = [0.02, 0.2]\nturn_s = 2.0\n",
    )
    .unwrap();
    let check = "excite -r slide.toml -m sharp.toml --check slow-turns.toml";
    let (status, message, _) = run(path, check);
    assert_eq!(status, 3, "{message}");
    assert!(message.contains("give a shorter turn"), "{message}");
}

fn points(rows: &[(f64, &str)]) -> String {
    let mut text = "kind = \"points\"\ncoordinates = \"joint\"\n".to_owned();
    for (t, position) in rows {
        write!(text, "[[point]]\nt = {t:?}\nposition = {position}\n").unwrap();
    }
    text
}

#[test]
fn points_are_checked_against_the_limits_of_a_serial_arm_and_run_within_them() {
    let folder = robots();
    let path = folder.path();
    let files = [
        (
            "calm.toml",
            points(&[(0.0, "[0.1, -0.2]"), (2.0, "[0.6, 0.5]")]),
        ),
        (
            "far.toml",
            points(&[(0.0, "[0.1, -0.2]"), (2.0, "[0.6, 2.1]")]),
        ),
        (
            "fast.toml",
            points(&[(0.0, "[0.1, -0.2]"), (0.3, "[0.1, 1.2]")]),
        ),
        (
            "three.toml",
            points(&[(0.0, "[0.1, -0.2, 0.0]"), (2.0, "[0.6, 0.5, 0.0]")]),
        ),
    ];
    for (name, text) in files {
        fs::write(path.join(name), text).unwrap();
    }
    let check = |file: &str| {
        run(
            path,
            &format!("excite -r arm.toml -m arm-model.toml --check {file}"),
        )
    };
    let (status, message, calm) = check("calm.toml");
    assert_eq!(status, 0, "{message}");
    let used = calm["limits_used"].as_array().unwrap();
    assert_eq!(used.len(), 2);
    // 0.6 of [-1.5, 1.5], 0.5 of [-2, 2]
    for (used, share) in used.iter().zip([0.4, 0.25]) {
        assert!((used["position"].as_f64().unwrap() - share).abs() < 1e-6);
    }
    let (status, message, _) = check("far.toml");
    assert_eq!(status, 1);
    assert!(message.contains("position of elbow"), "{message}");
    let (status, message, _) = check("fast.toml");
    assert_eq!(status, 1);
    assert!(message.contains("speed of elbow"), "{message}");
    let (status, message, _) = check("three.toml");
    assert_eq!(status, 3);
    assert!(
        message.contains("point 1 has 3 coordinates and the robot has 2"),
        "{message}"
    );
    let line = "simulate -r arm.toml -m arm-model.toml --reference calm.toml -o calm.csv";
    let (status, message, log) = run(path, line);
    assert_eq!(status, 0, "{message}");
    assert_eq!(log["ending"], "completed");
}

#[test]
fn what_an_arm_does_not_have_is_shown_by_every_command() {
    let folder = robots();
    let path = folder.path();
    let wrist = "kind = \"single-joint\"\njoint = \"wrist\"\nspeeds = [0.1, 0.2]\n";
    fs::write(path.join("wrist.toml"), wrist).unwrap();
    let arm = "-r arm.toml -m arm-model.toml";
    for line in [
        format!("excite {arm} --joint wrist -o a.toml"),
        format!("excite {arm} --check wrist.toml"),
        format!("simulate {arm} --reference wrist.toml -o a.csv"),
        format!("simulate {arm} --move wrist -o a.csv"),
    ] {
        let (status, message, _) = run(path, &line);
        assert_ne!(status, 0, "{line}");
        assert!(
            message.contains("wrist") && message.contains("shoulder, elbow"),
            "{line}: {message}"
        );
    }
    let boundless = ARM.split("[limits").next().unwrap();
    fs::write(path.join("boundless.toml"), boundless).unwrap();
    let lines = [
        "excite -r boundless.toml -m arm-model.toml --joint elbow -o a.toml",
        "simulate -r boundless.toml -m arm-model.toml --move elbow -o a.csv",
    ];
    for line in lines {
        let (status, message, _) = run(path, line);
        assert_eq!(status, 3, "{line}: {message}");
        assert!(
            message.contains("[limits.elbow] position"),
            "{line}: {message}"
        );
    }
}

/// A chain of ten links about axes that are crossed in turn.
fn many() -> (String, String) {
    let mut robot = "[robot]\nmodel = \"serial\"\ndrive_inertia = true\n".to_owned();
    for k in 1..=10 {
        let twist = if k % 2 == 0 { 1.2 } else { -1.2 };
        write!(
            robot,
            "[[robot.link]]\njoint = \"j{k}\"\na = 0.1\nalpha = {twist}\n"
        )
        .unwrap();
    }
    robot += "[friction]\nlaw = \"viscous-coulomb\"\n";
    for k in 1..=10 {
        write!(
            robot,
            "[limits.j{k}]\nposition = [-1.0, 1.0]\nspeed = 2.0\n"
        )
        .unwrap();
    }
    let file = cft_ident::config::RobotFile::parse("many.toml", &robot).expect("a robot");
    let parameters = file.robot().parameters().to_vec();
    let mut model = robot.clone();
    for info in parameters {
        // drives of much inertia about links of little: a body whatever the pose
        let own = info.name.starts_with("Ia") || info.name.starts_with("Izz");
        parameter(&mut model, &info.name, "", if own { 0.5 } else { 0.0 });
    }
    for k in 1..=10 {
        parameter(&mut model, "viscous", &format!("j{k}"), 1.0);
        parameter(&mut model, "coulomb", &format!("j{k}"), 0.5);
    }
    (robot, model)
}

#[test]
fn ten_joints_are_simulated_and_their_motions_checked() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let (robot, model) = many();
    fs::write(path.join("many.toml"), robot).unwrap();
    fs::write(path.join("model.toml"), model).unwrap();
    let rows = [
        (0.0, format!("{:?}", [0.0; 10])),
        (2.0, format!("{:?}", [0.5; 10])),
    ];
    let rows = rows.each_ref().map(|(t, row)| (*t, row.as_str()));
    fs::write(path.join("points.toml"), points(&rows)).unwrap();
    let arm = "-r many.toml -m model.toml";
    let (status, message, check) = run(path, &format!("excite {arm} --check points.toml"));
    assert_eq!(status, 0, "{message}");
    assert_eq!(check["limits_used"].as_array().unwrap().len(), 10);
    let line = format!("simulate {arm} --reference points.toml -o many.csv");
    let (status, message, log) = run(path, &line);
    assert_eq!(status, 0, "{message}");
    assert_eq!(log["ending"], "completed");
    let text = fs::read_to_string(path.join("many.csv")).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    assert_eq!(header.len(), 21);
    let last: Vec<f64> = text
        .lines()
        .last()
        .unwrap()
        .split(',')
        .map(|x| x.parse().unwrap())
        .collect();
    for q in &last[1..=10] {
        assert!((q - 0.5).abs() < 0.05, "{q}");
    }
    let ladder = format!("simulate {arm} --move j7 --seconds 12 -o j7.csv");
    let (status, message, log) = run(path, &ladder);
    assert_eq!(status, 0, "{message}");
    assert_eq!(log["ending"], "completed");
}
