//! Logs of drives: the first byte says whether a rig's JSON, a `.pt`, a folder of SAGE (two texts, parted by a byte 0)
//! or a table.
#![no_main]

use std::path::PathBuf;

use cft_ident::drive::read::{ReadRequest, read};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Some((kind, bytes)) = data.split_first() else {
        return;
    };
    let folder = PathBuf::from("/dev/shm");
    let folder = if folder.is_dir() { folder } else { std::env::temp_dir() };
    let path = folder.join(format!("cft-ident-fuzz-drive-{}", std::process::id()));
    let ending = ["json", "pt", "", "csv"][usize::from(kind % 4)];
    let path = path.with_extension(ending);
    if kind % 4 == 2 {
        let cut = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        let (control, state) = bytes.split_at(cut);
        std::fs::create_dir_all(&path).expect("the temporary folder can be made");
        for (name, text) in [("control.csv", control), ("state_motor.csv", state)] {
            std::fs::write(path.join(name), text).expect("the folder can be written");
        }
    } else {
        std::fs::write(&path, bytes).expect("the temporary file can be written");
    }
    let spec = path.display().to_string().parse().expect("the span is right");
    let Ok((log, _)) = read(&spec, &ReadRequest::default()) else {
        return;
    };
    assert!(log.t.windows(2).all(|t| t[1] > t[0]), "times increase");
    for joint in &log.joints {
        assert_eq!(joint.position.len(), log.t.len(), "a position for every time");
    }
});
