//! Tables of any bytes that are no lines of fields: MAT-files with their head put before them, arrays, JSON.
#![no_main]

use cft_ident::log::Layout;
use libfuzzer_sys::fuzz_target;

#[path = "../reading.rs"]
mod reading;

fuzz_target!(|data: &[u8]| {
    let Some((mode, bytes)) = data.split_first() else {
        return;
    };
    let mut head = Vec::new();
    if mode & 1 == 1 {
        head.extend(b"MATLAB 5.0 MAT-file");
        head.resize(124, b' ');
        head.extend([0, 1]);
        head.extend(if mode & 2 == 2 { b"MI" } else { b"IM" });
    }
    head.extend(bytes);
    reading::read("table", &head, "", &Layout::joint_columns(&["q1"]));
});
