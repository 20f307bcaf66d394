//! `drift`: a torque that grows with time, c t, in both directions.

use super::{Entry, Family, Key, Law, Unit};

pub static ENTRY: Entry = Entry {
    name: "drift",
    families: &[Family::Slow],
    keys: &[
        Key::size("c", Unit::TorqueRate),
        Key::size("walk", Unit::TorqueWalk),
    ],
    separate_by: "hold the joint still at one pose at the start and at the end of the log",
    formula: "c t + a random walk of rms walk sqrt(t)",
    source: "a torque sensor or an amplifier that warms up",
    at_rest: true,
    said: |f| format!("torque of {} that drifts by {}", f.at, f.size("c")),
    remedy: "zero the sensor or the amplifier before each log, and let it warm up",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    code: Some(|to| to.step(format!("{} * state.t", to.x(0)))),
    ..Law::linear(&ENTRY, &["c"], |at, _, out| out[0] = at.time())
};
