//! `backlash`: a play of width `gap`. After a reversal the motor crosses the gap and does not feel
//! what lies behind it: c sgn(v) is missing until the gap is used up, a fixed distance.

use super::entry::{Entry, Family, Key, Ladder, Search};
use super::law::{Law, Memory};
use super::law_text::exact;
use super::physics::{Limit, Number, Rule};
use super::signal::CurveSignal;
use super::unit::Unit;
use crate::robot::friction::sign;

pub static ENTRY: Entry = Entry {
    name: "backlash",
    families: &[Family::Memory],
    keys: &[
        Key::shape("gap", Unit::Position).above_zero("must be above 0"),
        Key::size("c", Unit::Torque),
    ],
    search: Search::Refined,
    must: &[
        Rule::at_most(
            Number::Key("gap"),
            Limit::Backlash,
            "the play of a gear is at most 0.03 rad or 2 mm, of a harmonic or direct drive none, or what \
             [drive] declares",
        ),
        Rule::not_negative("c", "play takes torque away, and adds none"),
    ],
    otherwise: Some(CurveSignal::Way),
    ladder: Some(Ladder::NARROW),
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
        let joint = cover.at(place);
        if joint.reversals < 4 {
            return Err("fewer than four reversals".into());
        }
        let shares = [0.001, 0.003, 0.01, 0.02, 0.05, 0.1];
        Ok(shares.map(|s| vec![s * joint.range()]).to_vec())
    },
    limits: |cover, place| {
        let range = cover.at(place).range();
        vec![[1e-4 * range, 0.3 * range]]
    },
    memory: Some(Memory {
        size: 1,
        step: |scene, place, shape, _, far, out| {
            let Some(j) = place.joint() else { return };
            let (q, v) = (scene.stretch.q[j][0], scene.stretch.v[j][0]);
            if far[0].is_nan() {
                far[0] = q;
            }
            out[0] = missing(0.5 * shape[0], q, v, &mut far[0]);
        },
    }),
    code: Some(|to| {
        let (q, v, i) = (to.q(), to.v(), to.number());
        let own = to.remember("far", None, &q, &q);
        let (next, half) = (format!("far_side_{i}"), exact(0.5 * to.shape()[0]));
        to.line(format!(
            "let {next} = $within({own}, {q} - {half}, {q} + {half});"
        ));
        to.step(format!(
            "{} * ($same({next}, {own}) * -$sign({v}))",
            to.x(0)
        ));
        to.line(format!("{own} = {next};"));
    }),
    ..Law::linear(&ENTRY, &["c"], |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let s = scene.stretch;
        let mut far = s.q[j].first().copied().unwrap_or(0.0);
        for (k, (q, v)) in s.q[j].iter().zip(&s.v[j]).enumerate() {
            out[0][k] = missing(0.5 * shape[0], *q, *v, &mut far);
        }
    })
};

/// -sgn(v) inside the gap. `far` is where its far side stands: a play operator.
fn missing(half: f64, q: f64, v: f64, far: &mut f64) -> f64 {
    let before = *far;
    *far = far.clamp(q - half, q + half);
    let carried = *far != before;
    if carried { 0.0 } else { -sign(v) }
}
