//! `position-friction`: friction whose width changes with position, sgn(v) (sin, cos at an order):
//! it flips with the direction, a ripple does not (Remark 1 of the report). Where the joint's law is smooth at
//! rest, so is the sign.

use super::order::{order_limits, orders};
use super::{
    CurveSignal, Entry, Family, Key, Law, Limit, LimitedNumber, Rule, ShapeSearch, ShapeSpan,
    SpeedLadder, Unit,
};

pub static ENTRY: Entry = Entry {
    name: "position-friction",
    families: &[Family::Position],
    keys: &[
        Key::shape("order", Unit::Order),
        Key::torque("sin"),
        Key::torque("cos"),
    ],
    search: ShapeSearch::Orders,
    must: &[Rule::at_most(
        LimitedNumber::Amplitude("sin", "cos"),
        Limit::Coulomb(1.0),
        "with more than the joint's Coulomb friction it would drive the joint",
    )],
    otherwise: Some(CurveSignal::Friction),
    ladder: Some(SpeedLadder::USUAL),
    friction: true,
    separate_by: "log the same stretch of travel in both directions at one speed",
    formula: "sgn(v) (sin sin(order q) + cos cos(order q))",
    source: "a bent screw or an eccentric gear that rubs more at some positions (Remark 1 of the \
               report)",
    said: |f| {
        format!(
            "friction of {} that changes along its way, {}, {}",
            f.at,
            f.wave(),
            f.amplitude()
        )
    },
    remedy: "look for a bent screw, an eccentric gear or a tight seal where friction is highest",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["order"],
    starts: |cover, place| {
        let joint = cover.both_ways(place)?;
        orders(cover, place, &joint.friction_orders)
    },
    // below the orders that the travel covers friction still goes by the position: no other law begins there
    limits: |cover, place, shape| {
        let orders = order_limits(cover, place, shape).into_iter();
        orders.map(ShapeSpan::open_below).collect()
    },
    code: Some(|to| {
        to.added(format!("{} * ({})", to.direction(), to.wave()));
    }),
    ..Law::linear(&ENTRY, &["sin", "cos"], |at, _, out| {
        let wave = at.wave();
        (out[0], out[1]) = (at.direction() * wave.0, at.direction() * wave.1);
    })
};
