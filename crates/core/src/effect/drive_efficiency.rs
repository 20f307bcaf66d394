//! `drive-efficiency`: a loss in proportion to the load while the motor drives it, k tau_l H(tau_l v).

use super::{CurveSignal, Entry, Family, Key, Law, Limit, LimitedNumber, Rule, Unit};
use crate::number;

pub static ENTRY: Entry = Entry {
    name: "drive-efficiency",
    families: &[Family::Load],
    keys: &[Key::size("k", Unit::One).within(
        -0.9,
        9.0,
        "must lie in -0.9..9 (k = 1/efficiency - 1)",
    )],
    must: &[
        Rule::not_negative("k", LOSS),
        Rule::at_most(LimitedNumber::Key("k"), Limit::Is(0.6), LOSS),
    ],
    otherwise: Some(CurveSignal::Load),
    friction: true,
    separate_by: "lift and lower a known payload at the same speeds",
    formula: "k tau_l H(tau_l v)",
    source: "a gear or screw that loses part of the power while it drives the load",
    said: |f| {
        format!(
            "gear of {} that loses {} of the torque while it drives the load",
            f.at,
            number::percent(f.value("k").abs())
        )
    },
    remedy: "use the refined model wherever the load changes; a worn or dry gear loses more",
    ..Entry::USUAL
};

/// Why k lies where it does.
const LOSS: &str = "efficiencies lie between 0.63 and 1";

pub static LAW: Law = Law {
    starts: |cover, place| cover.both_ways(place).map(|_| vec![Vec::new()]),
    code: Some(|to| {
        let (v, load) = (to.v(), to.load());
        to.added(format!("{} * ({load} * $positive({load} * {v}))", to.x(0)));
    }),
    ..Law::linear(&ENTRY, &["k"], |at, _, out| {
        if at.load() * at.v() > 0.0 {
            out[0] = at.load();
        }
    })
};
