//! Whether an effect has numbers that a machine can have, and that these data tell. What is not known is held at a
//! bound, or the effect is not added.

use nalgebra::{DMatrix, DVector};

use super::dissipation::driven;
use crate::diagnose::problem::case::Case;
use crate::diagnose::problem::fit::{FittedModel, fit};
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::unknowns::Unknown;
use crate::diagnose::uncertainty::covariance;
use crate::effect::{Added, AugmentedModel, Cover, Place, Seen};
use crate::motion::MotionError;
use crate::robot::drive::JointDrive;

/// Deviations that a number must be away from zero, or may be beyond a limit, to count.
const DEVIATIONS: f64 = 2.0;
/// A shape is not known where its deviation passes this share of it.
const KNOWN: f64 = 0.5;
/// Most parameters of an effect that are held one after the other.
const MOST_HELD: usize = 8;

/// Why an effect is not added.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Refusal {
    pub reason: String,
    /// It has numbers that no machine has: a curve may take its place.
    pub impossible: bool,
}

/// What becomes of a fitted effect.
#[derive(Debug, PartialEq)]
enum Judged {
    Sound,
    /// One of (shape, linear) is held at a value.
    Held(usize, f64),
    /// A shape is held at one of its limits.
    Bound(usize),
    Refused(Refusal),
}

/// What limits refer to at a place; the first joint's for all of them.
pub(crate) fn seen<'a>(
    model: &'a AugmentedModel,
    cover: &'a Cover,
    drives: &'a [JointDrive],
    place: Place,
) -> Seen<'a> {
    let j = place.joint().unwrap_or(0);
    Seen {
        cover: cover.at(place),
        duration_s: cover.duration_s,
        kind: place.kind(&model.model.robot),
        friction: &model.model.friction[j],
        drive: &drives[j],
        weight: cover.joints[j].weight,
    }
}

/// Whether an effect has numbers that a machine can have, before any deviation is known.
pub(crate) fn possible(
    effect: &Added,
    at: &FittedModel,
    problem: &FitProblem,
    case: &Case,
) -> bool {
    let seen = seen(&at.model, &problem.cover, &case.drives, effect.place);
    effect.broken(&seen, &|rule| rule.may_be_zero).is_none()
}

/// A fitted model whose effects from the `first` on have numbers that hold, those that the data do not tell held at a
/// bound and the rest fitted again; or why one is not added.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn settled(
    mut at: FittedModel,
    problem: &FitProblem,
    case: &Case,
    first: usize,
) -> Result<Result<FittedModel, Refusal>, MotionError> {
    let (mut newest, mut held) = (first, 0);
    while newest < at.model.effects.len() && held < MOST_HELD {
        let covariance = covariance::without_bias(&at, problem, newest)?;
        let mut model = at.model.clone();
        match judged(&at, problem, case, newest, &covariance) {
            Judged::Sound => {
                newest += 1;
                continue;
            }
            Judged::Refused(refusal) => return Ok(Err(refusal)),
            Judged::Held(i, value) => hold(&mut model.effects[newest], i, value),
            Judged::Bound(k) => {
                let bound = bound(&at, problem, newest, k)?;
                hold(&mut model.effects[newest], k, bound);
            }
        }
        at = fit(&model, problem)?;
        held += 1;
    }
    Ok(Ok(at))
}

/// Why an effect of a fitted model does not hold by the covariance of all unknowns.
pub(crate) fn refused(
    at: &FittedModel,
    problem: &FitProblem,
    case: &Case,
    (effect, covariance): (usize, &DMatrix<f64>),
) -> Option<Refusal> {
    match judged(at, problem, case, effect, covariance) {
        Judged::Refused(refusal) => Some(refusal),
        _ => None,
    }
}

fn judged(
    at: &FittedModel,
    problem: &FitProblem,
    case: &Case,
    effect: usize,
    covariance: &DMatrix<f64>,
) -> Judged {
    let added = &at.model.effects[effect];
    let own = covariance::of_effect(&at.base.unknowns.list, covariance, &at.model, effect);
    let seen = seen(&at.model, &problem.cover, &case.drives, added.place);
    let limits = match added.law.entry.search.refines() {
        true => added.law.limits_on(&problem.cover, added.place),
        false => Vec::new(),
    };
    match judged_by(added, &seen, &own, &limits) {
        Judged::Sound => match driven(at, problem, effect, covariance) {
            Some(share) => Judged::Refused(Refusal {
                reason: format!(
                    "friction would drive the joint in {:.0} % of the rows in which it moves",
                    100.0 * share
                ),
                impossible: true,
            }),
            None => Judged::Sound,
        },
        other => other,
    }
}

/// The same by the covariance of (shape, linear), row-major, and the limits of shapes that are refined.
fn judged_by(added: &Added, seen: &Seen, covariance: &[f64], limits: &[[f64; 2]]) -> Judged {
    let refused = |reason: String, impossible| Judged::Refused(Refusal { reason, impossible });
    let (count, shapes) = (added.parameters(), added.shape.len());
    let deviation = |i: usize| covariance[i * count + i].max(0.0).sqrt();
    if let Some((rule, why)) = added.broken(seen, &|_| false) {
        let own = |key: &str| added.law.linear.iter().position(|name| *name == key);
        let zero = match (rule.may_be_zero, rule.key().and_then(own)) {
            (true, Some(k)) if added.law.reparametrised.is_none() => Some(k),
            _ => None,
        };
        return match zero {
            Some(k) if added.linear[k].abs() <= DEVIATIONS * deviation(shapes + k) => {
                Judged::Held(shapes + k, 0.0)
            }
            _ => refused(why, true),
        };
    }
    if !amplitude_is_known(added, covariance) {
        let why = "its size is not known: its deviation passes half of it";
        return refused(why.to_owned(), false);
    }
    let unknown = |k: &usize| {
        let [low, high] = limits[*k];
        let open = low < high && low > 0.0 && !added.held[*k];
        let known = deviation(*k) <= KNOWN * added.shape[*k].abs();
        // what is not a number is not known either
        open && !known
    };
    match (0..limits.len()).find(unknown) {
        Some(k) => Judged::Bound(k),
        None => Judged::Sound,
    }
}

/// Whether the sizes together are away from zero by two deviations of theirs.
fn amplitude_is_known(added: &Added, covariance: &[f64]) -> bool {
    let (values, matrix) = added.sizes(covariance);
    let n = values.len();
    let scale = |i: usize| matrix[i][i].sqrt();
    let correlation = DMatrix::from_fn(n, n, |a, b| {
        let ridge = if a == b { 1e-9 } else { 0.0 };
        matrix[a][b] / (scale(a) * scale(b)) + ridge
    });
    let in_deviations = DVector::from_fn(n, |i, _| values[i] / scale(i));
    let square = match correlation.cholesky() {
        Some(factor) => in_deviations.dot(&factor.solve(&in_deviations)),
        None => in_deviations.norm_squared(),
    };
    square >= DEVIATIONS * DEVIATIONS
}

fn hold(effect: &mut Added, i: usize, value: f64) {
    let shapes = effect.shape.len();
    match i < shapes {
        true => effect.shape[i] = value,
        false => effect.linear[i - shapes] = value,
    }
    effect.held[i] = true;
}

/// The limit of a shape at which all others fit better.
fn bound(
    at: &FittedModel,
    problem: &FitProblem,
    effect: usize,
    k: usize,
) -> Result<f64, MotionError> {
    let added = &at.model.effects[effect];
    let limits = added.law.limits_on(&problem.cover, added.place)[k];
    let mut list = at.base.unknowns.list.iter();
    let own = list.position(|u| *u == Unknown::Shape { effect, k });
    let least = |x: f64| -> Result<f64, MotionError> {
        let mut model = at.model.clone();
        model.effects[effect].shape[k] = x;
        Ok(at.with(model, problem)?.least_with_fixed(problem, own))
    };
    let [low, high] = [least(limits[0])?, least(limits[1])?];
    Ok(if low < high { limits[0] } else { limits[1] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{JointCover, LAWS};
    use crate::robot::JointKind;
    use crate::robot::friction::ViscousCoulomb;
    use crate::robot::model::JointFriction;

    /// What becomes of an effect with these numbers and deviations, without correlation.
    fn of(name: &str, shape: &[[f64; 2]], linear: &[[f64; 2]], limits: &[[f64; 2]]) -> Judged {
        let law = LAWS.iter().find(|law| law.entry.name == name).unwrap();
        let first = |x: &[[f64; 2]]| x.iter().map(|p| p[0]).collect::<Vec<_>>();
        let added = Added::new(law, Place::Joint(0), first(shape), first(linear));
        let count = shape.len() + linear.len();
        let mut covariance = vec![0.0; count * count];
        for (i, [_, std]) in shape.iter().chain(linear).enumerate() {
            covariance[i * count + i] = std * std;
        }
        let cover = JointCover {
            speed: [-2.0, 2.0],
            ..JointCover::default()
        };
        let friction = JointFriction::ViscousCoulomb(ViscousCoulomb {
            viscous: 1.0,
            coulomb: 10.0,
        });
        let seen = Seen {
            cover: &cover,
            duration_s: 60.0,
            kind: JointKind::Revolute,
            friction: &friction,
            drive: &JointDrive::default(),
            weight: true,
        };
        judged_by(&added, &seen, &covariance, limits)
    }

    #[test]
    fn amplitudes_count_together_and_single_ones_may_be_zero() {
        let wave = |sin: [f64; 2], cos: [f64; 2]| of("ripple", &[[12.0, 0.01]], &[sin, cos], &[]);
        assert_eq!(wave([1.0, 0.1], [0.0, 0.1]), Judged::Sound);
        assert!(matches!(wave([0.1, 0.1], [0.1, 0.1]), Judged::Refused(r) if !r.impossible));
        // jointly two deviations away, and neither alone
        assert_eq!(wave([0.15, 0.1], [0.15, 0.1]), Judged::Sound);
    }

    #[test]
    fn a_negative_size_within_its_deviation_is_zero_and_beyond_it_another_effect() {
        let friction = |mu_c: [f64; 2]| {
            let w = [[50.0, 5.0]];
            of("load-friction", &w, &[mu_c, [0.2, 0.01]], &[[1.0, 1e3]])
        };
        assert_eq!(friction([0.05, 0.01]), Judged::Sound);
        assert_eq!(friction([-0.01, 0.01]), Judged::Held(1, 0.0));
        assert!(matches!(friction([-0.044, 0.01]), Judged::Refused(r) if r.impossible));
    }

    #[test]
    fn a_shape_that_is_not_known_goes_to_a_bound() {
        let slope = |w: [f64; 2]| {
            let sizes = [[0.05, 0.01], [0.2, 0.01]];
            of("load-friction", &[w], &sizes, &[[1.0, 2e3]])
        };
        assert_eq!(slope([831.0, 100.0]), Judged::Sound);
        assert_eq!(slope([831.0, 10_562.0]), Judged::Bound(0));
        assert_eq!(slope([831.0, f64::INFINITY]), Judged::Bound(0));
    }
}
