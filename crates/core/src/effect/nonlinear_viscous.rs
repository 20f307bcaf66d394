//! `nonlinear-viscous`: friction that bends with speed, c sgn(v) |v|^p.

use super::entry::{Entry, Family, Key, Ladder, Search};
use super::law::Law;
use super::signal::CurveSignal;
use super::unit::Unit;
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
    search: Search::Refined,
    ladder: Some(Ladder::USUAL),
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
        if cover.at(place).reversals < 2 {
            return Err("fewer than two reversals: friction is not seen in both directions".into());
        }
        Ok([0.35, 0.5, 0.7, 1.6, 2.0, 2.5].map(|p| vec![p]).to_vec())
    },
    limits: |_, _| vec![[0.3, 3.0]],
    code: Some(|to| {
        let v = to.v();
        to.friction(format!(
            "{} * ($sign({v}) * pow(fabs({v}), {}))",
            to.x(0),
            to.s(0)
        ));
    }),
    ..Law::linear(&ENTRY, &["c"], |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        for (x, v) in out[0].iter_mut().zip(&scene.stretch.v[j]) {
            *x = sign(*v) * v.abs().powf(shape[0]);
        }
    })
};
