//! All candidates of one round: every effect at every place where it can sit, its shape searched.

use rayon::prelude::*;

use super::orders::SCANNED;
use super::score::{Columns, Judge, spread};
use crate::diagnose::problem::fit::{Fitted, Ground};
use crate::diagnose::problem::rows::{clear, scene, standing};
use crate::diagnose::run::Case;
use crate::diagnose::selection::accept::{Candidate, Worth, decide};
use crate::effect::{
    Added, AugmentedModel, LAWS, Law, Place, Role, Search, Torques, order_is_whole, shifted,
};
use crate::math::minimise::nelder_mead;
use crate::motion::MotionError;

/// What an effect's size is measured by, per joint.
#[derive(Debug, Clone, Copy)]
pub struct Bar<'a> {
    /// Squared residual of the declared model over the fitted rows.
    pub declared: &'a [f64],
    /// Variance of the noise in the filtered residual.
    pub noise: &'a [f64],
}

/// Most evaluations of a shape's refinement, per shape parameter.
const REFINEMENTS: u64 = 24;

/// Tries everything once.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn search(
    at: &Fitted,
    ground: &Ground,
    case: &Case,
    bar: &Bar,
    torques: &[Torques],
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Candidate>, MotionError> {
    let judge = Judge::new(at, ground);
    let robot = &at.model.model.robot;
    let laws = &at.model.model.friction;
    let places: Vec<(&'static Law, Place)> = LAWS
        .iter()
        .filter(|law| !case.without.iter().any(|name| name == law.entry.name))
        .flat_map(|law| law.places(robot, laws).into_iter().map(|p| (*law, p)))
        .collect();
    let tried: Vec<(Candidate, usize)> = places
        .par_iter()
        .map(|&(law, place)| {
            if stop() {
                return Ok((refused(law, place, "interrupted".into()), 0));
            }
            let least = floor_of(at, ground, bar, place) * case.limits.over_noise / at.square;
            one(
                at,
                ground,
                &judge,
                torques,
                (law, place),
                case.keep,
                HOPELESS * least,
            )
        })
        .collect::<Result<_, MotionError>>()?;
    let shapes: usize = tried.iter().map(|(_, shapes)| shapes).sum();
    let mut found: Vec<Candidate> = tried.into_iter().map(|(c, _)| c).collect();
    for candidate in &mut found {
        let over = |of: &dyn Fn(usize) -> f64| -> f64 {
            (0..robot.joints())
                .filter(|j| candidate.effect.place.touches(*j))
                .map(|j| at.weights[j].powi(2) * of(j))
                .sum()
        };
        let whole = over(&|j| bar.declared[j]).max(f64::MIN_POSITIVE);
        let floor = floor_of(at, ground, bar, candidate.effect.place);
        let worth = |gain: f64| Worth {
            of_declared: gain * at.square / whole,
            of_noise: gain * at.square / floor,
        };
        decide(candidate, shapes.max(1), &case.limits, &worth);
    }
    Ok(found)
}

/// A shape is refined where the best start removes at least this share of what it must.
const HOPELESS: f64 = 0.2;

/// Weighted square of the noise on the joints of a place, over the fitted rows.
fn floor_of(at: &Fitted, ground: &Ground, bar: &Bar, place: Place) -> f64 {
    let joints = (0..bar.noise.len()).filter(|j| place.touches(*j));
    let of_joint = |j: usize| {
        let rows = ground.plan.fitted_rows_of(j) as f64;
        // where the noise is overrated, what is left counts
        rows * (at.weights[j].powi(2) * bar.noise[j]).min(1.0)
    };
    joints.map(of_joint).sum::<f64>().max(f64::MIN_POSITIVE)
}

/// A candidate that was not tried.
fn refused(law: &'static Law, place: Place, reason: String) -> Candidate {
    Candidate {
        effect: Added {
            law,
            place,
            shape: vec![f64::NAN; law.shape.len()],
            linear: vec![0.0; law.linear.len()],
        },
        score: None,
        accepted: false,
        significant: false,
        reason,
    }
}

/// One effect at one place: the best of its shapes, refined; and how many shapes were tried.
fn one(
    at: &Fitted,
    ground: &Ground,
    judge: &Judge,
    torques: &[Torques],
    (law, place): (&'static Law, Place),
    keep: bool,
    least: f64,
) -> Result<(Candidate, usize), MotionError> {
    let joints = 0..at.weights.len();
    if joints
        .filter(|j| place.touches(*j))
        .all(|j| ground.cover.joints[j].held)
    {
        let reason = "the joint is held in these logs: move it to see what it does";
        return Ok((refused(law, place, reason.into()), 0));
    }
    if law.entry.role == Role::Kept && !keep {
        let reason = "a fit that is free while carrying it absorbs it; give the model of logs \
                      without it, and --keep";
        return Ok((refused(law, place, reason.into()), 0));
    }
    let there = |e: &Added| e.name() == law.entry.name && e.place == place;
    let again = at.model.effects.iter().any(there);
    let periodic = law.entry.search == Search::Orders;
    // only waves come more than once, each with an order of its own
    if again && !periodic {
        return Ok((refused(law, place, "it is in the model".into()), 0));
    }
    let starts = match (law.starts)(&ground.cover, place) {
        Ok(starts) => starts,
        Err(lacking) => return Ok((refused(law, place, lacking), 0)),
    };
    let k = law.linear.len();
    let mut effect = Added {
        law,
        place,
        shape: Vec::new(),
        linear: vec![0.0; k],
    };
    let mut best = (f64::NEG_INFINITY, Vec::new());
    // a peak was picked out of all orders that were looked at
    let count = if periodic { SCANNED } else { starts.len() };
    for shape in starts {
        effect.shape = shape;
        if periodic && kept_by_filter(at, ground, torques, &effect)? < LEAST_KEPT {
            continue;
        }
        let gain = judge.gain(&columns(&at.model, ground, torques, &effect)?, k);
        if gain > best.0 {
            best = (gain, effect.shape.clone());
        }
    }
    if best.0 == f64::NEG_INFINITY {
        let reason = "the filter's cut-off takes the orders that are there: raise cutoff_hz in \
                      [filter] to look for them";
        return Ok((refused(law, place, reason.into()), count));
    }
    effect.shape = best.1;
    // a shape worth refining: positive, so that steps are ratios
    let limits = (law.limits)(&ground.cover, place);
    let free = !effect.shape.is_empty()
        && law.entry.search.refines()
        && limits.iter().all(|[low, high]| low < high)
        && best.0 > least;
    if free {
        let scale: Vec<f64> = effect.shape.iter().map(|s| s.abs().max(1e-9)).collect();
        let mut failed = None;
        let start = vec![0.0; scale.len()];
        // an order's peak is as narrow as one wave over the travel
        let steps: Vec<f64> = effect
            .shape
            .iter()
            .map(|s| match periodic {
                true => 0.15 / (s.abs() * ground.cover.travel(place)).max(0.5),
                false => 0.2,
            })
            .collect();
        let centre = effect.shape.clone();
        let mut cost = |x: &[f64]| {
            let mut moved = effect.clone();
            for (i, s) in moved.shape.iter_mut().enumerate() {
                *s = (centre[i] + scale[i] * x[i]).clamp(limits[i][0], limits[i][1]);
            }
            match columns(&at.model, ground, torques, &moved) {
                Ok(c) => -judge.gain(&c, k),
                Err(e) => {
                    failed = Some(e);
                    f64::INFINITY
                }
            }
        };
        let budget = REFINEMENTS * scale.len() as u64;
        let found = nelder_mead(&mut cost, &start, &steps, 1e-6, budget);
        if let Some(error) = failed {
            return Err(error);
        }
        for (i, s) in effect.shape.iter_mut().enumerate() {
            *s = (centre[i] + scale[i] * found.x[i]).clamp(limits[i][0], limits[i][1]);
        }
    }
    if again
        && at
            .model
            .effects
            .iter()
            .any(|e| there(e) && near(&e.shape, &effect.shape))
    {
        return Ok((refused(law, place, "it is in the model".into()), count));
    }
    if periodic && !order_is_whole(&ground.cover, place, effect.shape[0]) {
        let reason = format!(
            "{:.3} waves a turn: after a full turn the joint is where it was, and orders are whole",
            effect.shape[0]
        );
        return Ok((refused(law, place, reason), count));
    }
    let columns = columns(&at.model, ground, torques, &effect)?;
    let score = judge.score(&columns, k, effect.shape.len());
    let reason = match &score {
        None => "nothing of it is its own: what is declared stands in for it".to_owned(),
        Some(s) => {
            effect.linear.clone_from(&s.beta);
            String::new()
        }
    };
    let candidate = Candidate {
        effect,
        score,
        accepted: false,
        significant: false,
        reason,
    };
    Ok((candidate, count))
}

/// Least part of a periodic column's power that the parallel filter must keep.
const LEAST_KEPT: f64 = 0.2;

/// Part of the columns' power that the parallel filter keeps, over the fitted stretches.
fn kept_by_filter(
    at: &Fitted,
    ground: &Ground,
    torques: &[Torques],
    effect: &Added,
) -> Result<f64, MotionError> {
    let Some(j) = effect.place.joint() else {
        return Ok(1.0);
    };
    let (mut before, mut after) = (0.0, 0.0);
    for (stretch, torques) in ground.stretches.iter().zip(torques) {
        let scene = scene(&at.model, stretch, torques);
        for mut column in effect.columns(&scene, j) {
            before += column.iter().map(|x| x * x).sum::<f64>();
            ground.parallel.smooth(&mut column)?;
            after += column.iter().map(|x| x * x).sum::<f64>();
        }
    }
    Ok(after / before.max(f64::MIN_POSITIVE))
}

/// Whether two shapes are one and the same effect.
fn near(a: &[f64], b: &[f64]) -> bool {
    a.iter()
        .zip(b)
        .all(|(a, b)| (a - b).abs() <= 0.05 * a.abs().max(b.abs()))
}

/// Filtered columns of an effect over every stretch.
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn columns(
    model: &AugmentedModel,
    ground: &Ground,
    torques: &[Torques],
    effect: &Added,
) -> Result<Columns, MotionError> {
    let joints = model.model.robot.joints();
    let mut out = Vec::with_capacity(torques.len());
    for (i, (stretch, torques)) in ground.stretches.iter().zip(torques).enumerate() {
        let scene = scene(model, stretch, torques);
        let mut of_stretch = Vec::with_capacity(joints);
        for j in 0..joints {
            if !effect.place.touches(j) || ground.plan.holds(i, j) {
                of_stretch.push(Vec::new());
                continue;
            }
            let mut raw = effect.columns(&scene, j);
            for column in &mut raw {
                shifted(column, model.shift(j) / stretch.dt);
            }
            let channels: Vec<&[f64]> = raw.iter().map(Vec::as_slice).collect();
            let mut rows = ground.parallel.run(&channels)?;
            let still = standing(model, stretch, ground.parallel, j);
            rows.iter_mut().for_each(|column| clear(column, &still));
            of_stretch.push(rows);
        }
        out.push(of_stretch);
    }
    Ok(out)
}

/// Of accepted candidates the one to add, and those that the data do not separate from it: within
/// one standard error over the folds. Among these the one with the fewest parameters is taken, then
/// the first in the order of [`LAWS`].
pub fn choose(found: &[Candidate], skip: &[usize]) -> Option<(usize, Vec<usize>)> {
    let scored = |i: usize| found[i].score.as_ref();
    let open: Vec<usize> = (0..found.len())
        .filter(|i| found[*i].accepted && !skip.contains(i) && scored(*i).is_some())
        .collect();
    let gain = |i: usize| scored(i).map_or(f64::NEG_INFINITY, |s| s.cv_gain);
    let best = open
        .iter()
        .copied()
        .max_by(|a, b| gain(*a).total_cmp(&gain(*b)))?;
    let top = &scored(best)?.folds;
    let near: Vec<usize> = open
        .iter()
        .copied()
        .filter(|&i| {
            scored(i).is_some_and(|s| {
                let worse: f64 = s.folds.iter().sum::<f64>() - top.iter().sum::<f64>();
                i == best || worse <= spread(&s.folds, top)
            })
        })
        .collect();
    let order = |i: usize| {
        LAWS.iter()
            .position(|k| k.entry.name == found[i].effect.name())
    };
    let chosen = near
        .iter()
        .copied()
        .min_by_key(|&i| (found[i].effect.parameters(), order(i), i))?;
    let mut others: Vec<usize> = near.into_iter().filter(|i| *i != chosen).collect();
    others.sort_by(|a, b| gain(*b).total_cmp(&gain(*a)));
    Some((chosen, others))
}
