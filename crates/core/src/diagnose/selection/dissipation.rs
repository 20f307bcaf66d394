//! Whether friction takes power: with an effect that is friction, the power of all friction of the joints that it
//! touches, row by row over the fitted logs, is not negative beyond two deviations of that sum.

use nalgebra::DMatrix;

use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::rows::{friction_columns, scene};
use crate::diagnose::problem::unknowns::Unknown;
use crate::effect::{Added, CurveSignal, Torques};
use crate::motion::Stretch;

/// Deviations of the power that count for nothing.
const DEVIATIONS: f64 = 2.0;
/// Rows of a stretch that are looked at, about.
const ROWS: usize = 4000;
/// Speed over the top speed below which the sign of the power is that of the noise.
const SLOW: f64 = 0.02;
/// Share of the rows that may be beyond.
const MOST: f64 = 0.01;

/// Part of the rows in which friction would drive the joints, by the covariance of all unknowns; none where the effect
/// is no friction, or where that part is next to none.
pub(crate) fn driven(
    at: &FittedModel,
    problem: &FitProblem,
    effect: usize,
    covariance: &DMatrix<f64>,
) -> Option<f64> {
    let added = &at.model.effects[effect];
    if !added.law.entry.friction {
        return None;
    }
    let (mut rows, mut driven) = (0usize, 0usize);
    for (i, stretch) in problem.stretches.iter().enumerate() {
        let joints: Vec<usize> = (0..stretch.joints())
            .filter(|j| added.place.touches(*j) && !problem.split.ignores(i, *j))
            .collect();
        if joints.is_empty() {
            continue;
        }
        let torques = at.model.torques(stretch);
        let terms = terms(at, (stretch, &torques), effect, &joints);
        let fast = |k: usize| {
            let speed =
                |j: &usize| stretch.v[*j][k].abs() > SLOW * problem.cover.joints[*j].fastest();
            joints.iter().any(speed)
        };
        let step = (stretch.len() / ROWS).max(1);
        for k in (0..stretch.len()).step_by(step).filter(|k| fast(*k)) {
            rows += 1;
            let power: f64 = terms.iter().map(|t| t.power[k]).sum();
            let own: f64 = terms.iter().filter(|t| t.own).map(|t| t.power[k]).sum();
            if own >= 0.0 || power >= 0.0 {
                continue;
            }
            let known = || terms.iter().flat_map(|t| &t.slopes);
            let variance: f64 = known()
                .flat_map(|(a, x)| known().map(move |(b, y)| x[k] * y[k] * covariance[(*a, *b)]))
                .sum();
            // a variance that is not known excuses everything
            driven += usize::from(power + DEVIATIONS * variance.max(0.0).sqrt() < 0.0);
        }
    }
    let share = driven as f64 / rows.max(1) as f64;
    (share > MOST).then_some(share)
}

/// A part of the friction along a stretch.
struct Term {
    /// Power that it takes [W].
    power: Vec<f64>,
    /// Its derivatives by unknowns, at their index.
    slopes: Vec<(usize, Vec<f64>)>,
    /// It is the effect in question.
    own: bool,
}

/// The declared friction of the joints and the effects on them that are friction.
fn terms(
    at: &FittedModel,
    (stretch, torques): (&Stretch, &Torques),
    effect: usize,
    joints: &[usize],
) -> Vec<Term> {
    let list = &at.base.unknowns.list;
    let place = |wanted: Unknown| list.iter().position(|u| *u == wanted);
    let scene = scene(&at.model, stretch, torques);
    let times = |j: usize, torque: Vec<f64>| -> Vec<f64> {
        torque
            .iter()
            .zip(&stretch.v[j])
            .map(|(t, v)| t * v)
            .collect()
    };
    let mut out = Vec::new();
    for &j in joints {
        let law = &at.model.model.friction[j];
        let torque = stretch.v[j].iter().map(|v| law.torque(*v)).collect();
        let columns = friction_columns(law, &stretch.v[j]).into_iter().enumerate();
        let slope = |(k, column)| {
            let unknown = place(Unknown::Friction { joint: j, k })?;
            Some((unknown, times(j, column)))
        };
        out.push(Term {
            power: times(j, torque),
            slopes: columns.filter_map(slope).collect(),
            own: false,
        });
        let friction = |(_, e): &(usize, &Added)| {
            let curve = e
                .curve()
                .is_some_and(|(over, _)| over != CurveSignal::Position);
            (e.law.entry.friction || curve) && e.place.touches(j)
        };
        for (e, added) in at.model.effects.iter().enumerate().filter(friction) {
            let mut torque = vec![0.0; stretch.len()];
            added.torque(&scene, j, &mut torque);
            let columns = added.columns(&scene, j).into_iter().enumerate();
            let slope = |(k, column)| {
                let unknown = place(Unknown::Linear { effect: e, k })?;
                Some((unknown, times(j, column)))
            };
            out.push(Term {
                power: times(j, torque),
                slopes: columns.filter_map(slope).collect(),
                own: e == effect,
            });
        }
    }
    out
}
