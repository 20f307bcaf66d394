//! `counterbalance`: a smooth moment over position, as of a spring or gas cylinder between two fixed
//! points, as a cubic B-spline over the travel that was seen; constant beyond it.

use super::{
    CurveSignal, Entry, Family, Key, Law, Limit, LimitedNumber, Rule, ShapeSearch, SpeedLadder,
    Unit, exact,
};
use crate::robot::JointKind;

/// Coefficients of the spline.
const COUNT: usize = 6;

pub static ENTRY: Entry = Entry {
    name: "counterbalance",
    families: &[Family::Position],
    keys: &[
        Key::size("stiffness", Unit::Fixed("N/m")),
        Key::shape("free_length", Unit::Fixed("m")),
        Key::shape("a", Unit::Fixed("m")),
        Key::shape("b", Unit::Fixed("m")),
        Key::shape("angle", Unit::Fixed("rad")),
        Key::shape("from", Unit::Position),
        Key::shape("to", Unit::Position),
        Key::torque("m_1"),
        Key::torque("m_2"),
        Key::torque("m_3"),
        Key::torque("m_4"),
        Key::torque("m_5"),
        Key::torque("m_6"),
    ],
    search: ShapeSearch::Grid,
    must: &[Rule::at_least(
        LimitedNumber::Weight,
        Limit::Is(1.0),
        "the joint carries no weight that a counterbalance would carry",
    )],
    otherwise: Some(CurveSignal::Position),
    ladder: Some(SpeedLadder::USUAL),
    separate_by: "log a slow sweep over the whole travel, both ways, with two payloads",
    formula: "d/dq of stiffness (l - free_length)^2/2, l between points at a and b from the \
                axis; or a cubic B-spline on three pieces between from and to",
    source: "a spring or gas cylinder between two fixed points",
    at_rest: true,
    said: |f| format!("counterbalance of {}, {}", f.at, f.size("stiffness")),
    remedy: "use the refined model; it holds the spring or gas cylinder that carries the joint",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["from", "to"],
    // a lever that turns
    fits: |robot, _, place| place.kind(robot) == JointKind::Revolute,
    starts: |cover, place| {
        let joint = cover.reversing(place, 4, "fewer than four sweeps over the travel")?;
        Ok(vec![joint.position.to_vec()])
    },
    code: Some(|to| {
        let width = (to.shape[1] - to.shape[0]).max(f64::MIN_POSITIVE);
        let moments: Vec<String> = to.linear.iter().copied().map(exact).collect();
        to.added(format!(
            "$spline(({} - {}) / {}, {})",
            to.q(),
            to.s(0),
            exact(width),
            moments.join(", ")
        ));
    }),
    ..Law::linear(
        &ENTRY,
        &["m_1", "m_2", "m_3", "m_4", "m_5", "m_6"],
        |at, _, out| {
            let [from, to] = [at.shape[0], at.shape[1]];
            let width = (to - from).max(f64::MIN_POSITIVE);
            let pieces = (COUNT - 3) as f64;
            let x = ((at.q() - from) / width * pieces).clamp(0.0, pieces);
            let piece = (x as usize).min(COUNT - 4);
            out[piece..piece + 4].copy_from_slice(&basis(x - piece as f64));
        },
    )
};

/// The four uniform cubic B-splines on one piece, u in 0..1; they sum to 1.
fn basis(u: f64) -> [f64; 4] {
    let w = 1.0 - u;
    [
        w * w * w / 6.0,
        (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
        (3.0 * w * w * w - 6.0 * w * w + 4.0) / 6.0,
        u * u * u / 6.0,
    ]
}

#[cfg(test)]
mod tests {
    use super::basis;

    #[test]
    fn the_splines_share_out_one_and_join_smoothly() {
        for k in 0..=10 {
            let sum: f64 = basis(f64::from(k) / 10.0).iter().sum();
            assert!((sum - 1.0).abs() < 1e-15);
        }
        let (end, next) = (basis(1.0), basis(0.0));
        for i in 0..3 {
            assert!((end[i + 1] - next[i]).abs() < 1e-15);
        }
    }
}
