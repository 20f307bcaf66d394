//! `stribeck`: friction that falls at low speed, c sgn(v) exp(-(v/vs)^2) (Armstrong-Helouvry,
//! Dupont and Canudas de Wit 1994), where the declared law has no such term.

use super::{
    CurveSignal, Entry, Family, Key, Law, Limit, LimitedNumber, Rule, ShapeSearch, ShapeSpan,
    SpeedLadder, Unit, jumps_or_is_none,
};
use crate::robot::friction::sign;

pub static ENTRY: Entry = Entry {
    name: "stribeck",
    families: &[Family::Velocity],
    keys: &[
        Key::torque("c"),
        Key::shape("vs", Unit::Speed).above_zero("must be above 0"),
    ],
    search: ShapeSearch::Refined,
    must: &[
        Rule::not_negative(
            "c",
            "Stribeck friction is higher at low speed; friction that is lower there does not jump at rest",
        ),
        Rule::at_most(
            LimitedNumber::Key("vs"),
            Limit::TopSpeed(0.3),
            "a lubricant film builds up at low speed, below 0.3 of the top speed",
        ),
    ],
    otherwise: Some(CurveSignal::Speed),
    ladder: Some(SpeedLadder::USUAL),
    friction: true,
    separate_by: "log slow constant speeds, both ways, from a hundredth of the top speed up",
    formula: "c sgn(v) exp(-(v/vs)^2)",
    source: "a lubricant film that builds up with speed (Armstrong-Helouvry, Dupont and Canudas \
               de Wit 1994)",
    said: |f| {
        format!(
            "Stribeck friction of {}, {} more near rest, gone above {}",
            f.at,
            f.size("c"),
            f.size("vs")
        )
    },
    remedy: "compensate it with the refined model where the joint creeps; warm or thinner grease lowers it",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["vs"],
    fits: jumps_or_is_none,
    starts: |cover, place| {
        let lack = "fewer than two reversals: low speeds are passed too rarely";
        let top = cover.reversing(place, 2, lack)?.fastest();
        // from half of the top speed down to a hundredth, seven steps
        let shares = [0.5, 0.3, 0.2, 0.13, 0.08, 0.04, 0.02, 0.01];
        Ok(shares.map(|s| vec![s * top]).to_vec())
    },
    limits: |cover, place, _| {
        let top = cover.at(place).fastest();
        vec![ShapeSpan::of(0.003 * top, 0.8 * top)]
    },
    code: Some(|to| {
        let v = to.v();
        let share = format!("({v} / {})", to.s(0));
        to.friction(format!(
            "{} * ($sign({v}) * exp(-({share} * {share})))",
            to.x(0)
        ));
    }),
    ..Law::linear(&ENTRY, &["c"], |at, _, out| {
        out[0] = sign(at.v()) * (-(at.v() / at.shape[0]).powi(2)).exp();
    })
};
