//! Bags of ROS 1 of any bytes, their magic put before them.
#![no_main]

use cft_ident::log::Layout;
use libfuzzer_sys::fuzz_target;

#[path = "../reading.rs"]
mod reading;

fuzz_target!(|data: &[u8]| {
    let bytes = [b"#ROSBAG V2.0\n", data].concat();
    reading::read("bag", &bytes, "", &Layout::joint_columns(&["q1", "q2"]));
});
