//! `pose-friction`: friction that another joint's pose sets, sgn(v_i) (sin, cos at an order of q_j): a bearing that
//! carries more or less of the arm behind it, a hose or a seal that the other joint presses. The law along the joint's
//! own way is `position-friction`.

use super::order::wavenumber;
use super::{
    EffectPlace, Entry, Family, Key, Law, Limit, LimitedNumber, PlaceRule, Rule, ShapeSearch,
    SpeedLadder, Unit, exact,
};

pub static ENTRY: Entry = Entry {
    name: "pose-friction",
    families: &[Family::Cross, Family::Position],
    keys: &[
        Key::shape("from", Unit::One),
        Key::shape("order", Unit::OtherOrder),
        Key::torque("sin"),
        Key::torque("cos"),
    ],
    places: PlaceRule::Others,
    search: ShapeSearch::Grid,
    must: &[Rule::at_most(
        LimitedNumber::Amplitude("sin", "cos"),
        Limit::Coulomb(1.0),
        "with more than the joint's Coulomb friction it would drive the joint",
    )],
    ladder: Some(SpeedLadder::USUAL),
    friction: true,
    separate_by: "move this joint alone, both ways, at several poses of the other one",
    formula: "sgn(v_i) (sin sin(order q_j) + cos cos(order q_j)) of joint j = from, counted from 1",
    source: "a bearing that carries more in some poses, a hose or a seal that another joint presses",
    said: |f| {
        format!(
            "friction of {} that the pose of {} sets, {}",
            f.at,
            f.with,
            f.amplitude()
        )
    },
    remedy: "look at hoses, cables and bearings of the joint while the other one moves, or keep the refined model",
    ..Entry::USUAL
};

pub static LAW: Law = Law {
    shape: &["order"],
    starts: |cover, place| {
        cover.both_ways(place)?;
        let other = place.from().map_or(0.0, |j| cover.joints[j].range());
        if other <= 0.0 {
            return Err("the other joint stands still in these logs: move it too".into());
        }
        Ok([1.0, 2.0].map(|order| vec![order]).to_vec())
    },
    code: Some(|to| {
        let EffectPlace::Pair { of, .. } = to.place else {
            return;
        };
        let wave = exact(wavenumber(&to.model.robot, of, to.shape[0]));
        let [sin, cos] = [to.x(0), to.x(1)];
        let wave = format!("{sin} * sin({wave} * q[{of}]) + {cos} * cos({wave} * q[{of}])");
        to.added(format!("{} * ({wave})", to.direction()));
    }),
    ..Law::linear(&ENTRY, &["sin", "cos"], |at, _, out| {
        let EffectPlace::Pair { of, .. } = at.place else {
            return;
        };
        let wave = wavenumber(at.scene.robot, of, at.shape[0]);
        let (sin, cos) = (wave * at.scene.stretch.q[of][at.k]).sin_cos();
        (out[0], out[1]) = (at.direction() * sin, at.direction() * cos);
    })
};
