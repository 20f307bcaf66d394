//! `nonlinear-viscous`: friction that bends with speed, c sgn(v) |v|^p.

use super::{CurveSignal, Entry, Family, Key, Law, ShapeSearch, ShapeSpan, SpeedLadder, Unit};
use crate::number;
use crate::robot::friction::sign;

pub static ENTRY: Entry = Entry {
    name: "nonlinear-viscous",
    families: &[Family::Velocity],
    keys: &[
        Key::size("c", Unit::Power),
        Key::shape("p", Unit::One).within(
            0.1,
            5.0,
            "must lie in 0.1..5; 0 is `asymmetric-friction` or Coulomb friction",
        ),
    ],
    search: ShapeSearch::Refined,
    ladder: Some(SpeedLadder::USUAL),
    friction: true,
    otherwise: Some(CurveSignal::Speed),
    separate_by: "log constant speeds, both ways, up to the top speed",
    formula: "c sgn(v) abs(v)^p",
    source: "lubricants that shear thin, or churn at speed",
    said: |f| {
        format!(
            "viscous friction of {} that bends with speed (power {})",
            f.at,
            number::significant(f.value("p"), 2)
        )
    },
    remedy: "use the refined model for fast motion, and log the joint up to its top speed",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["p"],
    starts: |cover, place| {
        let lack = "fewer than two reversals: friction is not seen in both directions";
        cover.reversing(place, 2, lack)?;
        Ok([0.35, 0.5, 0.7, 1.6, 2.0, 2.5].map(|p| vec![p]).to_vec())
    },
    // about 1 it is viscous friction, which every model declares
    limits: |_, _, shape| {
        vec![match shape[0] < 1.0 {
            true => ShapeSpan::of(0.3, 0.8),
            false => ShapeSpan::of(1.5, 3.0),
        }]
    },
    code: Some(|to| {
        let v = to.v();
        to.friction(format!(
            "{} * ($sign({v}) * pow(fabs({v}), {}))",
            to.x(0),
            to.s(0)
        ));
    }),
    ..Law::linear(&ENTRY, &["c"], |at, _, out| {
        out[0] = sign(at.v()) * at.v().abs().powf(at.shape[0]);
    })
};
