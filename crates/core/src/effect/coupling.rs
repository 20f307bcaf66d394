//! `coupling`: what another joint j does to joint i through shared gears or a linkage: viscous v_j,
//! coulomb_from sgn(v_j), inertia a_j, each in the direction of r, and coulomb sgn(v_i + r v_j) of what both turn.
//! Which of the two Coulomb frictions a machine has hangs on where its seals and bearings are; together they
//! are one law, and not two that take the place of each other.
//!
//! Where both joints turn one motor, as in the wrist of many arms, what it asks of joint i it asks of
//! joint j too: power is kept, so that both rows have the same three numbers, and nothing goes by joint j
//! alone. That place is named by `both`.

use super::{
    CodeSite, EffectPlace, Entry, Family, Key, Law, PlaceRule, Rule, ShapeSearch, SpeedLadder, Unit,
};
use crate::robot::friction::sign;

pub static ENTRY: Entry = Entry {
    name: "coupling",
    families: &[Family::Cross],
    keys: &[
        Key::shape("from", Unit::One),
        Key::size("viscous", Unit::CoupledViscous),
        Key::torque("coulomb"),
        Key::size("inertia", Unit::CoupledInertia),
        Key::torque("coulomb_from").or_zero(),
        Key::shape("r", Unit::CoupledRatio),
    ],
    places: PlaceRule::Pairs,
    search: ShapeSearch::Grid,
    must: &[
        Rule::not_negative("viscous", TRAIN),
        Rule::not_negative("coulomb", TRAIN),
        Rule::not_negative("inertia", TRAIN),
        Rule::not_negative("coulomb_from", TRAIN),
    ],
    ladder: Some(SpeedLadder::USUAL),
    separate_by: "move the other joint alone, both ways at several speeds",
    formula: "sgn(r) (viscous v_j + coulomb_from sgn(v_j) + inertia a_j) + coulomb sgn(v_i + r v_j) of joint \
                j = from, counted from 1",
    source: "gears that two joints share, as in the wrist of many arms, or a linkage",
    at_rest: true,
    said: |f| {
        let friction = f.sum("coulomb", "coulomb_from");
        match f.value("both") == 1.0 {
            true => format!(
                "gear train that {} shares with {}, with {friction} of friction",
                f.at, f.with
            ),
            false => format!("torque of {} by the motion of {}, {friction}", f.at, f.with),
        }
    },
    remedy: "declare the joints as coupled in the robot file (`[[robot.coupling]]`), or keep the refined model",
    ..Entry::USUAL
};

/// Why its numbers are not negative.
const TRAIN: &str = "what a gear train turns has mass, and takes power";

pub static LAW: Law = Law {
    shape: &["r"],
    starts: |cover, place| {
        let reverses = |j: usize| cover.joints[j].reversals >= 2;
        match place {
            EffectPlace::Pair { of, .. } if reverses(of) => Ok(vec![vec![1.0], vec![-1.0]]),
            EffectPlace::Geared { motor, other } if reverses(motor) && reverses(other) => {
                Ok(vec![vec![1.0], vec![-1.0]])
            }
            _ => Err("the other joint reverses fewer than two times".into()),
        }
    },
    code: Some(written),
    ..Law::linear(
        &ENTRY,
        &["viscous", "coulomb", "inertia", "coulomb_from"],
        |at, _, out| {
            let (s, k, r) = (at.scene.stretch, at.k, at.shape[0]);
            // whose motion the row gets, what turns the motor, and how the row sees the motor
            let (of, [a, b], scale, lever) = match at.place {
                EffectPlace::Pair { on, of } => (of, [on, of], sign(r), 1.0),
                EffectPlace::Geared { motor, other } if at.joint == motor => {
                    (other, [motor, other], r, 1.0)
                }
                EffectPlace::Geared { motor, other } => (motor, [motor, other], r, r),
                _ => return,
            };
            out[0] = scale * s.v[of][k];
            out[1] = lever * sign(s.v[a][k] + r * s.v[b][k]);
            out[2] = scale * s.a[of][k];
            if matches!(at.place, EffectPlace::Pair { .. }) {
                out[3] = scale * sign(s.v[of][k]);
            }
        },
    )
};

/// What it adds to generated code.
fn written(to: &mut CodeSite) {
    let [viscous, coulomb, inertia, from, r] = [to.x(0), to.x(1), to.x(2), to.x(3), to.s(0)];
    match to.place {
        EffectPlace::Geared { motor, other } => {
            let name = format!("shared_{}", to.number);
            to.now(format!(
                "let {name} = {coulomb} * $sign(v[{motor}] + {r} * v[{other}]);"
            ));
            to.now(format!(
                "tau[{motor}] += {viscous} * ({r} * v[{other}]) + {name} + {inertia} * ({r} * a[{other}]);"
            ));
            to.now(format!(
                "tau[{other}] += {viscous} * ({r} * v[{motor}]) + {r} * {name} + {inertia} * ({r} * a[{motor}]);"
            ));
        }
        EffectPlace::Pair { on, of } => {
            let turning = format!("$sign(v[{on}] + {r} * v[{of}])");
            to.added(format!(
                "$sign({r}) * ({viscous} * v[{of}] + {from} * $sign(v[{of}]) + {inertia} * a[{of}]) + {coulomb} * \
                 {turning}"
            ));
        }
        _ => {}
    }
}
