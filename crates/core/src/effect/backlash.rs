//! `backlash`: a play of width `gap`. After a reversal the motor crosses the gap and does not feel
//! what lies behind it: c sgn(v) is missing until the gap is used up, a fixed distance.

use super::{
    CurveSignal, Entry, Family, Key, Law, Limit, LimitedNumber, Rule, ShapeSearch, ShapeSpan,
    SpeedLadder, Unit, exact,
};
use crate::robot::friction::sign;

pub static ENTRY: Entry = Entry {
    name: "backlash",
    families: &[Family::Memory],
    keys: &[
        Key::shape("gap", Unit::Position).above_zero("must be above 0"),
        Key::torque("c"),
    ],
    search: ShapeSearch::Refined,
    must: &[
        Rule::at_most(
            LimitedNumber::Key("gap"),
            Limit::Backlash,
            "the play of a gear is at most 0.03 rad or 2 mm, of a harmonic or direct drive none, or what \
             [drive] declares",
        ),
        Rule::not_negative("c", "play takes torque away, and adds none"),
    ],
    otherwise: Some(CurveSignal::Way),
    ladder: Some(SpeedLadder::NARROW),
    separate_by: "log reversals at several amplitudes (a gap keeps its width, a presliding loop shrinks \
                  with the amplitude)",
    formula: "-c sgn(v) inside the play operator's gap",
    source: "play between gear teeth: what lies behind it is not felt until it is used up",
    said: |f| format!("play in the gear of {}, {} wide", f.at, f.size("gap")),
    remedy: "check gear and coupling for play, preload them, or come to a position from one side",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["gap"],
    starts: |cover, place| {
        let joint = cover.reversing(place, 4, "fewer than four reversals")?;
        let shares = [0.001, 0.003, 0.01, 0.02, 0.05, 0.1];
        Ok(shares.map(|s| vec![s * joint.range()]).to_vec())
    },
    limits: |cover, place, _| {
        let range = cover.at(place).range();
        vec![ShapeSpan::of(1e-4 * range, 0.3 * range)]
    },
    // where the far side of the gap stands: a play operator
    memory: Some(1),
    code: Some(|to| {
        let (q, v, i) = (to.q(), to.v(), to.number);
        let own = to.remember("far", None, &q, &q);
        let (next, half) = (format!("far_side_{i}"), exact(0.5 * to.shape[0]));
        to.line(format!(
            "let {next} = $within({own}, {q} - {half}, {q} + {half});"
        ));
        to.step(format!(
            "{} * ($same({next}, {own}) * -$sign({v}))",
            to.x(0)
        ));
        to.line(format!("{own} = {next};"));
    }),
    ..Law::linear(&ENTRY, &["c"], |at, far, out| {
        let (q, half) = (at.q(), 0.5 * at.shape[0]);
        let before = if far[0].is_nan() { q } else { far[0] };
        far[0] = before.clamp(q - half, q + half);
        let carried = far[0] != before;
        out[0] = if carried { 0.0 } else { -sign(at.v()) };
    })
};
