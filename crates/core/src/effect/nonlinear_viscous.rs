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

/// How near to 1 a power may come: there it bends beside viscous friction as v ln v does, to a thousandth, and its size and
/// the viscous friction, which cancel, are twenty times the bend.
const BESIDE_VISCOUS: f64 = 0.05;

pub static LAW: Law = Law {
    shape: &["p"],
    starts: |cover, place| {
        let lack = "fewer than two reversals: friction is not seen in both directions";
        cover.reversing(place, 2, lack)?;
        Ok([0.35, 0.5, 0.7, 1.6, 2.0, 2.5].map(|p| vec![p]).to_vec())
    },
    // at 1 it is viscous friction, which every model declares; beside that the bend towards 1 is the one of v ln v
    // whatever the power is, and a power at the end next to it a bound
    limits: |_, _, shape| {
        vec![match shape[0] < 1.0 {
            true => ShapeSpan::of(0.3, 1.0 - BESIDE_VISCOUS).open_above(),
            // churning at speed takes the square
            false => ShapeSpan::of(1.0 + BESIDE_VISCOUS, 3.0)
                .open_below()
                .by_physics(2.0),
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A torque over speeds up to 2 rad/s beside viscous and Coulomb friction, of length 1.
    fn beside_declared(torque: impl Fn(f64) -> f64) -> DVector<f64> {
        let speeds: Vec<f64> = (1..=200).map(|k| 0.01 * f64::from(k)).collect();
        let declared = DMatrix::from_fn(200, 2, |k, c| if c == 0 { speeds[k] } else { 1.0 });
        let column = DVector::from_iterator(200, speeds.iter().map(|v| torque(*v)));
        let fit = declared.clone().svd(true, true).solve(&column, 1e-12);
        (column - declared * fit.unwrap()).normalize()
    }

    #[test]
    fn beside_viscous_friction_the_powers_next_to_1_bend_as_v_ln_v_does() {
        let bend = beside_declared(|v| v * v.ln());
        for p in [1.0 - BESIDE_VISCOUS, 1.0 + BESIDE_VISCOUS] {
            let off = 1.0 - beside_declared(|v| v.powf(p)).dot(&bend).abs();
            assert!(off < 1e-3, "{p}: {off}");
        }
        // further off they do not
        assert!(1.0 - beside_declared(|v| v.powf(0.5)).dot(&bend).abs() > 1e-2);
    }
}
