//! One log in every format, written by the formats' own packages (fixtures/logs/make.py).
//!
//! `CFT_IDENT_LOGS` names another folder of the same files: `.ci/interop.sh` makes one anew.

use crate::log_support;

use std::path::PathBuf;

use cft_ident_files::config::RobotFile;
use cft_ident_logs::log::{Block, Layout, LogSpec, Reader};
use log_support::{fixture, read, says};

const ROBOT: &str = "[robot]\nmodel = \"cft\"\nsetup = \"tuedacs\"\n";
const EPOCH_NS: i128 = 1_700_000_000_123_456_789;

fn log(name: &str) -> String {
    let path = match std::env::var_os("CFT_IDENT_LOGS") {
        Some(folder) => PathBuf::from(folder).join(name),
        None => fixture(name),
    };
    path.to_string_lossy().into_owned()
}

/// The layout of the CFT robot with `[log]` as given.
fn layout(log: &str) -> Layout {
    RobotFile::parse("r.toml", &format!("{ROBOT}{log}"))
        .unwrap()
        .layout()
}

/// The log as text, which all other files equal.
fn expected() -> Block {
    let (block, reader) = read(&log("arm.csv"), &layout(""));
    assert_eq!((block.len(), block.joints()), (80, 4));
    assert!(reader.has_velocities());
    assert_eq!(reader.warnings(), [""; 0]);
    block
}

/// Numbers equal bit for bit.
#[track_caller]
fn same(found: &Block, expected: &Block) {
    assert_eq!(found.t, expected.t);
    assert_eq!(found.q, expected.q);
    assert_eq!(found.tau, expected.tau);
    assert_eq!(found.dq, expected.dq);
}

#[test]
fn compressed_text_equals_plain_text() {
    for name in ["arm.csv.gz", "arm.csv.zst"] {
        same(&read(&log(name), &layout("")).0, &expected());
    }
}

#[test]
fn joint_states_equal_the_text_whatever_holds_them() {
    for name in [
        "arm.mcap",
        "unindexed.mcap",
        "big-endian.mcap",
        "arm.db3",
        "compressed.db3",
        "split",
    ] {
        let (block, reader) = read(&log(name), &layout(""));
        same(&block, &expected());
        assert_eq!(reader.warnings(), [""; 0], "{name}");
        assert_eq!(reader.origin().nanoseconds(), EPOCH_NS, "{name}");
        assert_eq!(reader.samples(), 80);
        let provenance = reader.provenance().unwrap();
        assert_eq!((provenance.name.as_str(), provenance.samples), (name, 80));
    }
}

#[test]
fn the_time_of_recording_is_another_clock_that_can_be_chosen() {
    let (header, _) = read(&log("arm.mcap"), &layout("[log]\nstamp = \"header\"\n"));
    let (recorded, reader) = read(&log("arm.mcap"), &layout("[log]\nstamp = \"log\"\n"));
    same(&header, &expected());
    assert_ne!(recorded.t, header.t);
    assert!(reader.origin().nanoseconds() >= EPOCH_NS + 1_000_000);
    for (recorded, stamped) in recorded.t.iter().zip(&header.t) {
        assert!((recorded - stamped).abs() < 2.1e-3);
    }
}

#[test]
fn names_in_another_order_and_empty_arrays_change_nothing() {
    let (block, reader) = read(&log("shuffled.mcap"), &layout(""));
    let expected = expected();
    assert_eq!(
        (&block.t, &block.q, &block.tau),
        (&expected.t, &expected.q, &expected.tau)
    );
    // Some messages have no velocities: then none are handed out.
    assert!(!reader.has_velocities() && block.dq.is_empty());
    let warnings = reader.warnings();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    says(&warnings[0], &["20 of 100 messages", "position[name=q1]"]);
}

#[test]
fn a_recorder_that_was_killed_leaves_what_it_wrote() {
    let (block, reader) = read(&log("killed.mcap"), &layout(""));
    let expected = expected();
    let rows = block.len();
    assert!((20..70).contains(&rows), "{rows}");
    assert_eq!(block.q, expected.q[..4 * rows]);
    assert_eq!(block.tau, expected.tau[..4 * rows]);
    let warnings = reader.warnings();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    says(
        &warnings[0],
        &["breaks off at byte", &format!("{rows} mess")],
    );
}

#[test]
fn any_message_is_read_by_field_path_with_its_own_time() {
    let mut log_section = String::from(
        "[log]\ntopic = \"/drives\"\ntime = \"stamp_us\"\ntime_unit = \"us\"\ntorque_is = \"joint\"\n",
    );
    for (index, joint) in ["q1", "q2", "q4", "q5"].into_iter().enumerate() {
        log_section.push_str(&format!(
            "[log.joint.{joint}]\nposition = \"drives[{index}].angle\"\nvelocity = \"/drives/{index}/speed\"\ntorque = \"drives[{index}].torque_and_limit[0]\"\n"
        ));
    }
    let (block, reader) = read(&log("drives.mcap"), &layout(&log_section));
    same(&block, &expected());
    assert_eq!(reader.origin().nanoseconds(), 0);
}

#[test]
fn json_is_read_by_pointer_and_protobuf_by_the_descriptor_in_the_file() {
    let mut by_pointer =
        String::from("[log]\ntime = \"/time~1ns\"\ntime_unit = \"ns\"\ntorque_is = \"joint\"\n");
    let mut by_path = String::from("[log]\ntorque_is = \"joint\"\n");
    for (index, joint) in ["q1", "q2", "q4", "q5"].into_iter().enumerate() {
        by_pointer.push_str(&format!(
            "[log.joint.{joint}]\nposition = \"/joints/{index}/q\"\nvelocity = \"joints[name={joint}].dq\"\ntorque = \"joints[{index}].tau\"\n"
        ));
        by_path.push_str(&format!(
            "[log.joint.{joint}]\nposition = \"joints[name={joint}].q\"\nvelocity = \"speeds[{index}]\"\ntorque = \"/torques/{index}\"\n"
        ));
    }
    for (name, log_section) in [("json.mcap", by_pointer), ("protobuf.mcap", by_path)] {
        let (block, reader) = read(&log(name), &layout(&log_section));
        same(&block, &expected());
        assert_eq!(reader.origin().nanoseconds(), EPOCH_NS, "{name}");
        assert_eq!(reader.warnings(), [""; 0], "{name}");
    }
}

#[test]
fn positions_and_torques_of_two_topics_are_brought_onto_the_clock_of_the_positions() {
    let mut log_section = String::from("[log]\ntorque_is = \"joint\"\n");
    for (index, joint) in ["q1", "q2", "q4", "q5"].into_iter().enumerate() {
        log_section.push_str(&format!(
            "[log.joint.{joint}]\ntorque = \"data[{index}]\"\n"
        ));
    }
    let (block, reader) = read(&log("two-topics.mcap"), &layout(&log_section));
    let expected = expected();
    // The first and the last position have no torque on both sides.
    assert_eq!(block.len(), 78);
    assert_eq!(block.q, expected.q[4..4 * 79]);
    assert!(reader.has_velocities());
    let mut worst: f64 = 0.0;
    for row in 0..78 {
        for joint in 0..4 {
            // Linear between torques at 85 % of the step before and 35 % of the step after.
            let tau = |row: usize| expected.tau[4 * row + joint];
            let before = tau(row) + 0.85 * (tau(row + 1) - tau(row));
            let after = tau(row + 1) + 0.35 * (tau(row + 2) - tau(row + 1));
            let between = before + 0.15 / 0.5 * (after - before);
            worst = worst.max((block.tau[4 * row + joint] - between).abs());
        }
    }
    assert!(worst < 1e-7, "{worst}");
    let words = [
        "positions are those of /positions, torques those of /torques",
        "2 messages of /positions lie before the first or after the last torque",
        "only one of the two topics has stamps",
        "delay",
    ];
    says(&reader.warnings().join("\n"), &words);
    // Held torques are those of the message before.
    let held = format!(
        "[log]\ntorque_held = true\n{}",
        &log_section["[log]\n".len()..]
    );
    let (held, _) = read(&log("two-topics.mcap"), &layout(&held));
    let before = expected.tau[0] + 0.85 * (expected.tau[4] - expected.tau[0]);
    assert!((held.tau[0] - before).abs() < 1e-12);
}

#[test]
fn several_files_are_one_recording_in_the_order_of_their_messages() {
    let parts = ["split_11", "split_9", "split_10"];
    let joined: Vec<String> = parts
        .iter()
        .map(|part| log(&format!("split/{part}.mcap")))
        .collect();
    let (block, reader) = read(&joined.join("+"), &layout(""));
    same(&block, &expected());
    assert_eq!(
        reader.provenance().unwrap().name,
        "split_11.mcap+split_9.mcap+split_10.mcap"
    );
}

#[test]
fn recordings_are_read_compressed_as_a_whole_too() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["arm.mcap", "arm.db3"] {
        let bytes = std::fs::read(log(name)).unwrap();
        let path = folder.path().join(format!("{name}.zst"));
        std::fs::write(&path, zstd::encode_all(&bytes[..], 3).unwrap()).unwrap();
        same(&read(&path.to_string_lossy(), &layout("")).0, &expected());
    }
}

#[test]
fn a_compressed_recording_that_is_cut_off_is_used_up_to_the_cut() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(log("unindexed.mcap")).unwrap();
    let path = folder.path().join("cut.mcap.zst");
    // Two frames, the second one cut off.
    let half = zstd::encode_all(&bytes[..bytes.len() / 2], 3).unwrap();
    let rest = zstd::encode_all(&bytes[bytes.len() / 2..], 3).unwrap();
    std::fs::write(&path, [&half[..], &rest[..rest.len() / 2]].concat()).unwrap();
    let (block, reader) = read(&path.to_string_lossy(), &layout(""));
    assert!((30..80).contains(&block.len()), "{}", block.len());
    assert_eq!(block.q, expected().q[..4 * block.len()]);
    says(
        &reader.warnings()[0],
        &["decompressed bytes", "compression ends"],
    );
}

#[test]
fn a_database_without_definitions_is_read_by_the_known_type() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.db3");
    std::fs::copy(log("arm.db3"), &path).unwrap();
    let database = rusqlite::Connection::open(&path).unwrap();
    database
        .execute_batch("DROP TABLE message_definitions; DROP TABLE schema; DROP TABLE metadata;")
        .unwrap();
    drop(database);
    same(&read(&path.to_string_lossy(), &layout("")).0, &expected());
}

#[test]
fn a_chunk_with_a_wrong_checksum_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("damaged.mcap");
    let mut bytes = std::fs::read(log("big-endian.mcap")).unwrap();
    let at = bytes.len() / 3;
    bytes[at] ^= 0x10;
    std::fs::write(&path, bytes).unwrap();
    let outcome = Reader::open(&LogSpec::whole(&path), &layout("")).and_then(|mut reader| {
        let mut block = Block::default();
        while reader.read(&mut block)? {}
        Ok(())
    });
    says(&outcome.unwrap_err().to_string(), &["damaged", "checksum"]);
}

#[test]
fn a_robot_whose_joints_are_not_there_hears_what_is() {
    let robot = "[robot]\nmodel = \"single-joint\"\njoint = \"q3\"\nkind = \"revolute\"\n";
    let layout = RobotFile::parse("r.toml", robot).unwrap().layout();
    for (name, words) in [
        ("arm.mcap", ["/joint_states", "`q3`", "q1, q2, q4, q5"]),
        ("json.mcap", ["/arm", "`q_q3`", "joints"]),
        (
            "unindexed.mcap",
            ["sensor_msgs/msg/JointState", "`name`", "[log.joint]"],
        ),
    ] {
        let refused = Reader::open(&LogSpec::whole(log(name)), &layout).unwrap_err();
        says(&refused.to_string(), &words);
    }
}
