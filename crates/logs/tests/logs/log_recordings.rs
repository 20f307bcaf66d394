//! Recordings of messages: the same numbers from every container, and what is said of broken ones.

use crate::log_support;

use std::path::Path;

use cft_ident_logs::log::{Block, Channel, Layout, LogSpec, Reader};
use log_support::{read, says, shared};

/// The UR10 as its CSV names the columns, and as its messages name the joints.
fn ur10() -> Layout {
    let joints = [
        "shoulder_pan_joint",
        "shoulder_lift_joint",
        "elbow_joint",
        "wrist_1_joint",
        "wrist_2_joint",
        "wrist_3_joint",
    ];
    let mut layout = Layout::joint_columns(&joints);
    for index in 0..joints.len() {
        let number = index + 1;
        layout.positions[index] = Channel::si(format!("q{number}"), "rad");
        layout.torques[index] = Channel::si(format!("tau{number}"), "Nm");
        layout.velocities[index] = Channel::si(format!("dq{number}"), "rad");
    }
    layout
}

/// A number with nine significant digits, as the CSV holds it.
fn as_in_csv(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap()
}

#[test]
fn the_ur10_recording_gives_the_same_samples_from_mcap_db3_and_csv() {
    let Some(csv) = shared("ur10/ur10_exciting.csv") else {
        return;
    };
    let (expected, _) = read(&csv.to_string_lossy(), &ur10());
    assert_eq!((expected.len(), expected.joints()), (3441, 6));
    let mut blocks: Vec<Block> = Vec::new();
    for file in [
        "ur10/ur10_exciting_trajectory.mcap",
        "ur10/ur10_exciting_trajectory.db3",
    ] {
        let Some(path) = shared(file) else { return };
        let (found, reader) = read(&path.to_string_lossy(), &ur10());
        assert_eq!(found.len(), expected.len(), "{file}");
        assert_eq!(found.t, expected.t, "{file}");
        let rounded = |x: &[f64]| x.iter().map(|x| as_in_csv(*x)).collect::<Vec<f64>>();
        assert_eq!(rounded(&found.q), expected.q, "{file}");
        assert_eq!(rounded(&found.dq), expected.dq, "{file}");
        assert_eq!(rounded(&found.tau), expected.tau, "{file}");
        assert!(reader.warnings().is_empty(), "{:?}", reader.warnings());
        assert_eq!(reader.provenance().unwrap().samples, 3441);
        blocks.push(found);
    }
    let [mcap, db3] = [&blocks[0], &blocks[1]].map(|b| (&b.t, &b.q, &b.dq, &b.tau));
    assert_eq!(mcap, db3);
}

#[test]
fn spans_of_a_recording_share_no_row_and_leave_none_out() {
    let Some(path) = shared("ur10/ur10_exciting_trajectory.mcap") else {
        return;
    };
    let path = path.to_string_lossy();
    let (whole, _) = read(&path, &ur10());
    for (first, second) in [("0..70%", "70..100%"), ("0..9.99s", "9.99..s")] {
        let (first, _) = read(&format!("{path}@{first}"), &ur10());
        let (second, _) = read(&format!("{path}@{second}"), &ur10());
        let joined: Vec<f64> = first.t.iter().chain(&second.t).copied().collect();
        assert_eq!(joined, whole.t);
        assert_eq!(second.tau, whole.tau[first.tau.len()..]);
    }
}

#[test]
fn a_recording_that_breaks_off_is_used_up_to_the_break_and_says_how_far() {
    let Some(path) = shared("ur10/ur10_exciting_trajectory.mcap") else {
        return;
    };
    let bytes = std::fs::read(&path).unwrap();
    let (whole, _) = read(&path.to_string_lossy(), &ur10());
    let folder = tempfile::tempdir().unwrap();
    let cut = folder.path().join("killed.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let (found, reader) = read(&cut.to_string_lossy(), &ur10());
    assert!((1000..2500).contains(&found.len()), "{}", found.len());
    assert_eq!(found.q, whole.q[..found.q.len()]);
    let warnings = reader.warnings();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    let size = bytes.len() / 2;
    let (of, messages) = (format!("of {size}"), format!("{} messages", found.len()));
    says(&warnings[0], &["killed.mcap", &of, &messages]);
}

#[test]
fn the_panda_recording_is_found_by_the_names_of_its_joints() {
    let Some(path) = shared("ur10/panda_exciting_trajectory.mcap") else {
        return;
    };
    let joints: Vec<String> = (1..=7).map(|joint| format!("fer_joint{joint}")).collect();
    let (block, reader) = read(&path.to_string_lossy(), &Layout::joint_columns(&joints));
    // 14 of the 727 messages repeat the one before while the robot moves.
    assert_eq!((block.len(), block.joints()), (727 - 14, 7));
    says(&reader.warnings()[0], &["14 rows repeat"]);
    assert!(reader.has_velocities());
    assert_eq!(block.t[1], 0.033382177);
    assert_eq!(block.q[0], -2.253337627308282);

    let wrong = Layout::joint_columns(&["fer_joint_1"]);
    let spec = LogSpec::whole(&path);
    let message = Reader::open(&spec, &wrong).unwrap_err().to_string();
    let words = [
        "fer_joint_1",
        "nearest is `fer_joint1`",
        "/joint_states",
        "[log.joint]",
    ];
    says(&message, &words);
}

#[test]
fn a_topic_that_is_not_there_is_answered_with_those_that_are() {
    let Some(path) = shared("ur10/ur10_exciting_trajectory.mcap") else {
        return;
    };
    let mut layout = ur10();
    layout.section.topic = Some("/joint_state".to_owned());
    let refused = Reader::open(&LogSpec::whole(Path::new(&path)), &layout).unwrap_err();
    let words = ["`/joint_state`", "did you mean `/joint_states`"];
    says(&refused.to_string(), &words);
}
