//! What no name says: logs without a header or times, units by size, rows that would be lost, four topics.

use super::*;

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
fn decimal_commas_are_read_where_other_signs_part_the_fields() {
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
            .success();
    }
    let out = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    assert!(out.lines().count() > 1000 && out.contains('.'));
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

/// One joint at 100 Hz; `stamp` writes the time of a row.
fn one_joint(header: &str, torque: &dyn Fn(f64) -> f64, stamp: &dyn Fn(usize) -> String) -> String {
    let row = |k: usize| {
        let t = 0.01 * k as f64;
        let q = (0.9 * t).sin() + 0.4 * (2.3 * t).sin();
        format!("{},{q:.6},{}\n", stamp(k), torque(t))
    };
    let rows: String = (0..2000).map(row).collect();
    format!("{header}\n{rows}")
}

fn smooth(t: f64) -> f64 {
    (3.0 * (1.1 * t).sin() * 1e4).round() / 1e4
}

#[test]
fn times_without_a_name_are_found_by_every_command_alike() {
    let numbers = |k: usize| format!("{:.3}", 5.0 + 0.01 * k as f64);
    let dates = |k: usize| {
        let (s, ms) = (k / 100, 10 * (k % 100));
        format!("2026-01-02T03:04:{:02}.{ms:03}", s % 60)
    };
    let days = |k: usize| format!("{:.12}", 739_740.395_833 + 0.01 * k as f64 / 86_400.0);
    for (header, stamp) in [
        (",q,tau", &numbers as &dyn Fn(usize) -> String),
        (",q,tau", &dates),
        ("log.t,log.q,log.tau", &numbers),
        ("timestamps,q,tau", &numbers),
        ("datenum,q,tau", &days),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let text = one_joint(header, &smooth, stamp);
        std::fs::write(folder.path().join("log.csv"), text).unwrap();
        for words in [
            "inspect log.csv",
            "convert log.csv out.csv",
            "new x --log log.csv",
        ] {
            let found = document(folder.path(), &words.split(' ').collect::<Vec<_>>());
            if !words.starts_with("convert") {
                let rate = found["rate_hz"].as_f64().unwrap();
                assert!((rate / 100.0 - 1.0).abs() < 1e-3, "{header}: {rate}");
            }
        }
    }
}

#[test]
fn a_clock_that_no_recorder_has_is_refused_at_once_with_the_unit_to_write() {
    let folder = tempfile::tempdir().unwrap();
    let hours = |k: usize| format!("{:.12}", 0.01 * k as f64 / 3600.0);
    let text = one_joint("t,q,tau", &smooth, &hours);
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    for words in ["inspect log.csv", "new x --log log.csv"] {
        command(folder.path())
            .args(words.split(' '))
            .assert()
            .code(3)
            .stderr(contains("no recorder is that fast").and(contains("time_unit = \"h\"")));
    }
}

#[test]
fn signed_words_that_are_logged_as_unsigned_get_the_line_that_reads_them() {
    let word = |t: f64| (150.0 * (1.1 * t).sin()).round().rem_euclid(65_536.0);
    let neighbour = |t: f64| 655_360.0 + word(t);
    let stamp = |k: usize| format!("{:.3}", 0.01 * k as f64);
    for torque in [&word as &dyn Fn(f64) -> f64, &neighbour] {
        let folder = tempfile::tempdir().unwrap();
        let text = one_joint("time,position,torque", torque, &stamp);
        std::fs::write(folder.path().join("log.csv"), text).unwrap();
        let found = document(folder.path(), &["new", "x", "--log", "log.csv"]);
        let robot = std::fs::read_to_string(folder.path().join("x.toml")).unwrap();
        assert!(robot.contains("torque_wrap = 65536.0"), "{robot}");
        let faults = found["faults"].to_string();
        assert!(!faults.contains("unsigned"), "{faults}");
        let without = robot.replace(", torque_wrap = 65536.0", "");
        std::fs::write(folder.path().join("x.toml"), without).unwrap();
        for words in [
            "lsq log.csv -r x.toml -o m.toml",
            "identify log.csv x.toml -o run",
        ] {
            command(folder.path())
                .args(words.split(' '))
                .assert()
                .code(3)
                .stderr(contains("leaps by 65536").and(contains("torque_wrap = 65536")));
        }
    }
}

#[test]
fn runs_of_one_table_are_parted_and_no_row_is_lost_between_them() {
    let folder = tempfile::tempdir().unwrap();
    let stamp = |k: usize| format!("{},{:.3}", k / 500, 0.01 * (k % 500) as f64);
    let text = one_joint("episode,time,position,torque", &smooth, &stamp);
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    let found = document(folder.path(), &["inspect", "log.csv"]);
    assert_eq!(found["gaps"], serde_json::json!([]));
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains("4 runs of 2000 rows"), "{warnings}");
}
