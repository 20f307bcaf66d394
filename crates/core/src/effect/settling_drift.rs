//! `settling-drift`: a torque that drifts from the begin of a log and settles, level (1 - exp(-t/T)), in both directions.
//! A drift that goes on over the log is `drift`, with one number less.

use super::{Entry, Family, Key, Law, ShapeSearch, ShapeSpan, Unit};

pub static ENTRY: Entry = Entry {
    name: "settling-drift",
    families: &[Family::Slow],
    keys: &[
        Key::torque("level"),
        Key::shape("T", Unit::Fixed("s")).above_zero("must be above 0 s"),
    ],
    search: ShapeSearch::Refined,
    separate_by: "hold the joint still at one pose from the start of a log until the torque stands",
    formula: "level (1 - exp(-t/T))",
    source: "a torque sensor or an amplifier that warms up and stays warm",
    at_rest: true,
    said: |f| {
        format!(
            "torque of {} that drifts by {} and settles within {}",
            f.at,
            f.size("level"),
            f.size("T")
        )
    },
    remedy: "switch the sensor or the amplifier on some minutes before each log, then zero it",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["T"],
    starts: |cover, _| {
        let shares = [0.05, 0.1, 0.2, 0.4, 0.8];
        Ok(shares.map(|s| vec![s * cover.duration_s]).to_vec())
    },
    // one that does not settle within the log is a drift, one that is over at once an offset
    limits: |cover, _, _| {
        vec![ShapeSpan::of(
            0.02 * cover.duration_s,
            2.0 * cover.duration_s,
        )]
    },
    code: Some(|to| to.step(format!("{} * -expm1(-state.t / {})", to.x(0), to.s(0)))),
    ..Law::linear(&ENTRY, &["level"], |at, _, out| {
        out[0] = -(-at.time() / at.shape[0]).exp_m1();
    })
};
