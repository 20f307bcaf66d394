//! Measured servos, where their logs lie beside the clone.

use std::path::Path;

use cft_ident_drive::drive::candidate::DriveEffect;
use cft_ident_drive::drive::identify::{DriveData, identify};
use cft_ident_drive::drive::law::{DriveLawKind, ServoFirmware};
use cft_ident_drive::drive::outcome::DriveResult;
use cft_ident_drive::drive::read::bam::RigGiven;
use cft_ident_drive::drive::read::{ReadRequest, read};
use cft_ident_logs::log::LogSpec;

#[test]
#[ignore = "a minute: measured logs"]
fn a_measured_servo_has_a_late_command_and_a_speed_limit_at_a_gain_that_nobody_fitted() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/sts3215");
    let Ok(files) = std::fs::read_dir(&folder) else {
        eprintln!("SKIPPED: no measured logs in ../shared/data/sts3215");
        return;
    };
    let mut paths: Vec<_> = files.map(|f| f.unwrap().path()).collect();
    paths.sort();
    let told = ReadRequest {
        rig: RigGiven {
            arm_mass: Some(0.05),
            ..RigGiven::default()
        },
        ..ReadRequest::default()
    };
    let logs = paths
        .iter()
        .map(|path| read(&LogSpec::whole(path), &told).unwrap().0);
    let (held_out, fitted) = logs.partition(|log| log.fact("kp") == Some(16.0));
    let data = DriveData {
        fitted,
        held_out,
        links: None,
        kind: DriveLawKind::Volts(ServoFirmware::default()),
    };
    let drives = DriveResult::new(&identify(&data, &|_| {}).unwrap());
    for effect in [DriveEffect::CommandDelay, DriveEffect::SpeedLimit] {
        assert!(
            drives.steps.iter().any(|s| s.effect == effect && s.written),
            "{effect:?}"
        );
    }
    let delay = drives.find("command_delay", None).unwrap();
    assert!((0.025..0.042).contains(&delay), "{delay}");
    let errors = drives.after.holdout.unwrap();
    assert!(errors.mae < 14.5e-3, "{}", errors.mae);
}
