//! `presliding`: below breakaway friction is a spring that yields (Dahl 1968; LuGre, Canudas de Wit
//! et al. 1995). In place of the declared law's saturating part S(v) stands fc h, with
//! dh/dt = rate (v - |v| h) and h in -1..1, and its rate of change damps: sigma1 dh/dt / rate.
//! sigma0 = fc rate.

use super::entry::{Entry, Family, Key, Ladder, Search};
use super::law::{KeyValue, Law, Memory, Reparametrisation};
use super::physics::{Limit, Number, Rule};
use super::signal::CurveSignal;
use super::unit::Unit;
use crate::robot::friction::sign;
use crate::robot::model::JointFriction;

pub static ENTRY: Entry = Entry {
    name: "presliding",
    families: &[Family::Memory],
    keys: &[
        Key::size("sigma0", Unit::Stiffness)
            .above_zero("sigma0 must be above 0 and sigma1 not negative"),
        Key::size("sigma1", Unit::Viscous).within(
            0.0,
            f64::INFINITY,
            "sigma0 must be above 0 and sigma1 not negative",
        ),
        Key::shape("fc", Unit::Torque),
    ],
    search: Search::Refined,
    must: &[
        Rule::not_negative("sigma0", BRISTLES),
        Rule::not_negative("fc", BRISTLES),
        Rule::not_negative("sigma1", BRISTLES),
        Rule::at_most(
            Number::Ratio("fc", "sigma0"),
            Limit::Presliding,
            "rolling contacts and seals slip after 0.05 rad or 5 mm, or what [drive] declares",
        ),
    ],
    otherwise: Some(CurveSignal::Way),
    ladder: Some(Ladder::NARROW),
    separate_by: "log slow reversals at several amplitudes below and above breakaway",
    formula: "sigma0 z + sigma1 dz/dt for F - viscous v; dz/dt = v - sigma0 abs(v) z/fc",
    source: "bristles that bend before they slip (Dahl 1968; Canudas de Wit et al. 1995)",
    said: |f| {
        format!(
            "friction of {} that bends before it slips, {} stiff",
            f.at,
            f.size("sigma0")
        )
    },
    remedy: "use the refined model where the joint reverses in small motions",
    ..Entry::USUAL
};

/// Why its numbers are not negative.
const BRISTLES: &str = "bristles push back, and their damping takes power";

pub static LAW: Law = Law {
    shape: &["rate"],
    starts: |cover, place| {
        let joint = cover.at(place);
        if joint.reversals < 4 {
            return Err("fewer than four reversals".into());
        }
        let shares = [0.001, 0.003, 0.01, 0.02, 0.05, 0.1];
        Ok(shares.map(|s| vec![1.0 / (s * joint.range())]).to_vec())
    },
    limits: |cover, place| {
        let range = cover.at(place).range();
        vec![[3.0 / range, 1e4 / range]]
    },
    // sigma0 = fc rate
    reparametrised: Some(Reparametrisation {
        of_keys: |values| {
            let (sigma0, fc) = (values.get("sigma0")?, values.get("fc")?);
            let rate = sigma0 / fc;
            if rate.is_nan() || rate <= 0.0 {
                return Err(values.unusable("sigma0", sigma0));
            }
            Ok([vec![rate], vec![fc, values.get("sigma1")?]])
        },
        to_keys: |shape, linear| {
            let (rate, fc) = (shape[0], linear[0]);
            let sigma0 = KeyValue {
                key: "sigma0",
                value: fc * rate,
                slopes: vec![fc, rate, 0.0],
            };
            vec![
                sigma0,
                KeyValue::plain("sigma1", linear[1], 2, 3),
                KeyValue::plain("fc", fc, 1, 3),
            ]
        },
    }),
    memory: Some(Memory {
        size: 1,
        step: |scene, place, shape, _, kept, out| {
            let Some(j) = place.joint() else { return };
            let v = scene.stretch.v[j][0];
            if kept[0].is_nan() {
                kept[0] = 0.0;
            }
            [out[0], out[1]] = yielded(shape[0], scene.stretch.dt, v, &mut kept[0]);
            out[0] -= saturating(&scene.laws[j], v);
        },
    }),
    code: Some(|to| {
        let (v, i) = (to.v(), to.number());
        let own = to.remember("bristle", None, "0.0", &v);
        let (next, ends) = (format!("next_{i}"), to.saturating());
        to.line(format!(
            "let {next} = $sign({v}) + ({own} - $sign({v})) * exp(-{} * fabs({v}) * dt);",
            to.s(0)
        ));
        to.step(format!(
            "{} * (0.5 * ({own} + {next}) - {ends}) + {} * ({next} - {own}) / (dt * {})",
            to.x(0),
            to.x(1),
            to.s(0)
        ));
        to.line(format!("{own} = {next};"));
    }),
    ..Law::linear(&ENTRY, &["fc", "sigma1"], |scene, place, shape, _, out| {
        let Some(j) = place.joint() else { return };
        let s = scene.stretch;
        let mut h = 0.0;
        let [friction, damping] = out else { return };
        for (k, (friction, damping)) in friction.iter_mut().zip(damping).enumerate() {
            let v = s.v[j][k];
            [*friction, *damping] = yielded(shape[0], s.dt, v, &mut h);
            *friction -= saturating(&scene.laws[j], v);
        }
    })
};

/// Yields the spring h over one step of constant speed, exactly: h -> sgn(v) with exp(-rate |v| dt). Its value in
/// the middle, and its rate of change over the rate.
fn yielded(rate: f64, dt: f64, v: f64, h: &mut f64) -> [f64; 2] {
    let target = sign(v);
    let decay = (-rate * v.abs() * dt).exp();
    let next = target + (*h - target) * decay;
    let middle = 0.5 * (*h + next);
    let change = (next - *h) / (dt * rate);
    *h = next;
    [middle, change]
}

/// Saturating part of a law over its height, -1..1.
fn saturating(law: &JointFriction, v: f64) -> f64 {
    match law {
        // a joint that declares no friction has none to replace
        JointFriction::None => 0.0,
        law => law.direction(v),
    }
}

#[cfg(test)]
mod tests {
    use super::LAW;
    use crate::effect::{Added, Place};

    #[test]
    fn bristles_that_carry_nothing_cannot_be() {
        let of = |fc| Added::new(&LAW, Place::Joint(0), vec![50.0], vec![fc, 0.3]).can_be();
        assert!(of(1.0) && !of(0.0));
    }
}
