//! `torque-ripple`: ripple in proportion to the torque, as of a motor whose current meets its magnets unevenly: what
//! is logged is 1 + sin sin(order q) + cos cos(order q) times the torque that acts. Cogging, which is there without a
//! current, is `ripple`.

use super::order::{order_limits, orders};
use super::{Entry, Family, Key, Law, ShapeSearch, SpeedLadder, Unit};
use crate::number;

pub static ENTRY: Entry = Entry {
    name: "torque-ripple",
    families: &[Family::Position, Family::Load],
    keys: &[
        Key::shape("order", Unit::Order),
        Key::size("sin", Unit::One),
        Key::size("cos", Unit::One),
    ],
    search: ShapeSearch::Orders,
    ladder: Some(SpeedLadder::USUAL),
    separate_by: "log the same stretch of travel with two payloads (it grows with the torque, cogging does not)",
    formula: "(sin sin(order q) + cos cos(order q)) times the acting torque",
    source: "currents that are no pure sines, or a current sensor that is off in one phase (Jahns and Soong 1996)",
    at_rest: true,
    said: |f| {
        let share = f.value("sin").hypot(f.value("cos"));
        format!(
            "ripple of {} in proportion to its torque, {}, {} of it",
            f.at,
            f.wave(),
            number::percent(share)
        )
    },
    remedy: "calibrate the current sensors and the angle of commutation of the drive; compensate it with the refined model",
    measurable: true,
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["order"],
    starts: |cover, place| orders(cover, place, &cover.at(place).torque_orders),
    limits: order_limits,
    code: Some(|to| to.added(format!("{} * ({})", to.acting(), to.wave()))),
    ..Law::linear(&ENTRY, &["sin", "cos"], |at, _, out| {
        let (sin, cos) = at.wave();
        (out[0], out[1]) = (at.acting() * sin, at.acting() * cos);
    })
};
