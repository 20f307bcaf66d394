//! `gain-change`: a torque constant that is another one later, or at a high current: what is logged is
//! 1 + k (1 - exp(-x/scale)) times the torque that acts, x the time since the log began (signal 1) or the size of
//! that torque (signal 2). A fit absorbs a constant gain, and not one that changes along the log.

use super::{CodeSite, Entry, Family, Instant, Key, Law, ShapeSearch, ShapeSpan, Unit};
use crate::number;

pub static ENTRY: Entry = Entry {
    name: "gain-change",
    families: &[Family::Slow, Family::Load],
    keys: &[
        Key::shape("signal", Unit::One).within(1.0, 2.0, "must be 1 (time) or 2 (torque)"),
        Key::shape("scale", Unit::Signal).above_zero("must be above 0"),
        Key::size("k", Unit::One).within(-0.9, 9.0, "must lie in -0.9..9"),
    ],
    search: ShapeSearch::Refined,
    separate_by: "hold a known weight still at the start and at the end of a log, and hold two weights of which one \
                  takes near the highest current",
    formula: "k (1 - exp(-x/scale)) times the acting torque, x the time (signal 1) or the size of that torque (signal 2)",
    source: "magnets that lose field as they warm up, iron that saturates at high current",
    at_rest: true,
    said: |f| {
        let (k, scale) = (f.value("k"), f.size("scale"));
        let way = if k > 0.0 { "falls" } else { "rises" };
        let share = number::percent(1.0 - 1.0 / (1.0 + k));
        let share = share.trim_start_matches('-');
        let by = match is_time(f.value("signal")) {
            true => format!("over time, with a time constant of {scale}"),
            false => format!("with the current, at torques well above {scale}"),
        };
        format!("torque constant of {} that {way} by {share} {by}", f.at)
    },
    remedy: "let the drive reach the temperature of its work before logging, and stay below the current at which it \
             saturates; or use the refined model",
    measurable: true,
    ..Entry::USUAL
};

const TIME: f64 = 1.0;
const TORQUE: f64 = 2.0;

fn is_time(signal: f64) -> bool {
    signal < 1.5
}

pub static LAW: Law = Law {
    shape: &["scale", "signal"],
    starts: |cover, place| {
        let peak = cover.at(place).torque;
        if peak <= 0.0 {
            return Err("no torque is logged".into());
        }
        let over_time = [0.1, 0.3, 1.0, 3.0].map(|s| vec![s * cover.duration_s, TIME]);
        let by_torque = [0.3, 1.0, 3.0, 10.0].map(|s| vec![s * peak, TORQUE]);
        Ok([over_time, by_torque].concat())
    },
    limits: |cover, place, shape| {
        let unit = match is_time(shape[1]) {
            true => cover.duration_s,
            false => cover.at(place).torque,
        };
        // far beyond the data it grows straight
        vec![ShapeSpan::of(0.03 * unit, 10.0 * unit).open_above()]
    },
    varied: Some(|shape| match is_time(shape[1]) {
        true => (Family::Slow, true),
        false => (Family::Load, true),
    }),
    signal_unit: Some(|shape| match is_time(shape[1]) {
        true => Unit::Fixed("s"),
        false => Unit::Torque,
    }),
    code: Some(|to| {
        let torque = to.acting();
        let of = |x: &str| format!("{} * ({torque} * -expm1(-{x} / {}))", to.x(0), to.s(0));
        match is_time(to.shape[1]) {
            true => to.step(of("state.t")),
            false => {
                let plain = torque.strip_prefix('(').and_then(|x| x.strip_suffix(')'));
                to.added(of(&format!("fabs({})", plain.unwrap_or(&torque))))
            }
        }
    }),
    ..Law::linear(&ENTRY, &["k"], |at, _, out| {
        let x = match is_time(at.shape[1]) {
            true => at.time(),
            false => at.acting().abs(),
        };
        out[0] = at.acting() * -(-x / at.shape[0]).exp_m1();
    })
};

impl Instant<'_> {
    /// Torque of links, drives and declared friction.
    pub(super) fn acting(&self) -> f64 {
        self.scene.hat[self.joint][self.k]
    }
}

impl CodeSite<'_> {
    /// Torque of links, drives and declared friction.
    pub(super) fn acting(&self) -> String {
        format!("({} + ({} + {}))", self.load(), self.law(), self.offset())
    }
}
