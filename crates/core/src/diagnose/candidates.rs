//! Everything that a model may lack, each shape of it a candidate with columns of its own.

use super::problem::case::{DiagnosisCase, is_same_order};
pub use super::problem::pass::EffectCandidate;
use crate::effect::{
    AugmentedModel, EffectPlace, Family, LAWS, Law, LimitContext, LimitedNumber, LogCoverage,
    ModelEffect, Role, Rule, ShapeSearch, ShapeSpan, Unit,
};
use crate::judge::Bound;
use crate::number;

/// Whether two effects may not both be added: one shape per family and place, one wave per order, and one constant torque.
pub fn exclude(a: &ModelEffect, b: &ModelEffect) -> bool {
    let waves = |e: &ModelEffect| e.law.entry.search == ShapeSearch::Orders;
    let holds = |e: &ModelEffect| e.law.entry.families.contains(&Family::Offset);
    match a.place == b.place && (a.family() == b.family() || holds(a) && holds(b)) {
        true if waves(a) && waves(b) => a.name() == b.name() && one_wave(&a.shape, &b.shape),
        same => same,
    }
}

fn one_wave(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| is_same_order(*a, *b))
}

/// Whether an effect is of a joint's declared friction law: its shape, or what stands beside it.
pub fn is_friction_law(effect: &ModelEffect) -> bool {
    let joint = matches!(effect.place, EffectPlace::Joint(_));
    joint && matches!(effect.family(), Family::Velocity | Family::Offset)
}

/// A law that these data cannot show at a place, with what they lack.
#[derive(Clone)]
pub struct NotTried {
    pub law: &'static Law,
    pub place: EffectPlace,
    pub lacking: String,
}

/// All candidates beside a model, and what these data cannot show.
pub fn candidates(
    model: &AugmentedModel,
    case: &DiagnosisCase,
    cover: &LogCoverage,
) -> (Vec<EffectCandidate>, Vec<NotTried>) {
    let robot = &model.model.robot;
    let laws = LAWS.iter().copied().chain(case.own.iter().copied());
    let wanted = |law: &&Law| {
        let role = law.entry.role;
        role != Role::StandIn && (case.kept.is_some() || role != Role::Kept)
    };
    let (mut out, mut not_tried) = (Vec::new(), Vec::new());
    for law in laws.filter(wanted) {
        for place in law.places(robot, &model.model.friction) {
            let waves = law.entry.search == ShapeSearch::Orders;
            if !beside(place) || !waves && known(model, law, place).next().is_some() {
                continue;
            }
            // waves come more than once, each of an order of its own
            let known =
                |shape: &Vec<f64>| known(model, law, place).any(|e| one_wave(&e.shape, shape));
            let mut touched = (0..robot.joints()).filter(|j| place.touches(*j));
            let shapes = match touched.all(|j| cover.joints[j].stationary) {
                true => {
                    Err("the joint is held in these logs: move it to see what it does".to_owned())
                }
                false => law.starts_on(cover, place),
            };
            match shapes {
                Ok(shapes) => {
                    let seen = seen(model, cover, case, place);
                    let shapes = shapes.into_iter().filter(|shape| !known(shape));
                    out.extend(shapes.filter_map(|shape| candidate(law, place, shape, &seen)));
                }
                Err(lacking) => not_tried.push(NotTried {
                    law,
                    place,
                    lacking,
                }),
            }
        }
    }
    (out, not_tried)
}

/// Two joints couple where they are neighbours.
fn beside(place: EffectPlace) -> bool {
    match place {
        EffectPlace::Pair { on, of } => on.abs_diff(of) == 1,
        EffectPlace::Geared { motor, other } => motor.abs_diff(other) == 1,
        _ => true,
    }
}

/// The effects of a law that the model has at a place already.
fn known<'a>(
    model: &'a AugmentedModel,
    law: &'a Law,
    place: EffectPlace,
) -> impl Iterator<Item = &'a ModelEffect> {
    let effects = model.effects.iter();
    effects.filter(move |e| e.name() == law.entry.name && e.place == place)
}

fn candidate(
    law: &'static Law,
    place: EffectPlace,
    shape: Vec<f64>,
    seen: &LimitContext,
) -> Option<EffectCandidate> {
    let effect = ModelEffect::new(law, place, shape, vec![1.0; law.linear.len()]);
    // what hangs on coefficients is a bound of the fit, what hangs on the shape alone a limit of the grid
    let twice = vec![2.0; law.linear.len()];
    let value = |linear: &[f64], key: &str| {
        let keys = law.keys(&effect.shape, linear);
        keys.iter().find(|k| k.key == key).map(|k| k.value)
    };
    let coefficient = |key: &str| value(&effect.linear, key) != value(&twice, key);
    let of_coefficients = |number: &LimitedNumber| match number {
        LimitedNumber::Key(key) | LimitedNumber::Size(key) => coefficient(key),
        LimitedNumber::Amplitude(..) | LimitedNumber::AtTopSpeed(..) => true,
        // of coefficients that are all one they are the shape's
        LimitedNumber::Ratio(..) | LimitedNumber::Weight => false,
    };
    let broken = effect.broken(seen, &|rule| of_coefficients(&rule.of));
    let bounds = law.linear.iter().map(|key| bound(&effect, key, seen));
    let bounds = bounds.collect();
    let linear = vec![0.0; law.linear.len()];
    broken.is_none().then_some(EffectCandidate {
        effect: ModelEffect { linear, ..effect },
        bounds,
        slopes: Vec::new(),
    })
}

/// Shapes that are refined, with how far each may go from where it is; one that is held at the value of physics stays.
pub fn refined_shapes(
    model: &AugmentedModel,
    case: &DiagnosisCase,
    cover: &LogCoverage,
    effect: &ModelEffect,
) -> Vec<(usize, Bound)> {
    let ranges = shape_ranges(model, case, cover, effect).into_iter();
    let is_held =
        |k: usize, range: &ShapeSpan| effect.held[k] && range.physics == Some(effect.shape[k]);
    let free = ranges.enumerate().filter(|(k, range)| !is_held(*k, range));
    let of = |(k, range): (usize, ShapeSpan)| {
        let here = effect.shape[k];
        let bound = Bound {
            least: (range.least - here).min(0.0),
            most: (range.most - here).max(0.0),
        };
        (k, bound)
    };
    free.map(of).collect()
}

/// The first shape that stands at an end of its range and that physics gives a value, with that.
pub fn shape_by_physics(
    model: &AugmentedModel,
    case: &DiagnosisCase,
    cover: &LogCoverage,
    effect: &ModelEffect,
) -> Option<(usize, f64)> {
    let ranges = shape_ranges(model, case, cover, effect).into_iter();
    let mut ends = ranges.enumerate().filter_map(|(k, range)| {
        range.end_at(effect.shape[k])?;
        Some((k, range.physics?))
    });
    ends.next()
}

/// Ranges of the shapes that are refined, within what its numbers must be.
fn shape_ranges(
    model: &AugmentedModel,
    case: &DiagnosisCase,
    cover: &LogCoverage,
    effect: &ModelEffect,
) -> Vec<ShapeSpan> {
    let law = effect.law;
    let seen = seen(model, cover, case, effect.place);
    let ranges = law.limits_on(cover, effect.place, &effect.shape);
    let of = |(k, range): (usize, ShapeSpan)| {
        let known = bound(effect, law.shape[k], &seen);
        range.within(known.least, known.most)
    };
    ranges.into_iter().enumerate().map(of).collect()
}

/// The shape that stands at an end of its range, beyond which another law begins, with that end.
pub fn shape_end(
    model: &AugmentedModel,
    case: &DiagnosisCase,
    cover: &LogCoverage,
    effect: &ModelEffect,
) -> Option<(&'static str, f64)> {
    let ranges = shape_ranges(model, case, cover, effect).into_iter();
    let mut ends = ranges.enumerate().filter_map(|(k, range)| {
        let end = range.end_at(effect.shape[k])?;
        Some((effect.law.shape[k], end))
    });
    ends.next()
}

/// Whether these data tell no shape: one stands at an end of its range, whatever begins beyond it.
pub fn is_untold(
    model: &AugmentedModel,
    case: &DiagnosisCase,
    cover: &LogCoverage,
    effect: &ModelEffect,
) -> bool {
    let ranges = shape_ranges(model, case, cover, effect).into_iter();
    let mut shapes = ranges.zip(&effect.shape);
    shapes.any(|(range, value)| range.stands_at(*value) != [false; 2])
}

/// Why an effect with its numbers is no finding, where it is none: a shape stands at an end of its range, beyond which
/// the law is another or nothing is left of it; it has no torque; or its numbers together are none that a machine has.
pub fn no_finding(
    model: &AugmentedModel,
    case: &DiagnosisCase,
    cover: &LogCoverage,
    effect: &ModelEffect,
) -> Option<String> {
    if effect.linear.iter().all(|x| *x == 0.0) || !effect.can_be() {
        return Some("its size is at a bound, where it has no torque".to_owned());
    }
    if let Some((key, end)) = shape_end(model, case, cover, effect) {
        return Some(format!(
            "{key} stands at {}, an end of its range: beyond it another law begins",
            number::significant(end, 3)
        ));
    }
    let seen = seen(model, cover, case, effect.place);
    if let Some((key, most)) = beyond_the_joint(effect, seen.cover.torque) {
        return Some(format!(
            "{key} is more than {}, the greatest torque of the joint",
            number::significant(most, 3)
        ));
    }
    // an amplitude beyond its usual size is told as large, and is there; bounds of single numbers are those of the fit
    let told = |rule: &Rule| {
        matches!(
            rule.of,
            LimitedNumber::Amplitude(..) | LimitedNumber::Key(_)
        )
    };
    effect.broken(&seen, &told).map(|(_, why)| why)
}

/// The size of an effect that is a torque greater than `most`, the greatest that the joint took, with that: only the
/// others in the fit can hold against it. What hangs on the pose may be greater at poses that were not seen.
fn beyond_the_joint(effect: &ModelEffect, most: f64) -> Option<(&'static str, f64)> {
    let entry = effect.law.entry;
    let by_pose = effect.family() == Family::Position && entry.search != ShapeSearch::Orders;
    let keys = effect.law.keys(&effect.shape, &effect.linear);
    let too_great = keys.iter().find(|of| {
        let key = entry
            .key(of.key)
            .filter(|key| key.size && key.unit == Unit::Torque);
        key.is_some() && of.value.abs() > most
    });
    too_great.filter(|_| !by_pose).map(|of| (of.key, most))
}

/// Values that a coefficient can have.
fn bound(effect: &ModelEffect, key: &str, seen: &LimitContext) -> Bound {
    let mut bound = Bound::NONE;
    let entry = effect.law.entry;
    // no friction is greater than all that the joint ever took
    if entry.friction
        && entry
            .key(key)
            .is_some_and(|key| key.size && key.unit == Unit::Torque)
    {
        (bound.least, bound.most) = (-seen.cover.torque, seen.cover.torque);
    }
    for rule in entry.must {
        match rule.of {
            LimitedNumber::Key(of) if of == key => {
                bound.least = bound.least.max(rule.least_of(seen).unwrap_or(bound.least));
                bound.most = bound.most.min(rule.most_of(seen).unwrap_or(bound.most));
            }
            LimitedNumber::Size(of) if of == key => {
                if let Some(most) = rule.most_of(seen) {
                    (bound.least, bound.most) = (-most, most);
                }
            }
            _ => {}
        }
    }
    // one clock may be late or early; the torque of one joint is not ahead of its position
    if effect.law.entry.role == Role::Shift && effect.place != EffectPlace::All {
        bound.least = 0.0;
    }
    bound
}

/// What limits refer to at a place; the first joint's for all of them.
fn seen<'a>(
    model: &'a AugmentedModel,
    cover: &'a LogCoverage,
    case: &'a DiagnosisCase,
    place: EffectPlace,
) -> LimitContext<'a> {
    let j = place.joint().unwrap_or(0);
    LimitContext {
        cover: cover.at(place),
        duration_s: cover.duration_s,
        kind: place.kind(&model.model.robot),
        friction: &model.model.friction[j],
        drive: &case.drives[j],
        weight: cover.joints[j].weight,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{settling_drift, weight};

    #[test]
    fn a_torque_beyond_all_that_the_joint_took_is_no_size_of_an_effect_but_of_one_by_the_pose() {
        let of = |law, shape: &[f64], linear: &[f64]| {
            let effect = ModelEffect::new(law, EffectPlace::Joint(0), shape.into(), linear.into());
            beyond_the_joint(&effect, 973.0)
        };
        let drift = |level| of(&settling_drift::LAW, &[0.5], &[level]);
        assert_eq!(drift(13_901.0), Some(("level", 973.0)));
        assert_eq!(drift(-2000.0), Some(("level", 973.0)));
        assert_eq!(drift(-40.0), None);
        assert_eq!(of(&weight::LAW, &[], &[2000.0, 100.0]), None);
    }
}
