//! Recordings of any bytes: MCAP in all its encodings, rosbag2 databases, compressed files.
#![no_main]

use cft_ident::log::Layout;
use libfuzzer_sys::fuzz_target;

#[path = "../reading.rs"]
mod reading;

fuzz_target!(|data: &[u8]| {
    let Some((mode, bytes)) = data.split_first() else {
        return;
    };
    let mut layout = Layout::joint_columns(&["q1", "q2"]);
    if mode & 1 == 1 {
        for (index, channel) in layout.positions.iter_mut().enumerate() {
            channel.column = format!("joints[{index}].q");
        }
        for (index, channel) in layout.torques.iter_mut().enumerate() {
            channel.column = format!("/torques/{index}");
        }
    }
    reading::read("mcap", bytes, "", &layout);
});
