//! What cannot be used says what is wrong with it.

use crate::sensor::Sensor;
use cft_ident_tool::tool::{ToolError, WrenchLog, WrenchRequest, analyse, read_wrenches};

fn read(files: &[(&str, String)]) -> Result<WrenchLog, ToolError> {
    let folder = tempfile::tempdir().unwrap();
    let mut logs = Vec::new();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        logs.push(path.to_string_lossy().parse().unwrap());
    }
    let request = WrenchRequest {
        logs,
        ..WrenchRequest::default()
    };
    read_wrenches(&request).map(|(log, _)| log)
}

const HEAD: &str = "qx,qy,qz,qw,fx,fy,fz,tx,ty,tz\n";

fn rows(quaternion: &str, count: usize) -> String {
    let row = |k: usize| format!("{quaternion},{k},1,2,0.1,0.2,0.3\n");
    HEAD.to_owned() + &(0..count).map(row).collect::<String>()
}

#[test]
fn quaternions_that_are_not_of_length_one_are_named_by_their_row() {
    let mut text = rows("0,0,0,1", 9);
    text += "0,0,0.5,1,1,1,1,0,0,0\n";
    let error = read(&[("a.csv", text)]).unwrap_err().to_string();
    assert!(
        error.contains("a.csv: row 10") && error.contains("length 1.118"),
        "{error}"
    );
}

#[test]
fn a_word_among_numbers_is_named_by_its_row_and_column() {
    let text = rows("0,0,0,1", 3) + "0,0,0,1,1,x,1,0,0,0\n";
    let error = read(&[("a.csv", text)]).unwrap_err().to_string();
    assert!(error.contains("row 4") && error.contains("`fy`"), "{error}");
}

#[test]
fn poses_and_wrenches_that_are_not_as_many_are_counted() {
    let poses: String = (0..8).map(|_| "0,0,1,0,0,0,1\n").collect();
    let wrenches: String = (0..7).map(|k| format!("{k},1,2,0.5,0.2,0.{k}\n")).collect();
    let error = read(&[("p.txt", poses), ("w.txt", wrenches)])
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("8 poses") && error.contains("7 wrenches"),
        "{error}"
    );
}

#[test]
fn a_unit_that_is_none_is_refused_and_one_that_is_known_is_converted() {
    let with = |unit: &str| HEAD.replace("fx", &format!("fx [{unit}]"));
    let text = |unit: &str| with(unit) + rows("0,0,0,1", 9).split_once('\n').unwrap().1;
    let error = read(&[("a.csv", text("stone"))]).unwrap_err().to_string();
    assert!(error.contains("`stone`"), "{error}");
    let log = read(&[("a.csv", text("kgf"))]).unwrap();
    assert!((log.samples[1].force[0] - 9.80665).abs() < 1e-9);
}

#[test]
fn poses_that_are_all_alike_determine_nothing() {
    let mut log = Sensor::default().log(1);
    let first = log.samples[0];
    for sample in &mut log.samples {
        sample.quaternion = first.quaternion;
        sample.force =
            [0, 1, 2].map(|i| first.force[i] + 0.01 * (sample.t * (1.0 + i as f64)).sin());
        sample.moment = first.moment;
    }
    let error = analyse(&log, None).unwrap_err();
    assert!(matches!(error, ToolError::Alike { .. }), "{error}");
}

#[test]
fn wrenches_of_other_poses_are_explained_by_no_frame() {
    let mut log = Sensor::default().log(1);
    let n = log.samples.len();
    let forces: Vec<_> = log.samples.iter().map(|s| (s.force, s.moment)).collect();
    for (k, sample) in log.samples.iter_mut().enumerate() {
        (sample.force, sample.moment) = forces[(37 * k + 11) % n];
    }
    let error = analyse(&log, None).unwrap_err();
    assert!(matches!(error, ToolError::Frames { .. }), "{error}");
    assert!(error.to_string().contains("order, clock, delay"), "{error}");
}

#[test]
fn forces_in_kilograms_beside_moments_in_newton_metres_are_seen_by_the_lever() {
    let mut log = Sensor {
        centre: [0.01, 0.02, 0.09],
        ..Sensor::default()
    }
    .log(1);
    log.unit_is_stated = false;
    assert!(analyse(&log, None).is_ok());
    for sample in &mut log.samples {
        sample.force = sample.force.map(|x| x / 9.80665);
    }
    let error = analyse(&log, None).unwrap_err();
    assert!(matches!(error, ToolError::Units { .. }), "{error}");
    assert!(error.to_string().contains("--force-unit kgf"), "{error}");
}

#[test]
fn a_few_rows_are_too_few() {
    let log = Sensor {
        poses: 3,
        ..Sensor::default()
    }
    .log(1);
    assert!(matches!(
        analyse(&log, None).unwrap_err(),
        ToolError::TooFew { .. }
    ));
}
