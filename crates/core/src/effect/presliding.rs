//! `presliding`: below breakaway friction is a spring that yields (Dahl 1968; LuGre, Canudas de Wit
//! et al. 1995). In place of the declared law's saturating part S(v) stands fc h, with
//! dh/dt = rate (v - |v| h) and h in -1..1, and its rate of change damps: sigma1 dh/dt / rate.
//! sigma0 = fc rate.

use super::{
    CurveSignal, EffectReparametrisation, Entry, Family, Key, KeyValue, Law, Limit, LimitedNumber,
    Rule, ShapeSearch, ShapeSpan, SpeedLadder, Unit,
};
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
    search: ShapeSearch::Refined,
    must: &[
        Rule::not_negative("sigma0", BRISTLES),
        Rule::not_negative("fc", BRISTLES),
        Rule::not_negative("sigma1", BRISTLES),
        Rule::at_most(
            LimitedNumber::Ratio("fc", "sigma0"),
            Limit::Presliding,
            "rolling contacts and seals slip after 0.05 rad or 5 mm, or what [drive] declares",
        ),
    ],
    otherwise: Some(CurveSignal::Way),
    ladder: Some(SpeedLadder::NARROW),
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
        let joint = cover.reversing(place, 4, "fewer than four reversals")?;
        let shares = [0.001, 0.003, 0.01, 0.02, 0.05, 0.1];
        Ok(shares.map(|s| vec![1.0 / (s * joint.range())]).to_vec())
    },
    limits: |cover, place, _| {
        let range = cover.at(place).range();
        vec![ShapeSpan::of(3.0 / range, 1e4 / range)]
    },
    // sigma0 = fc rate
    reparametrised: Some(EffectReparametrisation {
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
    // h
    memory: Some(1),
    code: Some(|to| {
        let (v, i) = (to.v(), to.number);
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
    ..Law::linear(&ENTRY, &["fc", "sigma1"], |at, kept, out| {
        let (v, rate, dt) = (at.v(), at.shape[0], at.scene.stretch.dt);
        let h = if kept[0].is_nan() { 0.0 } else { kept[0] };
        // over one step of constant speed, exactly: h -> sgn(v) with exp(-rate |v| dt)
        let next = sign(v) + (h - sign(v)) * (-rate * v.abs() * dt).exp();
        out[0] = 0.5 * (h + next) - saturating(&at.scene.laws[at.joint], v);
        out[1] = (next - h) / (dt * rate);
        kept[0] = next;
    })
};

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
    use crate::effect::{EffectPlace, ModelEffect};

    #[test]
    fn bristles_that_carry_nothing_cannot_be() {
        let of =
            |fc| ModelEffect::new(&LAW, EffectPlace::Joint(0), vec![50.0], vec![fc, 0.3]).can_be();
        assert!(of(1.0) && !of(0.0));
    }
}
