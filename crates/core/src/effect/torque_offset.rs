//! `torque-offset`: a constant torque, in both directions and at standstill.

use super::{Entry, Family, Key, Law, SpeedLadder};

pub static ENTRY: Entry = Entry {
    name: "torque-offset",
    families: &[Family::Offset],
    keys: &[Key::torque("c")],
    ladder: Some(SpeedLadder::USUAL),
    separate_by: "hold the joint still at several poses under brake-free control, then move it \
                  both ways at three or more constant speeds",
    formula: "c",
    source: "bias of a torque sensor or of an amplifier",
    at_rest: true,
    said: |f| format!("constant torque of {} on {}", f.size("c"), f.at),
    remedy: "zero the torque sensor or the amplifier while the joint is unloaded, and log again",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    code: Some(|to| to.added(to.x(0))),
    ..Law::linear(&ENTRY, &["c"], |_, _, out| out[0] = 1.0)
};
