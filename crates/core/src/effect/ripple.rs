//! `ripple`: torque that repeats with position and does not flip with direction. Each harmonic is an
//! effect of its own order.

use super::order::{order_limits, orders};
use super::{Entry, Family, Key, Ladder, Law, Search, Unit};

/// The sine or cosine part of a harmonic.
const fn amplitude(name: &'static str) -> Key {
    Key::size(name, Unit::Torque)
}

pub static ENTRY: Entry = Entry {
    name: "ripple",
    families: &[Family::Position],
    keys: &[
        Key::shape("order", Unit::Order),
        amplitude("sin"),
        amplitude("cos"),
        amplitude("sin2"),
        amplitude("cos2"),
        amplitude("sin3"),
        amplitude("cos3"),
    ],
    search: Search::Orders,
    ladder: Some(Ladder::USUAL),
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
