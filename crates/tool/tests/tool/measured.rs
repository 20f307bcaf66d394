//! The measured sensor beside the clone, where it is.

use std::path::{Path, PathBuf};

use cft_ident_tool::tool::{ToolResult, WrenchFrame, WrenchRequest, analyse, read_wrenches};

fn shared(name: &str) -> Option<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/wrist-ft");
    let path = root.join(name);
    let there = path.exists();
    if !there {
        println!("SKIPPED: no {} beside the clone", path.display());
    }
    there.then_some(path)
}

fn analysed(log: &Path, wrench: Option<&Path>) -> ToolResult {
    let request = WrenchRequest {
        logs: vec![log.to_string_lossy().parse().unwrap()],
        wrench: wrench.map(|path| path.to_string_lossy().into_owned()),
        ..WrenchRequest::default()
    };
    let (log, _) = read_wrenches(&request).unwrap();
    analyse(&log, None).unwrap()
}

#[test]
fn the_drift_of_the_measured_sensor_is_named_and_its_weight_is_that_of_the_literature() {
    let Some(poses) = shared("recorded_messages_pose_100.txt") else {
        return;
    };
    let wrenches = poses.with_file_name("recorded_messages_wrench_100.txt");
    let found = analysed(&poses, Some(&wrenches));
    assert_eq!(found.reading.frame, WrenchFrame::Base);
    let plain = found.before.holdout.force_error;
    assert!((plain - 0.49).abs() < 0.005, "{plain}");
    let after = found.after.holdout.force_error;
    assert!(after <= 0.165, "{after}");
    let drift = found
        .steps
        .iter()
        .find(|step| step.effect == "bias-drift")
        .unwrap();
    assert_eq!(drift.status, "confirmed");
    let [low, high] = found.weight.interval_95.unwrap();
    assert!(
        low < 11.5 && 11.5 < high && high - low < 0.4,
        "{low} {high}"
    );
    let forecast = found.forecast.unwrap();
    assert!(forecast.with.force_error > forecast.without.force_error);
}

#[test]
fn the_drift_log_holds_poses_between_motions_and_its_drift_is_named() {
    let Some(log) = shared("GP2025-07-22-22-06-02.txt") else {
        return;
    };
    let found = analysed(&log, None);
    assert_eq!(found.reading.frame, WrenchFrame::Sensor);
    assert!(found.before.holdout.force_error < 0.25);
    assert!(
        (found.weight.value.unwrap() - 11.4).abs() < 0.5,
        "{:?}",
        found.weight
    );
}
