//! `smooth-coulomb`: friction that does not jump at rest. In place of the declared fc sgn(v) stands
//! fc tanh(v/vs) (Andersson, Soderberg and Bjorklund 2007, eq. 2).

use super::{
    CurveSignal, Entry, Family, Key, Law, Limit, LimitedNumber, Rule, ShapeSearch, ShapeSpan,
    SpeedLadder, Unit, jumps_or_is_none,
};
use crate::math::hyperbolic::tanh;
use crate::robot::friction::sign;

pub static ENTRY: Entry = Entry {
    name: "smooth-coulomb",
    families: &[Family::Velocity],
    keys: &[
        Key::shape("vs", Unit::Speed).above_zero("must be above 0"),
        Key::torque("fc"),
    ],
    search: ShapeSearch::Refined,
    friction: true,
    expected: true,
    must: &[
        Rule::not_negative("fc", "friction acts against the motion"),
        Rule::at_most(
            LimitedNumber::Key("vs"),
            Limit::TopSpeed(1.0 / 6.0),
            "Coulomb friction is reached before half of the top speed (tanh 3 = 0.995)",
        ),
    ],
    otherwise: Some(CurveSignal::Speed),
    ladder: Some(SpeedLadder::NARROW),
    separate_by: "log slow reversals at several amplitudes (friction that depends on speed stays the \
                  same, a presliding loop shrinks with the amplitude)",
    formula: "fc tanh(v/vs) for F - viscous v",
    source: "lubricated contacts and elastic seals, which creep before they slip (Andersson, Soderberg \
             and Bjorklund 2007)",
    said: |f| {
        format!(
            "Coulomb friction of {} that sets in over {} instead of at once",
            f.at,
            f.size("vs")
        )
    },
    remedy: "compensate friction with the refined model, whose torque does not jump where the joint reverses",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["vs"],
    fits: jumps_or_is_none,
    starts: |cover, place| {
        let lack = "fewer than two reversals: low speeds are passed too rarely";
        let top = cover.reversing(place, 2, lack)?.fastest();
        let shares = [0.1, 0.05, 0.02, 0.01, 0.005];
        Ok(shares.map(|s| vec![s * top]).to_vec())
    },
    limits: |cover, place, _| {
        let top = cover.at(place).fastest();
        vec![ShapeSpan::of(1e-3 * top, 0.5 * top)]
    },
    direction: Some(|shape, v| tanh(v / shape[0])),
    code: Some(|to| {
        let v = to.v();
        to.friction(format!(
            "{} * (tanh({v} / {}) - $sign({v}))",
            to.x(0),
            to.s(0)
        ));
    }),
    ..Law::linear(&ENTRY, &["fc"], |at, _, out| {
        out[0] = tanh(at.v() / at.shape[0]) - sign(at.v());
    })
};
