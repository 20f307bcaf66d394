//! Files of reduced logs: any bytes, and a real file with a head of any text. What is read is written as the same bytes,
//! and a fit of it ends in a model or an error.
#![no_main]

use std::sync::OnceLock;

use cft_ident::config::RobotFile;
use cft_ident::identify::{Dataset, Control, Log, RobotSetup, LsqSettings, ReducedLogs, lsq, reduce};
use libfuzzer_sys::fuzz_target;
use sha2::{Digest, Sha256};

const SLIDE: &str = "[robot]\nmodel = \"single-joint\"\njoint = \"a\"\nkind = \"prismatic\"\n\
    [friction]\nlaw = \"viscous-coulomb\"\nfitted_with_inertias = true\noffset = true\n";
/// Digits of the checksum at the end of a file.
const CHECKSUM: usize = 64;

/// A robot, and a log of it that is reduced.
fn real() -> &'static (RobotSetup, Vec<u8>) {
    static REAL: OnceLock<(RobotSetup, Vec<u8>)> = OnceLock::new();
    REAL.get_or_init(|| {
        let file = RobotFile::parse("r.toml", SLIDE).expect("the robot is right");
        let machine = RobotSetup::new("r.toml", file);
        let t: Vec<f64> = (0..400).map(|k| f64::from(k) / 200.0).collect();
        let q: Vec<f64> = t.iter().map(|t| (3.0 * t).sin() + 0.2 * (17.0 * t).sin()).collect();
        let tau: Vec<f64> = t.iter().map(|t| -9.0 * (3.0 * t).sin() + 2.0 * (3.0 * t).cos()).collect();
        let log = Log::of_rows("log", &t, &q, &tau).expect("the log is right");
        let parts = reduce(&Dataset::read(&machine, &[log], &Control::default()).expect("logs that can be read"), None, &Control::default()).expect("a motion");
        let bytes = parts.to_bytes().expect("a part");
        (machine, bytes)
    })
}

fuzz_target!(|data: &[u8]| {
    let (machine, part) = real();
    let Some((mode, changes)) = data.split_first() else {
        return;
    };
    let bytes = match mode & 1 {
        0 => data.to_vec(),
        // bytes at any place, and the checksum of what comes out
        _ => {
            let mut bytes = part[..part.len() - CHECKSUM].to_vec();
            for change in changes.chunks_exact(4) {
                let place = u32::from_le_bytes([change[0], change[1], change[2], 0]) as usize;
                let place = place % bytes.len();
                bytes[place] = change[3];
            }
            let digits: String = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
            bytes.extend(digits.bytes());
            bytes
        }
    };
    let Ok(parts) = ReducedLogs::from_bytes("part.cfi", &bytes) else {
        return;
    };
    let again = parts.to_bytes().expect("what is read is written");
    let read = ReducedLogs::from_bytes("part.cfi", &again).expect("what is written is read");
    assert_eq!(read.to_bytes().expect("once more"), again);
    let _ = lsq(&Dataset::read(machine, &parts.as_logs(), &Control::default()).expect("logs that can be read"), &LsqSettings::default(), &Control::default());
});
