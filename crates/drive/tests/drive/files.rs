//! Files of drives, and what is wrong with them.

use std::fs;
use std::path::Path;

use cft_ident_drive::drive::drive_file::DriveFile;
use cft_ident_drive::drive::error::DriveError;
use cft_ident_drive::drive::identify::DriveData;
use cft_ident_drive::drive::law::DriveLawKind;
use cft_ident_drive::drive::read::bam::RigGiven;
use cft_ident_drive::drive::read::{ReadRequest, read};
use cft_ident_drive::drive::track::{CommandIs, DriveLoad, DriveLog};
use cft_ident_logs::log::LogSpec;

fn rig(head: &str, rows: usize) -> String {
    let entry = |k: usize| {
        let t = 0.005 * k as f64;
        let goal = (4.0 * t).sin();
        let position = 0.9 * (4.0 * t - 0.2).sin();
        format!(
            "{{\"timestamp\": {t}, \"position\": {position}, \"goal_position\": {goal}, \"input_volts\": 11.9, \"torque_enable\": true}}"
        )
    };
    let entries: Vec<String> = (0..rows).map(entry).collect();
    format!("{{{head} \"entries\": [{}]}}", entries.join(","))
}

fn read_text(name: &str, text: &[u8], told: &ReadRequest) -> Result<DriveLog, DriveError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    Ok(read(&LogSpec::whole(path), told)?.0)
}

#[test]
fn rows_win_over_a_head_that_contradicts_them() {
    let head = "\"mass\": 0.5, \"length\": 0.1, \"arm_mass\": 0.05, \"kp\": 16, \"vin\": 15.0, \"sample_rate\": 100,";
    let log = read_text("a.json", rig(head, 200).as_bytes(), &ReadRequest::default()).unwrap();
    assert_eq!(log.joints[0].supply[0], 11.9);
    assert_eq!(log.command_is, CommandIs::Linear);
    assert!(matches!(log.load, DriveLoad::PendulumRig(rig) if rig.mass == 0.5));
    for expected in [
        "sample_rate says 100.0000 Hz, the rows 200.0000 Hz",
        "vin says 15 V, the rows 11.90 V",
    ] {
        assert!(
            log.findings.iter().any(|f| f.contains(expected)),
            "{:?}",
            log.findings
        );
    }
}

#[test]
fn each_file_that_cannot_be_used_says_why_and_what_to_do() {
    let pair = "\"mass\": 0.5, \"length\": 0.1,";
    for (name, text, expected) in [
        ("a.json", rig(pair, 200), "says no kp"),
        ("a.json", rig("\"kp\": 16,", 10), "holds 10 entries"),
        (
            "a.json",
            "{\"entries\": [1, 2".to_owned(),
            "is no JSON of a rig",
        ),
        ("a.json", "[1, 2]".to_owned(), "is no log of a rig"),
        (
            "a.pt",
            "nothing".to_owned(),
            "is no archive as torch.save writes it",
        ),
        (
            "a.csv",
            "t,q_a,q_des_a\n0,1,2\n".to_owned(),
            "which columns are commands is not said",
        ),
    ] {
        let error = read_text(name, text.as_bytes(), &ReadRequest::default()).unwrap_err();
        let error = error.to_string();
        assert!(error.contains(expected), "{error}");
        assert!(error.contains("; "), "{error}");
    }
    let told = ReadRequest {
        rig: RigGiven {
            kp: Some(16.0),
            ..RigGiven::default()
        },
        ..ReadRequest::default()
    };
    let log = read_text("a.json", rig(pair, 200).as_bytes(), &told).unwrap();
    assert_eq!(log.joints[0].kp, 16.0);
}

/// A stored archive of these members.
fn archive(members: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in members {
        let (header, size) = (out.len() as u32, bytes.len() as u32);
        let sizes = |to: &mut Vec<u8>| {
            to.extend([0u8; 10]); // version or flags, method, time, date
            to.extend([0u8; 4]); // checksum
            to.extend(size.to_le_bytes());
            to.extend(size.to_le_bytes());
            to.extend((name.len() as u16).to_le_bytes());
            to.extend([0, 0]);
        };
        out.extend(b"PK\x03\x04");
        sizes(&mut out);
        out.extend(name.bytes());
        out.extend(bytes);
        directory.extend(b"PK\x01\x02");
        directory.extend([0, 0]);
        sizes(&mut directory);
        directory.extend([0u8; 10]);
        directory.extend(header.to_le_bytes());
        directory.extend(name.bytes());
    }
    let from = out.len() as u32;
    out.extend(&directory);
    out.extend(b"PK\x05\x06");
    out.extend([0u8; 8]);
    out.extend((directory.len() as u32).to_le_bytes());
    out.extend(from.to_le_bytes());
    out.extend([0, 0]);
    out
}

/// A pickle of tensors of 40 rows, by name with storage and width.
fn pickle(tensors: &[(&str, &str, u8)]) -> Vec<u8> {
    let mut out = b"\x80\x02}(".to_vec();
    let text = |out: &mut Vec<u8>, x: &str| {
        out.push(b'X');
        out.extend((x.len() as u32).to_le_bytes());
        out.extend(x.bytes());
    };
    for (name, storage, wide) in tensors {
        text(&mut out, name);
        out.extend(b"ctorch._utils\n_rebuild_tensor_v2\n((");
        text(&mut out, "storage");
        out.extend(b"ctorch\nFloatStorage\n");
        text(&mut out, storage);
        text(&mut out, "cpu");
        out.extend([b'K', 40 * wide, b't', b'Q', b'K', 0]);
        match wide {
            1 => out.extend([b'K', 40, 0x85, b'K', 1, 0x85]),
            wide => out.extend([b'K', 40, b'K', *wide, 0x86, b'K', *wide, b'K', 1, 0x86]),
        }
        out.extend(b"\x89ccollections\nOrderedDict\n)RtR");
    }
    out.extend(b"u.");
    out
}

fn floats(of: impl Fn(usize) -> f32, count: usize) -> Vec<u8> {
    (0..count).flat_map(|k| of(k).to_le_bytes()).collect()
}

fn pace() -> Vec<u8> {
    let tensors = [
        ("time", "0", 1),
        ("dof_pos", "1", 2),
        ("des_dof_pos", "2", 2),
    ];
    let wave = |k: usize, late: f32| ((k / 2) as f32 * 0.3 - late).sin() + (k % 2) as f32;
    archive(&[
        ("log/data.pkl", pickle(&tensors)),
        ("log/byteorder", b"little".to_vec()),
        ("log/data/0", floats(|k| 0.005 * k as f32, 40)),
        ("log/data/1", floats(|k| wave(k, 0.2), 80)),
        ("log/data/2", floats(|k| wave(k, 0.0), 80)),
    ])
}

#[test]
fn tensors_of_a_saved_dictionary_are_read_as_data() {
    let log = read_text("a.pt", &pace(), &ReadRequest::default()).unwrap();
    assert_eq!(log.joints.len(), 2);
    assert_eq!(log.t.len(), 40);
    assert!((log.joints[1].command[0] - 1.0).abs() < 1e-7);
    assert!((log.joints[0].position[3] - f64::from((0.9f32 - 0.2).sin())).abs() < 1e-6);
    let told = ReadRequest {
        joints: vec!["a".to_owned()],
        ..ReadRequest::default()
    };
    let error = read_text("a.pt", &pace(), &told).unwrap_err().to_string();
    assert!(error.contains("holds 2 joints, and 1 are named"), "{error}");
}

#[test]
fn no_damage_of_a_saved_dictionary_makes_it_panic() {
    let good = pace();
    for k in (0..good.len()).step_by(3) {
        let mut bytes = good.clone();
        bytes[k] ^= 0xff;
        let _ = read_text("a.pt", &bytes, &ReadRequest::default());
        let _ = read_text("a.pt", &good[..k], &ReadRequest::default());
    }
}

#[test]
fn a_folder_of_two_tables_is_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let (mut control, mut state) = (String::new(), String::new());
    for k in 0..60 {
        let (t, x) = (20_000.0 * f64::from(k), 0.1 * f64::from(k));
        control += &format!("CONTROL,{t},\"[{}, 0.5]\"\n", x.sin());
        state += &format!(
            "STATE_MOTOR,{},\"[{}, {}]\"\n",
            t + 50.0,
            (x - 0.1).sin(),
            0.5 + 0.01 * x
        );
    }
    fs::write(
        folder.path().join("control.csv"),
        format!("type,timestamp,positions\n{control}"),
    )
    .unwrap();
    fs::write(
        folder.path().join("state_motor.csv"),
        format!("type,timestamp,positions\n{state}"),
    )
    .unwrap();
    let (log, _) = read(&LogSpec::whole(folder.path()), &ReadRequest::default()).unwrap();
    // the command of the second joint never moves
    let rests: Vec<bool> = log.joints.iter().map(|track| track.rests).collect();
    assert_eq!(rests, [false, true]);
    let of = |fitted: Vec<DriveLog>| DriveData {
        fitted,
        held_out: vec![log.clone()],
        links: None,
        kind: DriveLawKind::Torque,
    };
    let error = of(vec![log.clone()]).by_joint().err().unwrap();
    assert!(error.to_string().contains("joint joint_2"), "{error}");
    let mut moving = log.clone();
    moving.joints[1].rests = false;
    let each = of(vec![log.clone(), moving]).by_joint().unwrap();
    let logs: Vec<[usize; 2]> = (each.iter())
        .map(|data| [data.fitted.len(), data.held_out.len()])
        .collect();
    assert_eq!(logs, [[2, 1], [1, 0]]);
}

#[test]
fn another_file_is_no_model_of_drives() {
    let error = DriveFile::parse("a.toml", "[robot]\nmodel = \"cft\"\n").unwrap_err();
    assert!(
        error.to_string().contains("is no model file of drives"),
        "{error}"
    );
    assert!(!Path::new("a.toml").exists());
}
