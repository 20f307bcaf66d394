//! `position-friction`: friction whose width changes with position, sgn(v) (sin, cos at an order):
//! it flips with the direction, a ripple does not (Remark 1 of the report). Where the joint's law is smooth at
//! rest, so is the sign.

use super::entry::{Entry, Family, Key, Ladder, Search};
use super::law::Law;
use super::law_text::exact;
use super::order::{order_limits, orders, wavenumber};
use super::physics::{Limit, Number, Rule};
use super::signal::CurveSignal;
use super::unit::Unit;

pub static ENTRY: Entry = Entry {
    name: "position-friction",
    families: &[Family::Position],
    keys: &[
        Key::shape("order", Unit::Order),
        Key::size("sin", Unit::Torque),
        Key::size("cos", Unit::Torque),
    ],
    search: Search::Orders,
    must: &[Rule::at_most(
        Number::Amplitude("sin", "cos"),
        Limit::Coulomb(1.0),
        "with more than the joint's Coulomb friction it would drive the joint",
    )],
    otherwise: Some(CurveSignal::Friction),
    ladder: Some(Ladder::USUAL),
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
        if !cover.at(place).both_ways() {
            return Err("the joint moves in one direction only: move it both ways".into());
        }
        orders(cover, place, &cover.at(place).friction_orders)
    },
    limits: order_limits,
    code: Some(|to| {
        let wave = wavenumber(to.robot(), to.joint(), to.shape()[0]);
        let angle = format!("{} * {}", exact(wave), to.q());
        let sum = format!("{} * sin({angle}) + {} * cos({angle})", to.x(0), to.x(1));
        to.added(format!("{} * ({sum})", to.direction()));
    }),
    ..Law::linear(&ENTRY, &["sin", "cos"], |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let per_unit = wavenumber(scene.robot, j, shape[0]);
        for (k, q) in scene.stretch.q[j].iter().enumerate() {
            let (s, c) = (per_unit * q).sin_cos();
            let direction = scene.direction(j, k);
            out[0][k] = direction * s;
            out[1][k] = direction * c;
        }
    })
};
