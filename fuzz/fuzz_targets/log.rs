//! Whole files of any kind, as they are on disk: seeds are the logs of ../shared/cases.
#![no_main]

use cft_ident::log::Layout;
use libfuzzer_sys::fuzz_target;

#[path = "../reading.rs"]
mod reading;

fuzz_target!(|data: &[u8]| {
    reading::read("log", data, "", &Layout::joint_columns(&["q1", "q2"]));
});
