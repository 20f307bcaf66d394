//! Any text as a campaign file.
#![no_main]

use cft_ident::config::Campaign;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let _ = Campaign::parse("c.toml", text);
});
