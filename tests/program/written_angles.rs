//! Angles of robot files and URDFs as people write them, with a few decimals: the same robot as with
//! exact ones. A calibrated arm stays as it is.

use crate::measured_support;

use cft_ident::config::{ChainRequest, RobotFile, UrdfChain};
use measured_support::shared;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use std::path::Path;

/// The Panda with drive inertias, pi/2 written so.
fn panda(half_turn: &str) -> String {
    let text = std::fs::read_to_string("configs/panda.toml").unwrap();
    text.replace("1.5707963267948966", half_turn)
        .replace("drive_inertia = false", "drive_inertia = true")
}

fn base_parameters(text: &str) -> usize {
    let file = RobotFile::parse("panda.toml", text).unwrap();
    file.robot().parameters().len()
}

#[test]
fn rows_with_rounded_angles_have_the_parameters_of_exact_ones() {
    let exact = base_parameters(&panda("1.5707963267948966"));
    for written in ["1.5708", "1.571", "1.570796", "1.57079632679"] {
        assert_eq!(base_parameters(&panda(written)), exact, "{written}");
        let kept = panda(written).replace("[robot]", "[robot]\nangles_as_written = true");
        let kept = RobotFile::parse("panda.toml", &kept).unwrap();
        let alpha = written.parse::<f64>().unwrap();
        assert_eq!(kept.robot.link[2].alpha, Some(alpha));
        assert!(kept.notes.0.is_empty(), "{:?}", kept.notes.0);
    }
    // the fault that this is about: one false parameter
    let kept = panda("1.5708").replace("[robot]", "[robot]\nangles_as_written = true");
    assert_eq!(base_parameters(&kept), exact + 1);
    // named in one sentence, and only where something moved
    let file = RobotFile::parse("panda.toml", &panda("1.5708")).unwrap();
    assert_eq!(file.notes.0.len(), 1, "{:?}", file.notes.0);
    assert!(
        file.notes.0[0].contains("alpha of q2 -1.5708 as -pi/2 and 5 more"),
        "{}",
        file.notes.0[0]
    );
    let file = RobotFile::parse("panda.toml", &panda("1.57079632679")).unwrap();
    assert!(file.notes.0.is_empty(), "{:?}", file.notes.0);
}

/// The text with every number of each `rpy` at `decimals`.
fn rounded(urdf: &str, decimals: usize) -> String {
    let mut parts = urdf.split("rpy=\"");
    let mut out = parts.next().unwrap().to_owned();
    for part in parts {
        let (numbers, rest) = part.split_once('"').unwrap();
        let numbers: Vec<String> = numbers
            .split_whitespace()
            .map(|n| format!("{:.decimals$}", n.parse::<f64>().unwrap()))
            .collect();
        out += &format!("rpy=\"{}\"{rest}", numbers.join(" "));
    }
    out
}

#[test]
fn urdfs_with_rounded_angles_are_the_robots_of_exact_ones() {
    let fixtures = Path::new(cft_ident_support::ROOT).join("fixtures/urdf");
    let files = [
        Some(fixtures.join("gantry.urdf")),
        Some(fixtures.join("two_arms.urdf")),
        shared("ur10/ur10_robot.urdf"),
        shared("kr300/kr300.urdf"),
        shared("tx40/tx40_mdh_modified.urdf"),
    ];
    for path in files.into_iter().flatten() {
        let text = std::fs::read_to_string(&path).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let robot = |text: &str| {
            std::fs::write(folder.path().join("r.urdf"), text).unwrap();
            let file = "[robot]\nmodel = \"serial\"\nurdf = \"r.urdf\"\n";
            let file = RobotFile::parse_in("r.toml", file, Some(folder.path())).unwrap();
            file.robot()
        };
        let exact = robot(&text);
        let n = exact.joints();
        let count = exact.parameters().len();
        for decimals in [3, 4, 6] {
            let found = robot(&rounded(&text, decimals));
            let place = format!("{} at {decimals} decimals", path.display());
            assert_eq!(found.parameters().len(), count, "{place}");
            let names = |r: &cft_ident::robot::Robot| -> Vec<String> {
                r.parameters().iter().map(|p| p.name.to_string()).collect()
            };
            assert_eq!(names(&found), names(&exact), "{place}");
            if path.starts_with(&fixtures) {
                continue; // other angles of theirs lose digits
            }
            // the same columns at some pose, so the same rank and condition on any log
            let at = |k: f64| -> Vec<f64> { (0..n).map(|j| (k + j as f64).sin()).collect() };
            let row = |robot: &cft_ident::robot::Robot| {
                let mut y = vec![0.0; n * count];
                robot.regressor(&at(0.3), &at(1.4), &at(2.9), &mut y);
                y
            };
            for (a, b) in row(&exact).iter().zip(row(&found)) {
                assert!((a - b).abs() < 1e-9, "{place}: {a} {b}");
            }
        }
    }
}

#[test]
fn a_calibrated_arm_and_its_axes_stay_to_the_last_bit() {
    let text = r#"<robot name="r"><link name="base"/><link name="a"/><link name="b"/>
        <joint name="j1" type="revolute"><parent link="base"/><child link="a"/>
          <origin xyz="0 0 0.3" rpy="1.5704391 -0.0008113 3.1408177"/><axis xyz="0.0021 0.0004 0.999998"/></joint>
        <joint name="j2" type="revolute"><parent link="a"/><child link="b"/>
          <origin xyz="0.2 0 0" rpy="0 0.7861 0"/><axis xyz="0.7071 0 0.7071"/></joint></robot>"#;
    let chain = UrdfChain::parse("r.urdf", text, None).unwrap();
    assert_eq!(chain.links[0].rpy, Some([1.5704391, -0.0008113, 3.1408177]));
    assert_eq!(chain.links[0].axis, Some([0.0021, 0.0004, 0.999998]));
    assert_eq!(chain.links[1].rpy, Some([0.0, 0.7861, 0.0]));
    let root = 0.5f64.sqrt();
    let axis = chain.links[1].axis.unwrap();
    assert!((axis[0] - root).abs() < 1e-15 && (axis[2] - root).abs() < 1e-15);
    assert!(chain.notes.is_empty(), "{:?}", chain.notes);
    // an axis whose direction changes is named
    let text = text.replace("0.7071 0 0.7071", "0.866 0 0.5");
    let chain = UrdfChain::parse("r.urdf", &text, None).unwrap();
    assert!(
        chain.notes[0]
            .contains("axis of joint j2 0.866 0 0.5 as 0.866025404 0.000000000 0.500000000"),
        "{:?}",
        chain.notes
    );
}

#[test]
fn a_parent_that_no_link_declares_is_the_root() {
    let Some(path) = shared("pendulum/double_pendulum.urdf") else {
        return;
    };
    let chain = UrdfChain::load(&path, &ChainRequest::default()).unwrap();
    let joints: Vec<&str> = chain
        .links
        .iter()
        .filter_map(|l| l.joint.as_deref())
        .collect();
    assert_eq!(joints.len(), 2, "{joints:?}");
}

#[test]
fn the_panda_with_rounded_angles_fits_as_with_exact_ones() {
    let Some(log) = shared("panda/panda_exciting.csv") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let fit = || {
        let mut command = assert_cmd::Command::cargo_bin("cft-ident").unwrap();
        let done = command
            .current_dir(folder.path())
            .arg("lsq")
            .arg(&log)
            .args(["-r", "panda.toml", "-o", "model.toml", "--json", "-", "-q"])
            .assert()
            .success();
        serde_json::from_slice::<serde_json::Value>(&done.get_output().stdout).unwrap()
    };
    let fitted = |half_turn: &str| {
        std::fs::write(folder.path().join("panda.toml"), panda(half_turn)).unwrap();
        fit()
    };
    let count = |found: &serde_json::Value| found["parameters"].as_array().unwrap().len();
    let condition = |found: &serde_json::Value| found["condition"]["normalised"].as_f64().unwrap();
    let (exact, rounded) = (fitted("1.5707963267948966"), fitted("1.5708"));
    assert_eq!((count(&exact), count(&rounded)), (69, 69));
    assert!(
        (condition(&exact) - 20.0).abs() < 1.0,
        "{}",
        condition(&exact)
    );
    assert!((condition(&rounded) / condition(&exact) - 1.0).abs() < 1e-6);
    let warnings = rounded["warnings"].to_string();
    assert!(warnings.contains("as -pi/2"), "{warnings}");
    assert_eq!(rounded["setup"], serde_json::Value::Array(Vec::new()));
    // as it is written there is one parameter more, and the geometry that makes it is named
    let kept = panda("1.5708").replace("[robot]", "[robot]\nangles_as_written = true");
    std::fs::write(folder.path().join("panda.toml"), &kept).unwrap();
    let kept = fit();
    assert_eq!(count(&kept), 70);
    assert!(condition(&kept) > 1e6, "{}", condition(&kept));
    let setup = kept["setup"].as_array().unwrap();
    assert!(setup.iter().any(|f| f["kind"] == "geometry"), "{setup:?}");
    assert!(
        setup.iter().all(|f| f["kind"] != "geometry"
            || (f["found"].as_f64().unwrap().abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-9),
        "{setup:?}"
    );
}

#[test]
fn a_file_of_another_kind_or_a_wrong_name_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = include_str!("../../fixtures/urdf/gantry.urdf");
    std::fs::write(folder.path().join("gantry.urdf"), urdf).unwrap();
    std::fs::write(
        folder.path().join("run_1.csv"),
        "t,q_a,tau_a\n0,0,0\n1,1,1\n",
    )
    .unwrap();
    std::fs::write(folder.path().join("gantry.toml"), "[robot]\n").unwrap();
    let shown = |arguments: &[&str]| {
        let mut command = assert_cmd::Command::cargo_bin("cft-ident").unwrap();
        command
            .current_dir(folder.path())
            .args(arguments)
            .assert()
            .code(3)
    };
    shown(&["inspect", "run_1.csv", "-r", "gantry.urdf"])
        .stderr(contains("is a URDF").and(contains("cft-ident new NAME --urdf gantry.urdf")));
    shown(&["inspect", "run_1.csv", "-r", "run_1.csv"])
        .stderr(contains("is a log").and(contains("cft-ident new NAME --log run_1.csv")));
    shown(&["inspect", "run_1.csv", "-r", "gantri.toml"])
        .stderr(contains("did you mean `gantry.toml`?"));
    shown(&["inspect", "run1.csv"]).stderr(contains("did you mean `run_1.csv`?"));
    shown(&["inspect", "b.csv"]).stderr(contains("in that folder are run_1.csv"));
    shown(&["new", "mine", "--urdf", "gantr.urdf"]).stderr(contains("did you mean `gantry.urdf`?"));
}
