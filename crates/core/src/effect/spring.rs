//! `spring`: k (q - q0) + k3 (q - q0)^3.

use super::{Entry, Family, Key, Law, Rule, ShapeSearch, ShapeSpan, SpeedLadder, Unit};

pub static ENTRY: Entry = Entry {
    name: "spring",
    // where its rest point lies is a constant torque
    families: &[Family::Position, Family::Offset],
    keys: &[
        Key::size("k", Unit::Stiffness),
        Key::shape("q0", Unit::Position),
        Key::size("k3", Unit::Cubic).or_zero(),
    ],
    search: ShapeSearch::Refined,
    must: &[Rule::not_negative(
        "k",
        "a spring pulls back; a torque that falls with the position is a weight",
    )],
    ladder: Some(SpeedLadder::USUAL),
    separate_by: "log a slow sweep over the whole travel with two payloads (gravity scales, a spring \
                  does not)",
    formula: "k (q - q0) + k3 (q - q0)^3",
    source: "a cable, a hose or a return spring",
    at_rest: true,
    said: |f| format!("spring on {}, {}", f.at, f.size("k")),
    remedy: "look for a cable, a hose or a spring that pulls the joint back, and reroute it or keep the refined model",
    measurable: true,
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["q0"],
    starts: |cover, place| {
        let lack = "fewer than two reversals: a slope over position is not seen";
        let [low, high] = cover.reversing(place, 2, lack)?.position;
        let step = 0.25 * (high - low);
        Ok((-1..=5).map(|i| vec![low + f64::from(i) * step]).collect())
    },
    limits: |cover, place, _| {
        let [low, high] = cover.at(place).position;
        // a spring that is at rest far outside the travel is hardly more than an offset
        let beyond = 0.25 * (high - low);
        let range = ShapeSpan::of(low - beyond, high + beyond);
        vec![range.open_below().open_above()]
    },
    code: Some(|to| {
        let way = format!("({} - {})", to.q(), to.s(0));
        to.added(format!(
            "{} * {way} + {} * ({way} * {way} * {way})",
            to.x(0),
            to.x(1)
        ));
    }),
    ..Law::linear(&ENTRY, &["k", "k3"], |at, _, out| {
        let x = at.q() - at.shape[0];
        (out[0], out[1]) = (x, x * x * x);
    })
};
