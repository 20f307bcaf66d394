//! Recordings written message by message: raw channels, clocks of their own, any order and any
//! container, databases of recorders that were killed.

use crate::log_support;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use cft_ident_core::robot::cft::actuation::ENCODER_SCALE;
use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{Block, DeclaredChannels, Layout, LogSpec, Reader};
use log_support::recording::{JointState, Recording};
use log_support::{finite, fixture, read, says};
use mcap::{Compression, WriteOptions};
use proptest::prelude::*;
use tempfile::TempDir;

const EPOCH_NS: u64 = 1_700_000_000_000_000_000;

fn robot(log: &str) -> RobotFile {
    let head = "[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\n";
    RobotFile::parse("r.toml", &format!("{head}{log}")).unwrap()
}

fn one_joint(log: &str) -> Layout {
    let head = "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"revolute\"\n";
    RobotFile::parse("r.toml", &format!("{head}{log}"))
        .unwrap()
        .layout()
}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn shown(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// The error with which reading ends.
#[track_caller]
fn refused(path: &Path, layout: &Layout) -> String {
    let outcome = Reader::open(&LogSpec::whole(path), layout).and_then(|mut reader| {
        let mut block = Block::default();
        while reader.read(&mut block)? {}
        Ok(())
    });
    outcome.unwrap_err().to_string()
}

#[test]
fn raw_channels_of_the_cft_robot_are_read_from_text_json_and_joint_states_alike() {
    let folder = tempfile::tempdir().unwrap();
    let files = ["raw.csv", "raw.mcap", "states.mcap"].map(|name| folder.path().join(name));
    let counts = robot(
        "[log.actuator.x_c1]\nposition_unit = \"counts\"\nhome = -0.13\n[log.actuator.x_c3]\nposition_unit = \"counts\"\nposition_sign = -1\nhome = 2.4\n[log.actuator.x_c4]\nvolts_sign = -1\n",
    );
    let mut text = String::from("t,x_c1,x_c2,x_c3,x_c4,u_1,u_2,u_3,u_4\n");
    let mut json = Recording::create(&files[1], WriteOptions::new());
    let mut states = Recording::create(&files[2], WriteOptions::new());
    for k in 0..50_u64 {
        let x = [
            k as f64 * 10.0,
            0.27 + k as f64 * 1e-4,
            1000.0 - 3.0 * k as f64,
            0.05,
        ];
        let u = [0.1, -0.2, 0.03 * k as f64, 1.5];
        let numbers: Vec<String> = x.iter().chain(&u).map(f64::to_string).collect();
        text.push_str(&format!("{},{}\n", k as f64 / 500.0, numbers.join(",")));
        let names = text.lines().next().unwrap().split(',').skip(1);
        let fields: Vec<String> = names
            .zip(&numbers)
            .map(|(name, number)| format!("\"{name}\": {number}"))
            .collect();
        let ns = EPOCH_NS + k * 2_000_000;
        json.json("/raw", ns, &format!("{{{}}}", fields.join(", ")));
        let state = JointState {
            stamp_ns: ns,
            names: owned(&["x_c1", "x_c2", "x_c3", "x_c4"]),
            q: x.to_vec(),
            tau: u.to_vec(),
            ..JointState::default()
        };
        states.joint_state("/raw", ns, &state);
    }
    std::fs::write(&files[0], text).unwrap();
    json.finish();
    states.finish();
    let (expected, _) = read(&shown(&files[0]), &counts.layout());
    assert_eq!((expected.len(), expected.joints()), (50, 4));
    // Table 5 and eq. (57) at the first row, where x_c1 stands at its home.
    let x3 = 2.4 - 1000.0 * ENCODER_SCALE[2];
    let first = cft_ident_core::robot::cft::pantograph::joints(&[-0.13, 0.27, x3, 0.05]).unwrap();
    assert_eq!(expected.q[..4], first);
    for file in &files {
        let (found, reader) = read(&shown(file), &counts.layout());
        assert_eq!(reader.layout().channels, DeclaredChannels::Actuator);
        assert_eq!((&found.q, &found.tau), (&expected.q, &expected.tau));
        assert_eq!(found.t, expected.t);
        assert_eq!(reader.warnings(), [""; 0]);
    }
}

/// Positions at 250 Hz and torques at 400 Hz on topics of their own, the torques late by `delay`.
fn two_clocks(folder: &TempDir, delay: f64) -> PathBuf {
    let path = folder.path().join("two.mcap");
    let mut recording = Recording::create(&path, WriteOptions::new());
    let q = |t: f64| 0.8 * (1.7 * t).sin() + 0.3 * (4.1 * t).sin();
    let v = |t: f64| 1.36 * (1.7 * t).cos() + 1.23 * (4.1 * t).cos();
    let a = |t: f64| -2.312 * (1.7 * t).sin() - 5.043 * (4.1 * t).sin();
    let mut events: Vec<(u64, bool)> = (0..5000).map(|k| (k * 4_000_000, true)).collect();
    events.extend((0..8000).map(|k| (k * 2_500_000 + 1_000_000, false)));
    events.sort_unstable();
    for (ns, positions) in events {
        let t = ns as f64 * 1e-9;
        let mut state = JointState {
            stamp_ns: EPOCH_NS + ns,
            names: owned(&["q1"]),
            ..JointState::default()
        };
        if positions {
            state.q = vec![q(t)];
            recording.joint_state("/encoders", EPOCH_NS + ns, &state);
        } else {
            let s = t - delay;
            state.tau = vec![2.0 * a(s) + 0.7 * v(s) + 1.5 * (20.0 * v(s)).tanh()];
            recording.joint_state("/drives", EPOCH_NS + ns, &state);
        }
    }
    recording.finish();
    path
}

/// The delay [ms] that a reader says.
#[track_caller]
fn reported_delay(reader: &Reader) -> f64 {
    let warnings = reader.warnings();
    let described = warnings.iter().find(|text| text.contains("/drives lags"));
    let described = described.unwrap_or_else(|| panic!("{warnings:?}"));
    let number = described.split(" by ").nth(1).unwrap();
    number.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn the_delay_between_two_topics_is_reported_and_taken_off_only_where_the_robot_file_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_clocks(&folder, 0.0131);
    let (late, reader) = read(&shown(&path), &one_joint(""));
    assert_eq!(late.len(), 4999);
    assert!(
        (reported_delay(&reader) - 13.1).abs() <= 0.2,
        "{:?}",
        reader.warnings()
    );
    let words = [
        "/encoders",
        "standard deviation",
        "not removed",
        "`torque_delay_s`",
    ];
    says(&reader.warnings().join("\n"), &words);
    let (aligned, reader) = read(
        &shown(&path),
        &one_joint(
            "[log]\ntorque_is = \"joint\"\ntorque_topic = \"/drives\"\ntorque_delay_s = 0.0131\n",
        ),
    );
    assert!(
        reported_delay(&reader).abs() <= 0.2,
        "{:?}",
        reader.warnings()
    );
    says(
        &reader.warnings().join("\n"),
        &["13.1 ms are taken off already"],
    );
    // The same torques, 13.1 ms earlier. Without the shift, no torque is known at the first position.
    assert_eq!(late.q[..3], aligned.q[1..4]);
    for row in [1000, 2000, 3000] {
        let slope = (late.tau[row + 1] - late.tau[row - 1]) / 0.008;
        let change = aligned.tau[row + 1] - late.tau[row];
        let curved = 0.1 * change.abs() + 1e-2;
        assert!((change - 0.0131 * slope).abs() < curved, "{row}: {change}");
    }
}

#[test]
fn the_effort_of_a_foreign_recording_is_not_guessed_to_be_a_torque() {
    for log in [
        "[log.joint.q1]\nname = \"arm/elbow\"\n",
        "[log]\ntorque_topic = \"/efforts\"\n",
    ] {
        let head = "[robot]\nmodel = \"single-joint\"\njoint = \"q1\"\nkind = \"revolute\"\n";
        let refused = RobotFile::parse("r.toml", &format!("{head}{log}")).unwrap_err();
        says(&refused.to_string(), &["torque_is", "effort"]);
    }
}

#[test]
fn a_clock_that_runs_backwards_names_the_message_and_the_other_clock() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mcap");
    let mut recording = Recording::create(&path, WriteOptions::new());
    for (k, stamp) in [0, 10, 20, 15, 40].into_iter().enumerate() {
        let state = JointState {
            stamp_ns: EPOCH_NS + stamp * 1_000_000,
            names: owned(&["q1"]),
            q: vec![k as f64],
            tau: vec![1.0],
            ..JointState::default()
        };
        recording.joint_state("/joint_states", EPOCH_NS + 10_000_000 * k as u64, &state);
    }
    recording.finish();
    let words = [
        "message 4",
        "/joint_states",
        "from 0.02 s to 0.015 s",
        "`stamp = \"log\"`",
        "FILE@0..0.02s",
    ];
    says(&refused(&path, &one_joint("")), &words);
    let (block, _) = read(&shown(&path), &one_joint("[log]\nstamp = \"log\"\n"));
    assert_eq!(block.t, [0.0, 0.01, 0.02, 0.03, 0.04]);
    let (block, _) = read(&format!("{}@0..0.02s", path.display()), &one_joint(""));
    assert_eq!(block.t, [0.0, 0.01]);
}

#[test]
fn a_message_whose_number_is_none_is_left_out_and_reported_and_a_recording_of_none_else_is_refused()
{
    let folder = tempfile::tempdir().unwrap();
    let recorded = |name: &str, count: u64, none: &dyn Fn(u64) -> bool| {
        let path = folder.path().join(name);
        let mut recording = Recording::create(&path, WriteOptions::new());
        for k in 0..count {
            let state = JointState {
                stamp_ns: k * 1_000_000,
                names: owned(&["q1"]),
                q: vec![if none(k) { f64::NAN } else { 1.0 }],
                tau: vec![1.0],
                ..JointState::default()
            };
            recording.joint_state("/joint_states", k, &state);
        }
        recording.finish();
        path
    };
    let path = recorded("log.mcap", 5, &|k| k == 3);
    let (block, reader) = read(&shown(&path), &one_joint(""));
    assert_eq!(block.t, [0.0, 1e-3, 2e-3, 4e-3]);
    let words = [
        "1 of 5 messages",
        "message 4",
        "no number as `position[name=q1]`",
    ];
    says(&reader.warnings().concat(), &words);
    // a driver that has no measurement yet publishes messages without numbers for a while
    let (block, reader) = read(
        &shown(&recorded("late.mcap", 305, &|k| k < 300)),
        &one_joint(""),
    );
    assert_eq!(block.len(), 5);
    says(&reader.warnings().concat(), &["300 of 305 messages"]);
    let message = refused(&recorded("none.mcap", 5, &|_| true), &one_joint(""));
    says(
        &message,
        &[
            "none of 5 messages",
            "message 1",
            "position[name=q1]",
            "another one",
        ],
    );
}

/// The text's rows in a rosbag2 database whose journal is as SQLite makes it by `pragma`.
fn database(path: &Path, pragma: &str) -> rusqlite::Connection {
    std::fs::copy(fixture("arm.db3"), path).unwrap();
    let database = rusqlite::Connection::open(path).unwrap();
    let mode = database.query_row(pragma, [], |row| row.get::<_, String>(0));
    assert!(pragma.ends_with(&mode.unwrap()), "{pragma}");
    database
}

fn files(folder: &TempDir) -> BTreeSet<String> {
    let entries = std::fs::read_dir(folder.path()).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name());
    names
        .map(|name| name.to_string_lossy().into_owned())
        .collect()
}

#[test]
fn a_database_is_read_without_leaving_anything_beside_it() {
    for (name, pragma) in [
        ("log.db3", "PRAGMA journal_mode = delete"),
        ("a log?of %41#1.db3", "PRAGMA journal_mode = wal"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        drop(database(&path, pragma));
        let (block, reader) = read(&shown(&path), &robot("").layout());
        assert_eq!(block.len(), 80, "{name}");
        assert_eq!(reader.warnings(), [""; 0]);
        drop(reader);
        assert_eq!(files(&folder), BTreeSet::from([name.to_owned()]));
    }
}

#[test]
fn a_database_whose_recorder_was_killed_gives_what_was_committed_and_says_so() {
    for (ending, pragma) in [
        ("wal", "PRAGMA journal_mode = wal"),
        ("journal", "PRAGMA journal_mode = delete"),
    ] {
        let running = tempfile::tempdir().unwrap();
        let path = running.path().join("log.db3");
        let recorder = database(&path, pragma);
        // 30 messages are committed; the next ones fill the cache, so that they are on the disk
        // when the recorder dies, but they are not.
        let drop_some = "DELETE FROM messages WHERE rowid > 30";
        recorder.execute_batch(drop_some).unwrap();
        recorder
            .execute_batch(
                "PRAGMA cache_size = 1; PRAGMA cache_spill = 1; BEGIN;
                 INSERT INTO messages (topic_id, timestamp, data)
                 SELECT a.topic_id, a.timestamp + 10000000000 * b.rowid, a.data
                 FROM messages a, messages b;",
            )
            .unwrap();
        let killed = tempfile::tempdir().unwrap();
        for name in ["log.db3".to_owned(), format!("log.db3-{ending}")] {
            std::fs::copy(running.path().join(&name), killed.path().join(&name)).unwrap();
        }
        let before = files(&killed);
        let path = killed.path().join("log.db3");
        let (block, reader) = read(&shown(&path), &robot("").layout());
        assert_eq!(block.len(), 30, "{ending}");
        let warnings = reader.warnings();
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        says(
            &warnings[0],
            &["log.db3", "did not close it", "30 messages"],
        );
        drop(reader);
        assert_eq!(files(&killed), before);
    }
}

/// How a recording is written.
#[derive(Debug, Clone)]
struct Container {
    compression: Option<Compression>,
    chunk: Option<u64>,
    chunked: bool,
    index: bool,
    big_endian: bool,
}

fn container() -> impl Strategy<Value = Container> {
    let compression =
        prop::sample::select(vec![None, Some(Compression::Lz4), Some(Compression::Zstd)]);
    let chunk = prop::option::of(1u64..3000);
    (compression, chunk, any::<[bool; 3]>()).prop_map(|(compression, chunk, flags)| Container {
        compression,
        chunk,
        chunked: flags[0],
        index: flags[1],
        big_endian: flags[2],
    })
}

type Rows = Vec<(u32, [f64; 3], [f64; 3], [f64; 3], [usize; 4], String)>;

/// Rows: time step [ns], q, tau, dq, order of the joints, frame.
fn rows() -> impl Strategy<Value = Rows> {
    let three = || prop::array::uniform3(finite());
    let order = Just([0usize, 1, 2, 3]).prop_shuffle();
    let row = (1u32.., three(), three(), three(), order, "\\PC{0,9}");
    prop::collection::vec(row, 2..40)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn any_joint_states_in_any_container_and_order_are_read_back_bit_for_bit(
        rows in rows(),
        how in container(),
        names in prop::collection::btree_set("\\PC{1,12}", 4),
        velocities in any::<bool>(),
    ) {
        let names: Vec<String> = names.into_iter().collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        let options = WriteOptions::new()
            .compression(how.compression)
            .chunk_size(how.chunk)
            .use_chunks(how.chunked)
            .emit_message_indexes(how.index)
            .emit_summary_records(how.index);
        let mut recording = Recording::create(&path, options);
        let mut ns = EPOCH_NS;
        let mut t = Vec::new();
        for (step, q, tau, dq, order, frame) in &rows {
            ns += u64::from(*step);
            t.push((ns - EPOCH_NS - u64::from(rows[0].0)) as f64 / 1e9);
            // The fourth joint is of no interest.
            let of = |x: &[f64; 3]| order.map(|joint| x.get(joint).copied().unwrap_or(1.0)).to_vec();
            let state = JointState {
                stamp_ns: ns,
                frame: frame.clone(),
                names: order.map(|joint| names[joint].clone()).to_vec(),
                q: of(q),
                dq: if velocities { of(dq) } else { Vec::new() },
                // A dead torque would be refused.
                tau: of(&tau.map(|x| if x == 0.0 { 1.0 } else { x })),
                big_endian: how.big_endian,
            };
            recording.joint_state("/joint_states", ns, &state);
        }
        recording.finish();
        let layout = Layout::joint_columns(&names[..3]);
        let (block, reader) = read(&shown(&path), &layout);
        prop_assert_eq!(reader.has_velocities(), velocities);
        // Rows that stand still in a motion are reported and left out; none of these does.
        prop_assert_eq!(block.len(), rows.len());
        prop_assert_eq!(&block.t, &t);
        for (index, (_, q, tau, dq, _, _)) in rows.iter().enumerate() {
            let at = 3 * index..3 * index + 3;
            let bits = |x: &[f64]| x.iter().map(|x| (x + 0.0).to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&block.q[at.clone()]), bits(q));
            let tau = tau.map(|x| if x == 0.0 { 1.0 } else { x });
            prop_assert_eq!(bits(&block.tau[at.clone()]), bits(&tau));
            if velocities {
                prop_assert_eq!(bits(&block.dq[at]), bits(dq));
            }
        }
    }
}
