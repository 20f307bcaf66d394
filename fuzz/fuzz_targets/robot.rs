//! Any text as a robot file.
#![no_main]

use cft_ident::config::RobotFile;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(robot) = RobotFile::parse("r.toml", text) {
        robot.layout();
        robot.robot();
    }
});
