//! Logs of a wrist sensor of any bytes: a table, or a recording.
#![no_main]

use std::path::PathBuf;

use cft_ident_tool::tool::{WrenchRequest, read_wrenches};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let folder = PathBuf::from("/dev/shm");
    let folder = if folder.is_dir() { folder } else { std::env::temp_dir() };
    let path = folder.join(format!("cft-ident-fuzz-wrench-{}.csv", std::process::id()));
    std::fs::write(&path, data).expect("the temporary file can be written");
    let request = WrenchRequest {
        logs: vec![path.display().to_string().parse().expect("the span is right")],
        ..WrenchRequest::default()
    };
    let Ok((log, _)) = read_wrenches(&request) else {
        return;
    };
    let numbers = log.samples.iter().flat_map(|sample| sample.force.iter().chain(&sample.moment));
    assert!(numbers.copied().all(f64::is_finite), "numbers are finite");
});
