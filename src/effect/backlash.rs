//! `backlash`: a play of width `gap`. After a reversal the motor crosses the gap and does not feel
//! what lies behind it: c sgn(v) is missing until the gap is used up, a fixed distance.

use super::entry::{Entry, Family, Key, Ladder, Search};
use super::law::Law;
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
    ladder: Some(Ladder::NARROW),
    separate_by: "reversals with a ladder of amplitudes: a gap keeps its width, a presliding loop \
                  shrinks with the amplitude",
    formula: "-c sgn(v) inside the play operator's gap",
    source: "play between gear teeth: what lies behind it is not felt until it is used up",
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
    ..Law::linear(&ENTRY, &["c"], |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let s = scene.stretch;
        let half = 0.5 * shape[0];
        // play operator: where the far side of the gap stands
        let mut far = s.q[j].first().copied().unwrap_or(0.0);
        for (k, (q, v)) in s.q[j].iter().zip(&s.v[j]).enumerate() {
            let before = far;
            far = far.clamp(q - half, q + half);
            let carried = far != before;
            if !carried {
                out[0][k] = -sign(*v);
            }
        }
    })
};
