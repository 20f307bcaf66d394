//! `ripple`: torque that repeats with position and does not flip with direction. Each harmonic is an
//! effect of its own order.

use super::order::{order_limits, orders};
use super::{Entry, Family, Key, Law, ShapeSearch, SpeedLadder, Unit};

pub static ENTRY: Entry = Entry {
    name: "ripple",
    families: &[Family::Position],
    keys: &[
        Key::shape("order", Unit::Order),
        Key::torque("sin"),
        Key::torque("cos"),
        Key::torque("sin2"),
        Key::torque("cos2"),
        Key::torque("sin3"),
        Key::torque("cos3"),
    ],
    search: ShapeSearch::Orders,
    ladder: Some(SpeedLadder::USUAL),
    separate_by: "log the same stretch of travel at two constant speeds (the order stays, the \
                  frequency moves)",
    formula: "sin sin(order q) + cos cos(order q), and harmonics 2 and 3",
    source: "cogging of a motor, teeth of a gear, an eccentric encoder",
    at_rest: true,
    said: |f| format!("ripple of {}, {}, {}", f.at, f.wave(), f.amplitude()),
    remedy: "compare its period with the parts of the drive that repeat, such as motor poles, gear teeth and bearings; compensate it over position with the refined model",
    measurable: true,
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["order"],
    starts: |cover, place| orders(cover, place, &cover.at(place).ripple_orders),
    limits: order_limits,
    code: Some(|to| to.added(to.wave())),
    ..Law::linear(&ENTRY, &["sin", "cos"], |at, _, out| {
        (out[0], out[1]) = at.wave()
    })
};
