//! `new` for logs as people write them: names of columns in many styles, no header, no times, several
//! machines in one recording, decimal commas. What it writes, its own readers accept.

use crate::log_support;

use assert_cmd::Command;
use cft_ident::config::RobotFile;
use log_support::recording::{JointState, Recording};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use serde_json::Value;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

const JOINTS: usize = 3;
const ROWS: usize = 3000;

/// An arm of three joints that are called so.
fn urdf(names: [&str; JOINTS]) -> String {
    let link = |name: &str, mass: f64| {
        format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"0.15 0.02 0.01\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.05\" iyz=\"0\" izz=\"0.06\"/></inertial></link>"
        )
    };
    let joint = |name: &str, parent: &str, child: &str, rpy: &str, xyz: &str| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
             <origin xyz=\"{xyz}\" rpy=\"{rpy}\"/><axis xyz=\"0 0 1\"/>\
             <limit lower=\"-3\" upper=\"3\" velocity=\"3\" effort=\"90\"/></joint>"
        )
    };
    [
        "<robot name=\"arm\"><link name=\"base\"/>".to_owned(),
        link("a", 8.0),
        link("b", 5.0),
        link("c", 2.0),
        joint(names[0], "base", "a", "0 0 0", "0 0 0.3"),
        joint(names[1], "a", "b", "1.5708 0 0", "0 0 0.1"),
        joint(names[2], "b", "c", "0 0 0", "0.4 0 0"),
        "</robot>".to_owned(),
    ]
    .concat()
}

/// One row: time, positions, velocities, torques.
struct Row {
    t: f64,
    q: [f64; JOINTS],
    dq: [f64; JOINTS],
    tau: [f64; JOINTS],
}

/// A motion of the arm at 200 Hz, with the torques of its URDF and some friction.
fn motion() -> Vec<Row> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("r.urdf"), urdf(["a", "b", "c"])).unwrap();
    let text = "[robot]\nmodel = \"serial\"\ndrive_inertia = false\nurdf = \"r.urdf\"\n";
    let file = RobotFile::parse_in("r.toml", text, Some(folder.path())).unwrap();
    let robot = file.robot();
    let standard: Vec<f64> = (file.robot.link.iter())
        .flat_map(|link| link.inertial.as_ref().unwrap().body().standard())
        .collect();
    let theta = robot.base_of(&standard);
    let row = |k: usize| {
        let t = 0.005 * k as f64;
        let wave = |joint: usize, order: i32| -> f64 {
            let of = |(n, size): (f64, f64)| {
                let w = 2.0 * (1.0 + 0.23 * joint as f64) * n;
                let phase = w * t + 0.4 * n + joint as f64;
                size * w.powi(order) * (phase + f64::from(order) * FRAC_PI_2).sin()
            };
            [(1.0, 0.7), (2.0, 0.25), (5.0, 0.06)].map(of).iter().sum()
        };
        let [q, dq, ddq] =
            [0, 1, 2].map(|order| std::array::from_fn::<f64, JOINTS, _>(|j| wave(j, order)));
        let mut tau = [0.0; 3];
        robot.torque(&theta, &q, &dq, &ddq, &mut tau);
        for (j, (tau, dq)) in tau.iter_mut().zip(&dq).enumerate() {
            let noise = ((k * 7919 + j * 104_729) % 1000) as f64 / 1000.0 - 0.5;
            *tau += 3.0 * dq + 2.0 * (40.0 * dq).tanh() + 0.02 * noise;
        }
        Row { t, q, dq, tau }
    };
    (0..ROWS).map(row).collect()
}

/// What a column of a log holds.
#[derive(Clone, Copy, PartialEq)]
enum Held {
    Q,
    QDegrees,
    Dq,
    Tau,
    /// Close to the position, and not measured.
    Wanted,
    /// Anything else that moves.
    Decoy,
}
use Held::*;

impl Held {
    fn of(self, row: &Row, joint: usize) -> f64 {
        match self {
            Q => row.q[joint],
            QDegrees => row.q[joint].to_degrees(),
            Dq => row.dq[joint],
            Tau => row.tau[joint],
            Wanted => row.q[joint] + 0.001,
            Decoy => 0.1 * row.tau[joint] + 0.01,
        }
    }
}

/// A log whose columns are called by these patterns, `{}` for the joint.
fn csv(motion: &[Row], time: &str, patterns: &[(&str, Held)], keys: &[String]) -> String {
    let mut text = time.to_owned();
    for (pattern, _) in patterns {
        for key in keys {
            text += &format!(",{}", pattern.replace("{}", key));
        }
    }
    for row in motion {
        text += &format!("\n{:.4}", row.t);
        for (_, held) in patterns {
            for joint in 0..JOINTS {
                text += &format!(",{}", held.of(row, joint));
            }
        }
    }
    text + "\n"
}

fn command(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("cft-ident").unwrap();
    command.current_dir(folder);
    command
}

/// The document of a run that ends with 0.
fn document(folder: &Path, words: &[&str]) -> Value {
    let done = command(folder)
        .args(words)
        .args(["--json", "-", "-q"])
        .assert()
        .success();
    serde_json::from_slice(&done.get_output().stdout).unwrap()
}

fn columns(found: &Value, key: &str) -> Vec<String> {
    let joints = found["joints"].as_array().unwrap();
    let name = |joint: &Value| joint[key].as_str().unwrap_or("-").to_owned();
    joints.iter().map(name).collect()
}

/// Runs what `new` wrote through the readers: an inspection without an error, and a fit.
fn is_read(folder: &Path, log: &str) {
    let found = document(folder, &["inspect", log, "-r", "mine.toml"]);
    let faults = found["faults"].as_array().unwrap();
    assert!(
        faults.iter().all(|f| f["severity"] != "error"),
        "{faults:?}"
    );
    let fitted = document(folder, &["lsq", log, "-r", "mine.toml", "-o", "model.toml"]);
    for joint in fitted["joints"].as_array().unwrap() {
        let error = joint["relative_error"].as_f64().unwrap();
        assert!(error < 0.05, "{joint}");
    }
}

/// What is asked of every log whose columns have names of their own.
const TORQUE_CHECK: &str = "torques at the joints? no name says it; else torque_is = \"motor\" or \"current\", with torque_scale";

/// What is asked of every log whose angles state no unit.
const ANGLE_CHECK: &str =
    "positions: rad is taken, for no name states a unit; else position_unit = \"deg\" or \"turns\"";

/// Patterns of columns, position and torque that are to be taken first.
const STYLES: &[(&str, &[(&str, Held)])] = &[
    (
        "t",
        &[
            ("q{}", Q),
            ("tau{}", Tau),
            ("q_ref{}", Wanted),
            ("dq{}", Dq),
        ],
    ),
    (
        "time",
        &[
            ("positions_{}", Q),
            ("efforts_{}", Tau),
            ("velocities_{}", Dq),
        ],
    ),
    (
        "timestamp",
        &[
            ("actual_q_{}", Q),
            ("actual_torque_{}", Tau),
            ("target_q_{}", Wanted),
            ("target_qd_{}", Dq),
            ("actual_qd_{}", Dq),
            ("actual_current_{}", Decoy),
            ("target_moment_{}", Decoy),
        ],
    ),
    (
        "t",
        &[
            ("joint_{}_position", Q),
            ("joint_{}_torque", Tau),
            ("joint_{}_velocity", Dq),
            ("joint_{}_temperature", Decoy),
        ],
    ),
    (
        "time",
        &[
            ("act_pos_mot_deg_{}", QDegrees),
            ("act_torque_abs_nm_{}", Tau),
            ("act_pos_se_deg_{}", QDegrees),
            ("act_torque_rel_nm_{}", Decoy),
            ("ref_pos_deg_{}", QDegrees),
        ],
    ),
    (
        "Time [s]",
        &[
            ("position[{}]", Q),
            ("effort[{}]", Tau),
            ("velocity[{}]", Dq),
        ],
    ),
    (
        "time",
        &[("JointPos{}", Q), ("JointTrq{}", Tau), ("JointVel{}", Dq)],
    ),
    (
        "__time",
        &[
            ("/joint_states/position.{}", Q),
            ("/joint_states/effort.{}", Tau),
            ("/joint_states/velocity.{}", Dq),
        ],
    ),
    (
        "t",
        &[
            ("J{}_pos [deg]", QDegrees),
            ("J{}_trq [Nm]", Tau),
            ("J{}_cur [A]", Decoy),
        ],
    ),
    (
        "t",
        &[
            ("q_meas_{}", Q),
            ("tau_meas_{}", Tau),
            ("q_des_{}", Wanted),
            ("tau_des_{}", Decoy),
            ("tracking_error_{}", Decoy),
        ],
    ),
    (
        "time",
        &[
            ("q_{}", Q),
            ("tau_J_{}", Tau),
            ("q_d_{}", Wanted),
            ("tau_J_d_{}", Decoy),
            ("tau_ext_hat_filtered_{}", Decoy),
            ("dq_{}", Dq),
        ],
    ),
    (
        "t",
        &[
            ("follower_pos_{}", Q),
            ("follower_effort_{}", Tau),
            ("leader_pos_{}", Wanted),
            ("leader_effort_{}", Decoy),
        ],
    ),
    (
        "stamp",
        &[
            ("axis{}.angle", Q),
            ("axis{}.torque", Tau),
            ("axis{}.speed", Dq),
        ],
    ),
    (
        "t",
        &[("theta_{}", Q), ("torque_{}", Tau), ("theta_dot_{}", Dq)],
    ),
    (
        "time_s",
        &[
            ("joint{}/q", Q),
            ("joint{}/tau", Tau),
            ("joint{}/tau_cmd", Decoy),
        ],
    ),
];

#[test]
fn names_in_fifteen_styles_from_0_and_from_1_are_mapped_and_read() {
    let motion = motion();
    for (style, (time, patterns)) in STYLES.iter().enumerate() {
        for base in [0, 1] {
            let folder = tempfile::tempdir().unwrap();
            let arm = urdf(["joint_1", "joint_2", "joint_3"]);
            std::fs::write(folder.path().join("arm.urdf"), arm).unwrap();
            let keys: Vec<String> = (base..base + JOINTS).map(|n| n.to_string()).collect();
            // the columns of commands and the like stand first
            let mut written = patterns.to_vec();
            written.reverse();
            let text = csv(&motion, time, &written, &keys);
            std::fs::write(folder.path().join("log.csv"), text).unwrap();
            let wanted = |pattern: &str| -> Vec<String> {
                keys.iter().map(|key| pattern.replace("{}", key)).collect()
            };
            let call = "new mine --urdf arm.urdf --log log.csv";
            let words: Vec<&str> = call.split(' ').collect();
            let found = document(folder.path(), &words);
            let place = format!("{patterns:?}", patterns = patterns[0].0);
            assert_eq!(columns(&found, "joint"), ["joint_1", "joint_2", "joint_3"]);
            assert_eq!(
                columns(&found, "position"),
                wanted(patterns[0].0),
                "{place}"
            );
            assert_eq!(columns(&found, "torque"), wanted(patterns[1].0), "{place}");
            let states = patterns[0].0.contains("deg");
            let asked = match states {
                true => serde_json::json!([TORQUE_CHECK]),
                false => serde_json::json!([ANGLE_CHECK, TORQUE_CHECK]),
            };
            assert_eq!(found["checks"], asked, "{place}");
            // a fit of each style once
            if base == style % 2 {
                is_read(folder.path(), "log.csv");
            }
            // without a URDF there are as many joints, and rows to be filled in
            let found = document(folder.path(), &["new", "rows", "--log", "log.csv"]);
            assert_eq!(
                columns(&found, "position"),
                wanted(patterns[0].0),
                "{place}"
            );
            assert_eq!(columns(&found, "torque"), wanted(patterns[1].0), "{place}");
            let numbered: Vec<String> = keys.iter().map(|key| format!("q{key}")).collect();
            assert_eq!(columns(&found, "joint"), numbered, "{place}");
        }
    }
}

#[test]
fn rows_to_be_filled_in_are_the_next_step_and_not_a_fit() {
    let folder = tempfile::tempdir().unwrap();
    let keys = ["0", "1", "2"].map(str::to_owned);
    let text = csv(
        &motion(),
        "t",
        &[("positions_{}", Q), ("efforts_{}", Tau)],
        &keys,
    );
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    command(folder.path())
        .args(["new", "mine", "--log", "log.csv"])
        .assert()
        .success()
        .stdout(contains("next: fill in").and(contains("lsq").not()));
    for name in [
        "lsq log.csv -r mine.toml -o m.toml",
        "inspect log.csv -r mine.toml",
    ] {
        command(folder.path())
            .args(name.split(' '))
            .assert()
            .code(3)
            .stderr(contains("is not filled in yet"));
    }
    // filled in, it fits
    let path = folder.path().join("mine.toml");
    let stub = std::fs::read_to_string(&path).unwrap();
    let mut parts = stub.split("[[robot.link]]\n");
    let mut text = parts.next().unwrap().to_owned();
    for (part, row) in parts.zip([
        ["0.0", "0.0", "0.3", "0.0"],
        ["0.0", "1.5708", "0.0", "0.0"],
        ["0.4", "0.0", "0.0", "0.0"],
    ]) {
        let mut part = part.to_owned();
        for (key, value) in ["a", "alpha", "d", "theta"].iter().zip(row) {
            part = part.replace(&format!("\n{key} = nan"), &format!("\n{key} = {value}"));
        }
        text += &format!("[[robot.link]]\n{part}");
    }
    std::fs::write(&path, text).unwrap();
    is_read(folder.path(), "log.csv");
}

#[test]
fn joints_with_names_are_found_by_them_in_any_order() {
    let motion = motion();
    let folder = tempfile::tempdir().unwrap();
    let arm = urdf(["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"]);
    std::fs::write(folder.path().join("arm.urdf"), arm).unwrap();
    let whole = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"];
    let short = ["shoulder_pan", "shoulder_lift", "elbow"];
    for (keys, patterns) in [
        (
            whole,
            [
                ("joint_states.{}.position", Q),
                ("joint_states.{}.effort", Tau),
            ],
        ),
        (whole, [("position[{}]", Q), ("effort[{}]", Tau)]),
        (short, [("{}_q", Q), ("{}_torque", Tau)]),
        (short, [("pos {}", Q), ("trq {}", Tau)]),
    ] {
        let keys = keys.map(str::to_owned);
        let text = csv(&motion, "t", &patterns, &keys);
        std::fs::write(folder.path().join("log.csv"), text).unwrap();
        let _ = std::fs::remove_file(folder.path().join("mine.toml"));
        let call = "new mine --urdf arm.urdf --log log.csv";
        let found = document(folder.path(), &call.split(' ').collect::<Vec<_>>());
        let wanted: Vec<String> = keys
            .iter()
            .map(|key| patterns[1].0.replace("{}", key))
            .collect();
        assert_eq!(columns(&found, "torque"), wanted);
        assert_eq!(
            found["checks"],
            serde_json::json!([ANGLE_CHECK, TORQUE_CHECK]),
            "{wanted:?}"
        );
        is_read(folder.path(), "log.csv");
    }
}

#[test]
fn a_family_that_does_not_fit_is_to_be_checked() {
    let motion = motion();
    let folder = tempfile::tempdir().unwrap();
    let arm = urdf(["joint_1", "joint_2", "joint_3"]);
    std::fs::write(folder.path().join("arm.urdf"), arm).unwrap();
    // four positions for three joints: it may begin with either
    let mut text = csv(
        &motion,
        "t",
        &[("q{}", Q), ("tau{}", Tau)],
        &["0", "1", "2"].map(str::to_owned),
    );
    text = text
        .lines()
        .enumerate()
        .map(|(k, line)| {
            format!(
                "{line},{}\n",
                if k == 0 {
                    "q3".to_owned()
                } else {
                    format!("{}", (0.01 * k as f64).sin())
                }
            )
        })
        .collect();
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    command(folder.path())
        .args(["new", "mine", "--urdf", "arm.urdf", "--log", "log.csv"])
        .assert()
        .success()
        .stdout(
            contains("CHECK IT: positions: q# does not fit the 3 joints")
                .and(contains("next: look at the lines with CHECK IT")),
        );
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    assert!(text.contains("# CHECK IT: positions"), "{text}");
    RobotFile::load(&folder.path().join("mine.toml")).unwrap();
}

/// The columns of a log without names.
fn bare(motion: &[Row], parts: &[Held], time: bool) -> String {
    let mut text = String::new();
    for row in motion {
        let mut fields: Vec<String> = Vec::new();
        if time {
            fields.push(format!("{:.4}", row.t));
        }
        for part in parts {
            fields.extend((0..JOINTS).map(|j| format!("{:.9}", part.of(row, j))));
        }
        text += &format!("{}\n", fields.join(","));
    }
    text
}

#[test]
fn files_without_a_header_or_times_are_described_by_what_they_hold() {
    let motion = motion();
    for (parts, time, position, torque) in [
        (&[Q, Dq, Tau][..], true, 2, 8),
        (&[Q, Tau][..], true, 2, 5),
        (&[Q, Dq, Tau][..], false, 1, 7),
        (&[Q, Tau][..], false, 1, 4),
    ] {
        for with_urdf in [true, false] {
            let folder = tempfile::tempdir().unwrap();
            let arm = urdf(["joint_1", "joint_2", "joint_3"]);
            std::fs::write(folder.path().join("arm.urdf"), arm).unwrap();
            std::fs::write(folder.path().join("log.txt"), bare(&motion, parts, time)).unwrap();
            let mut words = vec!["new", "mine", "--log", "log.txt"];
            if with_urdf {
                words.extend(["--urdf", "arm.urdf"]);
            }
            if !time {
                command(folder.path())
                    .args(&words)
                    .assert()
                    .code(3)
                    .stderr(contains("no column is a time").and(contains("--rate HZ")));
                words.extend(["--rate", "200"]);
            }
            let found = document(folder.path(), &words);
            let numbered = |from: usize| -> Vec<String> {
                (from..from + JOINTS).map(|n| format!("#{n}")).collect()
            };
            assert_eq!(columns(&found, "position"), numbered(position), "{words:?}");
            assert_eq!(columns(&found, "torque"), numbered(torque), "{words:?}");
            assert!(!found["checks"].as_array().unwrap().is_empty());
            assert!((found["rate_hz"].as_f64().unwrap() - 200.0).abs() < 0.1);
            if with_urdf {
                is_read(folder.path(), "log.txt");
            }
        }
    }
    // a log with names and without times
    let folder = tempfile::tempdir().unwrap();
    let arm = urdf(["joint_1", "joint_2", "joint_3"]);
    std::fs::write(folder.path().join("arm.urdf"), arm).unwrap();
    let keys = ["1", "2", "3"].map(str::to_owned);
    let text = csv(&motion, "t", &[("q{}", Q), ("tau{}", Tau)], &keys);
    let cut = |line: &str| format!("{}\n", line.split_once(',').unwrap().1);
    let text: String = text.lines().map(cut).collect();
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    let call = "new mine --urdf arm.urdf --log log.csv --rate 200";
    let found = document(folder.path(), &call.split(' ').collect::<Vec<_>>());
    assert_eq!(
        found["checks"],
        serde_json::json!([ANGLE_CHECK, TORQUE_CHECK])
    );
    is_read(folder.path(), "log.csv");
}

#[test]
fn units_are_guessed_by_size_and_marked() {
    let motion = motion();
    let folder = tempfile::tempdir().unwrap();
    let arm = urdf(["joint_1", "joint_2", "joint_3"]);
    std::fs::write(folder.path().join("arm.urdf"), arm).unwrap();
    let keys = ["1", "2", "3"].map(str::to_owned);
    let text = csv(&motion, "t", &[("q{}", QDegrees), ("tau{}", Tau)], &keys);
    let milli: String = text
        .lines()
        .enumerate()
        .map(|(k, line)| {
            let fields = line.split(',').enumerate().map(|(n, field)| match (k, n) {
                (0, _) | (_, 0..4) => field.to_owned(),
                _ => format!("{}", 1000.0 * field.parse::<f64>().unwrap()),
            });
            fields.collect::<Vec<_>>().join(",") + "\n"
        })
        .collect();
    std::fs::write(folder.path().join("log.csv"), milli).unwrap();
    let call = "new mine --urdf arm.urdf --log log.csv";
    let found = document(folder.path(), &call.split(' ').collect::<Vec<_>>());
    let checks = found["checks"].to_string();
    assert!(
        checks.contains("deg is guessed") && checks.contains("mNm is guessed"),
        "{checks}"
    );
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    assert!(
        text.contains("position_unit = \"deg\"") && text.contains("torque_scale = 0.001"),
        "{text}"
    );
    is_read(folder.path(), "log.csv");
}

#[test]
fn an_encoder_that_begins_anew_gets_its_range() {
    let mut motion = motion();
    for row in &mut motion {
        row.q[1] = (row.q[1] + 3.0).rem_euclid(std::f64::consts::TAU);
    }
    let folder = tempfile::tempdir().unwrap();
    let arm = urdf(["joint_1", "joint_2", "joint_3"]);
    std::fs::write(folder.path().join("arm.urdf"), arm).unwrap();
    let keys = ["1", "2", "3"].map(str::to_owned);
    // it goes through the end of its turn
    for row in &mut motion {
        row.q[1] = (row.q[1] + 2.5).rem_euclid(std::f64::consts::TAU);
    }
    let text = csv(&motion, "t", &[("q{}", Q), ("tau{}", Tau)], &keys);
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    let call = "new mine --urdf arm.urdf --log log.csv";
    document(folder.path(), &call.split(' ').collect::<Vec<_>>());
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    let line = text
        .lines()
        .find(|line| line.starts_with("joint_2"))
        .unwrap();
    assert!(line.contains("wrap = 6.28318"), "{text}");
}

#[test]
fn decimal_commas_are_refused_by_every_command_that_looks_at_a_log() {
    let motion = motion();
    let folder = tempfile::tempdir().unwrap();
    let keys = ["1", "2", "3"].map(str::to_owned);
    let text = csv(&motion, "t", &[("q{}", Q), ("tau{}", Tau)], &keys);
    let text = text.replace(',', ";").replace('.', ",");
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    for line in [
        "convert log.csv out.csv",
        "inspect log.csv",
        "new mine --log log.csv",
    ] {
        command(folder.path())
            .args(line.split(' '))
            .assert()
            .code(3)
            .stderr(contains("decimal points instead of decimal commas"));
    }
    assert!(!folder.path().join("out.csv").exists());
    assert!(!folder.path().join("mine.toml").exists());
}

#[test]
fn convert_loses_no_rows_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = "t,q_a,tau_a\n".to_owned();
    for k in 0..200 {
        let time = if k % 50 == 7 {
            String::new()
        } else {
            format!("{}", 0.01 * f64::from(k))
        };
        text += &format!("{time},{k},{k}\n");
    }
    std::fs::write(folder.path().join("holes.csv"), &text).unwrap();
    std::fs::write(
        folder.path().join("short.csv"),
        text.replace(",100,100", ",100").replace("\n,", "\n9,"),
    )
    .unwrap();
    for (log, rows) in [("holes.csv", 196), ("short.csv", 199)] {
        command(folder.path())
            .args(["convert", log, "out.csv"])
            .assert()
            .code(3)
            .stderr(contains("--drop-rows"));
        assert!(!folder.path().join("out.csv").exists());
        if log == "holes.csv" {
            let found = document(folder.path(), &["convert", log, "out.csv", "--drop-rows"]);
            assert_eq!(found["samples"], rows);
            std::fs::remove_file(folder.path().join("out.csv")).unwrap();
        }
    }
}

/// A recording of a leader, a follower, a hand and a command, each at instants of its own.
fn four_topics(path: &Path, motion: &[Row]) {
    let mut recording = Recording::create(path, mcap::WriteOptions::default());
    let names = |prefix: &str| (1..=JOINTS).map(|n| format!("{prefix}joint_{n}")).collect();
    for (k, row) in motion.iter().enumerate() {
        let at = |shift: u64| 1_700_000_000_000_000_000 + 5_000_000 * k as u64 + shift;
        let state = |shift, prefix: &str, q: [f64; 3], tau: &[f64]| JointState {
            stamp_ns: at(shift),
            names: names(prefix),
            q: q.to_vec(),
            tau: tau.to_vec(),
            ..JointState::default()
        };
        let leader = state(0, "", row.q.map(|q| q + 0.01), &row.tau.map(|x| 0.1 * x));
        recording.joint_state("/leader/joint_states", at(0), &leader);
        let follower = state(1_300_000, "", row.q, &row.tau);
        recording.joint_state("/follower/joint_states", at(1_300_000), &follower);
        let hand = state(2_700_000, "finger_", row.dq, &[]);
        recording.joint_state("/hand/joint_states", at(2_700_000), &hand);
        let command = state(4_100_000, "", row.q.map(|q| q + 0.02), &row.tau);
        recording.joint_state("/joint_command", at(4_100_000), &command);
    }
    recording.finish();
}

#[test]
fn of_four_topics_each_is_looked_at_alone_and_the_followers_is_the_robot() {
    let motion = motion();
    let folder = tempfile::tempdir().unwrap();
    let arm = urdf(["joint_1", "joint_2", "joint_3"]);
    std::fs::write(folder.path().join("arm.urdf"), arm).unwrap();
    four_topics(&folder.path().join("log.mcap"), &motion);
    let found = document(folder.path(), &["inspect", "log.mcap"]);
    let logs = found["logs"].as_array().unwrap();
    assert_eq!(logs.len(), 4);
    for log in logs {
        assert!(
            (log["rate_hz"].as_f64().unwrap() - 200.0).abs() < 0.1,
            "{log}"
        );
        assert_eq!(log["gaps"], Value::Array(Vec::new()));
    }
    // convert asks for one, and writes that
    command(folder.path())
        .args(["convert", "log.mcap", "out.csv"])
        .assert()
        .code(3)
        .stderr(
            contains("4 topics")
                .and(contains("--topic"))
                .and(contains("/hand/joint_states")),
        );
    let call = "convert log.mcap out.csv --topic /follower/joint_states";
    let found = document(folder.path(), &call.split(' ').collect::<Vec<_>>());
    let wanted = [
        "t",
        "q_joint_1",
        "q_joint_2",
        "q_joint_3",
        "tau_joint_1",
        "tau_joint_2",
        "tau_joint_3",
    ];
    assert_eq!(
        found["columns"]
            .as_array()
            .unwrap()
            .iter()
            .map(|c| c.as_str().unwrap())
            .collect::<Vec<_>>(),
        wanted
    );
    assert_eq!(found["samples"], ROWS);
    let call = "convert log.mcap b.csv --topic /folower/joint_states";
    command(folder.path())
        .args(call.split(' '))
        .assert()
        .code(3)
        .stderr(contains("did you mean `/follower/joint_states`?"));
    // new takes the one that was measured and drives
    let call = "new mine --urdf arm.urdf --log log.mcap";
    let found = document(folder.path(), &call.split(' ').collect::<Vec<_>>());
    assert_eq!(found["topic"], "/follower/joint_states");
    is_read(folder.path(), "log.mcap");
    // and asks where two are alike, unless one is named
    let path = folder.path().join("two.mcap");
    let mut recording = Recording::create(&path, mcap::WriteOptions::default());
    for (k, row) in motion.iter().enumerate() {
        for (side, shift) in [("left", 0), ("right", 1_000_000)] {
            let at = 1_700_000_000_000_000_000 + 5_000_000 * k as u64 + shift;
            let state = JointState {
                stamp_ns: at,
                names: (1..=JOINTS).map(|n| format!("{side}_{n}")).collect(),
                q: row.q.to_vec(),
                tau: row.tau.to_vec(),
                ..JointState::default()
            };
            recording.joint_state(&format!("/{side}/joint_states"), at, &state);
        }
    }
    recording.finish();
    command(folder.path())
        .args(["new", "two", "--urdf", "arm.urdf", "--log", "two.mcap"])
        .assert()
        .code(3)
        .stderr(contains("--topic NAME").and(contains("/left/joint_states, /right/joint_states")));
    let _ = std::fs::remove_file(folder.path().join("mine.toml"));
    let call = "new mine --urdf arm.urdf --log two.mcap --topic /right/joint_states";
    document(folder.path(), &call.split(' ').collect::<Vec<_>>());
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    assert!(text.contains("joint_1 = { name = \"right_1\" }"), "{text}");
    is_read(folder.path(), "two.mcap");
}

#[test]
fn the_heavy_arm_and_the_pendulum_are_mapped_by_number() {
    let shared = |name: &str| log_support::shared(name);
    let (Some(urdf), Some(log)) = (shared("kr300/kr300.urdf"), shared("kr300/A.csv")) else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let (urdf, log) = (urdf.canonicalize().unwrap(), log.canonicalize().unwrap());
    let call = [
        "new",
        "mine",
        "--urdf",
        urdf.to_str().unwrap(),
        "--log",
        log.to_str().unwrap(),
    ];
    let found = document(folder.path(), &call);
    assert_eq!(columns(&found, "position")[5], "act_pos_mot_deg_6");
    assert_eq!(columns(&found, "torque")[0], "act_torque_abs_nm_1");
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    assert!(text.contains("position_unit = \"deg\""), "{text}");
    let (Some(urdf), Some(log)) = (
        shared("pendulum/double_pendulum.urdf"),
        shared("pendulum/055032.csv"),
    ) else {
        return;
    };
    let (urdf, log) = (urdf.canonicalize().unwrap(), log.canonicalize().unwrap());
    let call = [
        "new",
        "two",
        "--urdf",
        urdf.to_str().unwrap(),
        "--log",
        log.to_str().unwrap(),
    ];
    let found = document(folder.path(), &call);
    assert_eq!(columns(&found, "position"), ["pos1", "pos2"]);
    assert_eq!(columns(&found, "torque"), ["tau1", "tau2"]);
    assert_eq!(
        found["checks"],
        serde_json::json!([ANGLE_CHECK, TORQUE_CHECK])
    );
}
