//! Any text as a trajectory file; one that is read is written and read again as the same.
#![no_main]

use cft_ident::config::Trajectory;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(trajectory) = Trajectory::parse("t.toml", text) {
        let again = Trajectory::parse("t.toml", &trajectory.to_toml(""));
        assert_eq!(again.expect("what is written is read"), trajectory);
    }
});
