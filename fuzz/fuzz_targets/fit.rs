//! Arbitrary numbers as a log of one joint, from the log to the fitted model and what it lacks.
#![no_main]

use std::sync::OnceLock;

use cft_ident::config::RobotFile;
use cft_ident::identify::{
    Control, Dataset, DiagnoseSettings, GivenModel, Log, RobotSetup, LsqSettings, ValidateSettings, diagnose, lsq,
    validate,
};
use libfuzzer_sys::fuzz_target;

const SLIDE: &str = "[robot]\nmodel = \"single-joint\"\njoint = \"a\"\nkind = \"prismatic\"\n\
    [friction]\nlaw = \"viscous-coulomb\"\nfitted_with_inertias = true\noffset = true\n";

/// Rows of a log: fewer say nothing, more take long.
const ROWS: usize = 400;

fuzz_target!(|data: &[u8]| {
    static ROBOT: OnceLock<RobotFile> = OnceLock::new();
    let robot = ROBOT.get_or_init(|| RobotFile::parse("r.toml", SLIDE).expect("the robot is right"));
    // a motion to begin with, and numbers of any size at any place of it
    let t: Vec<f64> = (0..ROWS).map(|k| k as f64 / 200.0).collect();
    let mut q: Vec<f64> = t.iter().map(|t| (3.0 * t).sin() + 0.2 * (17.0 * t).sin()).collect();
    let mut tau: Vec<f64> = t.iter().map(|t| -9.0 * (3.0 * t).sin() + 2.0 * (3.0 * t).cos()).collect();
    for change in data.chunks_exact(11) {
        let place = usize::from(u16::from_le_bytes([change[0], change[1]])) % ROWS;
        let number = f64::from_le_bytes(change[2..10].try_into().expect("eight bytes"));
        let many = if change[10] & 2 == 0 { 1 } else { usize::from(change[10]) };
        let of = if change[10] & 1 == 0 { &mut q } else { &mut tau };
        for value in of.iter_mut().skip(place).take(many) {
            *value = number;
        }
    }
    let Ok(log) = Log::of_rows("log", &t, &q, &tau) else {
        return;
    };
    let machine = RobotSetup::new("r.toml", robot.clone());
    let control = Control::default();
    let Ok(data) = Dataset::read(&machine, std::slice::from_ref(&log), &Control::default()) else {
        return;
    };
    let Ok(found) = lsq(&data, &LsqSettings::default(), &control) else {
        return;
    };
    let file = found.model(&machine, None);
    let given = GivenModel::new("m.toml", file);
    let _ = validate(&data, &ValidateSettings::of(&given), &control, &mut |_, _| {});
    let _ = diagnose(&data, &DiagnoseSettings::of(&given), &control);
});
