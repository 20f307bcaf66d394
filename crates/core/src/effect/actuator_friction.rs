//! `actuator-friction`: friction in the actuator coordinates, tau = J' F(J v). On the CFT robot it
//! sits in the screws x_r and y_r, where the seals and nuts are, and couples q4 and q5.

use super::{Entry, Family, Key, Law, PlaceRule, ShapeSearch, ShapeSpan, SpeedLadder, Unit};
use crate::math::hyperbolic::tanh;
use crate::robot::cft::pantograph::reference_jacobian;

pub static ENTRY: Entry = Entry {
    name: "actuator-friction",
    families: &[Family::Velocity, Family::Cross],
    keys: &[
        Key::size("viscous", Unit::Fixed("N s/m")),
        Key::size("coulomb", Unit::Fixed("N")),
        Key::shape("slope", Unit::Fixed("s/m")),
    ],
    places: PlaceRule::Actuators,
    search: ShapeSearch::Refined,
    ladder: Some(SpeedLadder::USUAL),
    friction: true,
    separate_by: "move one actuator alone, both ways at several speeds, at three poses of the other",
    formula: "J_a' (viscous v_a + coulomb tanh(slope v_a)), v_a = J_a v",
    source: "seals and nuts of the screws that move two joints",
    said: |f| format!("friction of screw {}, {}", f.at, f.size("coulomb")),
    remedy: "use the refined model: the friction of the screw acts on both joints that it moves",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["slope"],
    starts: |cover, _| {
        if cover.joints.iter().all(|j| j.reversals < 2) {
            return Err("fewer than two reversals".into());
        }
        Ok([50.0, 200.0, 1000.0].map(|w| vec![w]).to_vec())
    },
    limits: |_, _, _| vec![ShapeSpan::of(10.0, 1e5).open_above()],
    code: Some(|to| {
        let [viscous, coulomb, slope] = [to.x(0), to.x(1), to.s(0)];
        to.of_screws(|speed, _| {
            format!("{viscous} * {speed} + {coulomb} * tanh({slope} * {speed})")
        });
    }),
    ..Law::linear(&ENTRY, &["viscous", "coulomb"], |at, _, out| {
        let [q, v, _] = at.state();
        let jacobian = reference_jacobian(&q);
        for r in at.place.rows() {
            let speed = jacobian[r][0] * v[2] + jacobian[r][1] * v[3];
            let share = jacobian[r][at.joint - 2];
            out[0] += share * speed;
            out[1] += share * tanh(at.shape[0] * speed);
        }
    })
};
