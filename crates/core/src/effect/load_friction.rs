//! `load-friction`: friction that grows with the load, (mu_c + mu_v |v|) |tau_l| tanh(w v)
//! (Hamon, Gautier and Garrec 2010).

use super::{
    CurveSignal, Entry, Family, Key, Law, Limit, LimitedNumber, Rule, ShapeSearch, ShapeSpan, Unit,
};
use crate::math::hyperbolic::tanh;
use crate::number;

pub static ENTRY: Entry = Entry {
    name: "load-friction",
    families: &[Family::Load],
    keys: &[
        Key::size("mu_c", Unit::One),
        Key::size("mu_v", Unit::Slope),
        Key::shape("w", Unit::Slope),
    ],
    search: ShapeSearch::Refined,
    // mu_v may be negative as long as the load still rubs at top speed
    must: &[
        Rule::not_negative("mu_c", LOADED),
        Rule::at_least(
            LimitedNumber::AtTopSpeed("mu_c", "mu_v"),
            Limit::Is(0.0),
            LOADED,
        ),
    ],
    otherwise: Some(CurveSignal::Load),
    friction: true,
    separate_by: "log the same path at the same speed with and without a known payload",
    formula: "(mu_c + mu_v abs(v)) abs(tau_l) tanh(w v)",
    source: "gear teeth and bearings under load (Hamon, Gautier and Garrec 2010)",
    said: |f| {
        format!(
            "gear of {} that rubs more under load, by {} of it",
            f.at,
            number::percent(f.value("mu_c"))
        )
    },
    remedy: "use the refined model wherever the load changes; check gear and bearings for wear and lubrication",
    ..Entry::USUAL
};

/// Why its numbers are not negative.
const LOADED: &str = "teeth and bearings rub more under load";

pub static LAW: Law = Law {
    shape: &["w"],
    starts: |cover, place| {
        let lack = "fewer than two reversals: friction is not seen in both directions";
        let top = cover.reversing(place, 2, lack)?.fastest();
        Ok([10.0, 40.0, 200.0].map(|w| vec![w / top]).to_vec())
    },
    limits: |cover, place, _| {
        let top = cover.at(place).fastest();
        vec![ShapeSpan::of(4.0 / top, 2000.0 / top).open_above()]
    },
    code: Some(|to| {
        let (v, load) = (to.v(), to.load());
        to.added(format!(
            "({} + {} * fabs({v})) * (fabs({load}) * tanh({} * {v}))",
            to.x(0),
            to.x(1),
            to.s(0)
        ));
    }),
    ..Law::linear(&ENTRY, &["mu_c", "mu_v"], |at, _, out| {
        out[0] = at.load().abs() * tanh(at.shape[0] * at.v());
        out[1] = at.v().abs() * out[0];
    })
};
