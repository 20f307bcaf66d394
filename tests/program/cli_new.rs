//! `new` and `generate` at the process boundary.

use assert_cmd::Command;
use predicates::str::contains;
use std::path::{Path, PathBuf};

fn command(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("cft-ident").unwrap();
    command.current_dir(folder);
    command
}

/// A file of the measured logs; says so where they are not there.
fn shared(name: &str) -> Option<PathBuf> {
    let path = Path::new(cft_ident_support::ROOT)
        .join("../shared/data")
        .join(name);
    match path.canonicalize() {
        Ok(path) => Some(path),
        Err(_) => {
            eprintln!("skipped: {} is not there", path.display());
            None
        }
    }
}

/// Writes a robot file with `new`, fits the log with it, and returns the file's text.
fn first_fit(urdf: Option<&str>, log: &str) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    let log = shared(log)?;
    let mut new = command(folder.path());
    new.args(["new", "mine", "--log"]).arg(&log);
    if let Some(urdf) = urdf {
        new.arg("--urdf").arg(shared(urdf)?);
    }
    new.assert()
        .success()
        .stdout(contains("-r mine.toml -o model.toml"));
    command(folder.path())
        .arg("lsq")
        .arg(&log)
        .args(["-r", "mine.toml", "-o", "model.toml"])
        .assert()
        .success();
    assert!(folder.path().join("model.toml").is_file());
    Some(std::fs::read_to_string(folder.path().join("mine.toml")).unwrap())
}

#[test]
fn the_first_fit_of_the_tx40_needs_urdf_and_log_alone() {
    let Some(text) = first_fit(Some("tx40/tx40_mdh_modified.urdf"), "tx40/tx40_joint.csv") else {
        return;
    };
    assert!(
        text.contains("joint_6 = { position = \"q6\", torque = \"tau6\" }"),
        "{text}"
    );
    assert!(text.contains("by their names"), "{text}");
    assert!(text.contains("cutoff_hz = 20.0"), "{text}");
}

#[test]
fn the_first_fit_of_the_ur10_maps_columns_by_their_order_and_says_so() {
    let Some(text) = first_fit(Some("ur10/ur10_robot.urdf"), "ur10/ur10_exciting.csv") else {
        return;
    };
    assert!(text.contains("CHECK IT"), "{text}");
    assert!(
        text.contains("elbow_joint = { position = \"q3\", velocity = \"dq3\", torque = \"tau3\" }"),
        "{text}"
    );
    assert!(text.contains("cutoff_hz = 10.0"), "{text}");
}

#[test]
fn a_recording_whose_joints_have_the_names_of_the_urdf_needs_no_mapping() {
    let log = "ur10/ur10_exciting_trajectory.mcap";
    let Some(text) = first_fit(Some("ur10/ur10_robot.urdf"), log) else {
        return;
    };
    assert!(text.contains("nothing is to be mapped"), "{text}");
}

#[test]
fn without_a_urdf_the_panda_gets_rows_to_be_filled_in() {
    let Some(log) = shared("panda/panda_exciting.csv") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    command(folder.path())
        .args(["new", "mine", "--log"])
        .arg(&log)
        .assert()
        .success()
        .stdout(contains(
            "next: fill in the modified Denavit-Hartenberg rows",
        ));
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    assert_eq!(text.matches("[[robot.link]]").count(), 7);
    assert!(text.contains("TO BE FILLED IN"), "{text}");
    // nobody fits zeros: neither the rows as they are written, nor all of them zero
    for (value, shown) in [("nan", "is not filled in yet"), ("0.0", "7 rows of zeros")] {
        let name = format!("{value}.toml");
        std::fs::write(
            folder.path().join(&name),
            text.replace("= nan ", &format!("= {value} ")),
        )
        .unwrap();
        command(folder.path())
            .arg("lsq")
            .arg(&log)
            .args(["-r", &name, "-o", "model.toml"])
            .assert()
            .code(3)
            .stderr(contains(shown));
    }
}

#[test]
fn one_position_column_is_a_single_joint() {
    let Some(text) = first_fit(None, "emps/emps_id.csv") else {
        return;
    };
    assert!(
        text.contains("model = \"single-joint\"\njoint = \"mine\"\n"),
        "{text}"
    );
}

#[test]
fn a_time_column_says_its_unit_in_brackets_or_behind_its_name() {
    for (time, per_second, unit) in [
        ("time_ms", 1e3, "ms"),
        ("time [ms]", 1e3, "ms"),
        ("stamp_ns", 1e9, "ns"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let mut log = format!("{time},q1,tau1\n");
        for k in 0..4000 {
            let t = f64::from(k) * 1e-3;
            let (q, tau) = ((3.0 * t).sin(), -9.0 * (3.0 * t).sin() + (3.0 * t).cos());
            log += &format!("{},{q},{tau}\n", (per_second * t).round());
        }
        std::fs::write(folder.path().join("log.csv"), log).unwrap();
        command(folder.path())
            .args(["new", "mine", "--log", "log.csv"])
            .assert()
            .success();
        let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
        let shown = format!("time_unit = \"{unit}\"");
        assert!(text.contains(&shown), "{time}: {text}");
        command(folder.path())
            .args(["inspect", "log.csv", "--json", "found.json", "-q"])
            .assert()
            .success();
        let found = std::fs::read_to_string(folder.path().join("found.json")).unwrap();
        let found: serde_json::Value = serde_json::from_str(&found).unwrap();
        let rate = found["rate_hz"].as_f64().unwrap();
        assert!((rate - 1000.0).abs() < 1.0, "{time}: {rate}");
    }
}

#[test]
fn a_file_that_is_there_stays() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("mine.toml"), "mine").unwrap();
    command(folder.path())
        .args(["new", "mine"])
        .assert()
        .code(5)
        .stderr(contains("mine.toml is there already"));
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    assert_eq!(text, "mine");
    // and one that is not is made from nothing, and can be read
    command(folder.path())
        .args(["new", "other.toml", "--json", "-"])
        .assert()
        .success()
        .stdout(contains("\"cft-ident/new/1\""));
    let text = std::fs::read_to_string(folder.path().join("other.toml")).unwrap();
    cft_ident::config::RobotFile::parse("other.toml", &text).unwrap();
}

#[test]
fn a_urdf_elsewhere_is_named_from_where_the_robot_file_is() {
    let folder = tempfile::tempdir().unwrap();
    let (robots, drawings) = (folder.path().join("robots"), folder.path().join("drawings"));
    std::fs::create_dir_all(&robots).unwrap();
    std::fs::create_dir_all(&drawings).unwrap();
    std::fs::write(
        drawings.join("gantry.urdf"),
        include_str!("../../fixtures/urdf/gantry.urdf"),
    )
    .unwrap();
    command(folder.path())
        .args([
            "new",
            "robots/gantry",
            "--urdf",
            "drawings/gantry.urdf",
            "--tip",
            "weight",
        ])
        .assert()
        .success();
    let path = robots.join("gantry.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(
        text.contains("urdf = \"../drawings/gantry.urdf\""),
        "{text}"
    );
    let file = cft_ident::config::RobotFile::load(&path).unwrap();
    assert_eq!(file.joint_names(), ["rail", "shoulder", "elbow"]);
}

#[test]
fn capsules_hold_the_collision_shapes_of_a_urdf_and_meshes_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let link = |name: &str, shape: &str| {
        format!("<link name=\"{name}\"><collision>{shape}</collision></link>")
    };
    let joint = |name: &str, parent: &str, child: &str, z: &str| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <origin xyz=\"0 0 {z}\"/><axis xyz=\"0 1 0\"/><limit lower=\"-2\" upper=\"2\" effort=\"9\" velocity=\"1\"/></joint>"
        )
    };
    let urdf = [
        "<robot name=\"r\">".to_owned(),
        link(
            "foot",
            "<geometry><cylinder radius=\"0.2\" length=\"0.4\"/></geometry>",
        ),
        link(
            "upper",
            "<origin xyz=\"0 0 0.25\"/><geometry><box size=\"0.06 0.08 0.5\"/></geometry>",
        ),
        link("lower", "<geometry><sphere radius=\"0.1\"/></geometry>"),
        link("hand", "<geometry><mesh filename=\"hand.stl\"/></geometry>"),
        // a fixed link belongs to the moving one before it
        "<link name=\"tool\"><collision><origin rpy=\"0 1.5707963267948966 0\"/><geometry>\
         <cylinder radius=\"0.02\" length=\"0.3\"/></geometry></collision></link>"
            .to_owned(),
        joint("q1", "foot", "upper", "0.5"),
        joint("q2", "upper", "lower", "0.5"),
        joint("q3", "lower", "hand", "0.05"),
        "<joint name=\"held\" type=\"fixed\"><parent link=\"hand\"/><child link=\"tool\"/>\
         </joint></robot>"
            .to_owned(),
    ];
    std::fs::write(folder.path().join("r.urdf"), urdf.concat()).unwrap();
    command(folder.path())
        .args(["new", "r", "--urdf", "r.urdf"])
        .assert()
        .success();
    let text = std::fs::read_to_string(folder.path().join("r.toml")).unwrap();
    assert!(
        text.contains("not all collision shapes of hand could be read; give [[limits.capsule]]")
    );
    let file = cft_ident::config::RobotFile::load(&folder.path().join("r.toml")).unwrap();
    let limits = &file.limits;
    let found: Vec<(&str, [f64; 3], [f64; 3], f64)> = (limits.capsule.iter())
        .map(|c| (c.link.as_str(), c.from, c.to, c.radius))
        .collect();
    let (low, high) = ([0.0, 0.0, -0.2], [0.0, 0.0, 0.2]);
    assert_eq!(found[0], ("base", low, high, 0.2));
    // half a diagonal of its section holds a box
    assert_eq!(found[1], ("upper", [0.0; 3], [0.0, 0.0, 0.5], 0.05));
    assert_eq!(found[2], ("lower", [0.0; 3], [0.0; 3], 0.1));
    assert_eq!(
        found[3],
        ("hand", [-0.15, 0.0, 0.0], [0.15, 0.0, 0.0], 0.02)
    );
    assert_eq!(found.len(), 4);
    // the upper link ends at q2, 0.05 m from q3, about which the tool turns
    assert_eq!(limits.touching, [["upper".to_owned(), "hand".to_owned()]]);
}

#[test]
fn completions_and_manual_pages_know_every_command() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let done = command(folder.path())
            .args(["generate", "completions", shell])
            .assert()
            .success();
        let text = String::from_utf8(done.get_output().stdout.clone()).unwrap();
        for name in ["lsq", "export", "max-relative-error"] {
            assert!(text.contains(name), "{shell}: {name}");
        }
    }
    command(folder.path())
        .args(["generate", "man", "."])
        .assert()
        .success();
    for page in ["cft-ident.1", "cft-ident-lsq.1", "cft-ident-excite.1"] {
        let text = std::fs::read_to_string(folder.path().join(page)).unwrap();
        assert!(text.contains(".TH "), "{page}");
    }
    assert!(folder.path().join("cft-ident-generate.1").exists());
    command(folder.path())
        .args(["generate", "man", "nowhere"])
        .assert()
        .code(5);
}

#[test]
fn the_schema_command_prints_a_schema_of_every_kind() {
    let folder = tempfile::tempdir().unwrap();
    for kind in [
        "robot",
        "model",
        "campaign",
        "trajectory",
        "truth",
        "lsq",
        "diagnose",
        "new",
    ] {
        let done = command(folder.path())
            .args(["generate", "schema", kind])
            .assert()
            .success();
        let schema: serde_json::Value = serde_json::from_slice(&done.get_output().stdout).unwrap();
        assert_eq!(schema["type"], "object", "{kind}");
    }
    command(folder.path())
        .args(["generate", "schema", "nothing"])
        .assert()
        .code(2);
}

#[test]
fn a_command_that_went_says_which_one_stands_for_it() {
    let folder = tempfile::tempdir().unwrap();
    for (old, new) in [
        ("schema robot", "generate schema"),
        ("completions bash", "generate completions"),
        ("man .", "generate man"),
        ("diff a.json b.json", "compare A.toml B.toml"),
    ] {
        command(folder.path())
            .args(old.split(' '))
            .assert()
            .code(2)
            .stderr(predicates::str::contains(new));
    }
}
