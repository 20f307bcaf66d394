//! `warm-up`: friction times 1 + k (1 - exp(-t/T)), t since the begin of the log.

use super::{
    Entry, Family, Key, Law, Limit, LimitedNumber, Rule, ShapeSearch, ShapeSpan, SpeedLadder, Unit,
};
use crate::number;

pub static ENTRY: Entry = Entry {
    name: "warm-up",
    families: &[Family::Slow],
    keys: &[
        Key::size("k", Unit::One).within(
            -1.0,
            f64::INFINITY,
            "must be at least -1, or friction drives the joint",
        ),
        Key::shape("T", Unit::Fixed("s")).above_zero("must be above 0 s"),
    ],
    search: ShapeSearch::Refined,
    must: &[
        Rule::at_least(
            LimitedNumber::Key("T"),
            Limit::Is(5.0),
            "no grease warms up within 5 s",
        ),
        Rule::at_most(
            LimitedNumber::Key("T"),
            Limit::Duration(3.0),
            "a log shows no warm-up that takes three times as long as itself: that is a drift",
        ),
        Rule::at_least(
            LimitedNumber::Key("k"),
            Limit::Is(-1.0),
            "friction would drive the joint",
        ),
    ],
    ladder: Some(SpeedLadder::LONG),
    friction: true,
    separate_by: "log the same segment of motion at the start and at the end of an hour",
    formula: "F(v) k (1 - exp(-t/T))",
    source: "grease that warms up",
    said: |f| {
        let k = f.value("k");
        let way = if k < 0.0 { "falls" } else { "rises" };
        format!(
            "friction of {} that {way} by {} within {}",
            f.at,
            number::percent(k.abs()),
            f.size("T")
        )
    },
    remedy: "move the arm until it is warm before logging, or log at the temperature of its work",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["T"],
    starts: |cover, place| {
        let lack = "fewer than four reversals: friction is not seen early and late";
        cover.reversing(place, 4, lack)?;
        let shares = [0.1, 0.3, 1.0, 3.0];
        Ok(shares.map(|s| vec![s * cover.duration_s]).to_vec())
    },
    limits: |cover, _, _| {
        let range = ShapeSpan::of(0.03 * cover.duration_s, 10.0 * cover.duration_s);
        vec![range]
    },
    code: Some(|to| {
        to.step(format!(
            "{} * (({}) * -expm1(-state.t / {}))",
            to.x(0),
            to.law(),
            to.s(0)
        ))
    }),
    ..Law::linear(&ENTRY, &["k"], |at, _, out| {
        let friction = at.scene.laws[at.joint].torque(at.v());
        out[0] = friction * -(-at.time() / at.shape[0]).exp_m1();
    })
};
