//! Text logs of any bytes: every delimiter, columns by name and by number, every clock.
#![no_main]

use cft_ident::log::{Channel, Layout};
use libfuzzer_sys::fuzz_target;

#[path = "../reading.rs"]
mod reading;

fuzz_target!(|data: &[u8]| {
    let Some((mode, bytes)) = data.split_first() else {
        return;
    };
    let mut layout = Layout::joint_columns(&["q1"]);
    if mode & 1 == 1 {
        layout.time = Channel::si("#1", "s");
        layout.positions[0] = Channel::si("#2", "rad");
        layout.torques[0] = Channel::si("#3", "Nm");
    }
    layout.time.factor = [1.0, 1e-3, 1e-6, 1e-9][usize::from(mode >> 1 & 3)];
    let span = ["", "@10..90%", "@0.5..s"][usize::from(mode >> 3) % 3];
    reading::read("csv", bytes, span, &layout);
});
