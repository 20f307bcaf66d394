//! `new` for logs as people write them: names of columns in many styles, no header, no times, several
//! machines in one recording, decimal commas. What it writes, its own readers accept.

mod bare;

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
            // two families that may be the torques
            let either = match patterns[1].0 {
                "actual_torque_{}" => Some("torques: actual_torque_# or actual_current_#?"),
                "J{}_trq [Nm]" => Some("torques: j#trq or j#cur?"),
                "act_torque_abs_nm_{}" => Some("torques: act_torque_abs# or act_torque_rel#?"),
                _ => None,
            };
            let mut asked = Vec::from_iter(either);
            asked.extend((!states).then_some(ANGLE_CHECK));
            asked.push(TORQUE_CHECK);
            assert_eq!(found["checks"], serde_json::json!(asked), "{place}");
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
