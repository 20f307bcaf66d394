//! Any text as a campaign file.
#![no_main]

use cft_ident::config::CampaignFile;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    let _ = CampaignFile::parse("c.toml", text);
});
