//! Any text as every kind of configuration.
#![no_main]

use cft_ident::config::{Campaign, ModelFile, RobotFile, Trajectory};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(robot) = RobotFile::parse("r.toml", text) {
        robot.layout();
        robot.robot();
    }
    let _ = ModelFile::parse("m.toml", text);
    let _ = Trajectory::parse("t.toml", text);
    let _ = Campaign::parse("c.toml", text);
});
