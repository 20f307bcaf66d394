//! Which correction of a set-up is reported, if any.
//!
//! Every hypothesis is fitted to few rows; those that do best, and those that put right what physics
//! forbids, are fitted to all of them, and the best one is judged on blocks that did not choose it. What is
//! found is applied and the search begins anew, for two things may be wrong.

use rayon::prelude::*;

use super::channels::Drive;
use super::correction::{Change, Correction};
use super::decide::{
    BLOCKS, Found, Judged, NEGATIVE, Negative, decide, joints_below, judged, negative, on_all_rows,
};
use super::doubt::doubtful;
use super::fitted::{Fitted, TILT};
use super::hints::{Hint, Small, hint};
use super::hypotheses;
use super::normal::Problem;
use super::poses::impossible;
use super::sizes::sizes;
use super::trial::Trial;

/// Rows that hypotheses are chosen by.
const SCREENED: usize = 160;
/// Hypotheses that are fitted to all rows.
const SHORT_LIST: usize = 10;
/// Rounds: so many things at most are told.
const ROUNDS: usize = 5;

/// What a search found.
#[derive(Debug, Clone)]
pub struct Searched {
    /// In the order in which they were found.
    pub found: Vec<Found>,
    /// All that is sure, together.
    pub correction: Correction,
    /// Joints whose friction drives them, under the correction.
    pub negative: Vec<Negative>,
    /// What the fit looks like where nothing was found.
    pub hint: Option<Hint>,
}

/// Looks for what is wrong with the set-up. `stopped` ends it early with what is found so far.
pub fn search(problem: &Problem, stopped: &(dyn Fn() -> bool + Sync)) -> Searched {
    let n = problem.robot.joints();
    let mut out = Searched {
        found: Vec::new(),
        correction: Correction::none(n),
        negative: Vec::new(),
        hint: None,
    };
    let moving = problem.channels_that_move();
    if moving.is_empty()
        || problem.sample.len() < 4 * problem.robot.parameters().len() / n.max(1) + 40
    {
        return out;
    }
    for _ in 0..ROUNDS {
        let Some((found, negative, declared)) = round(problem, &out.correction, &moving, stopped)
        else {
            break;
        };
        out.negative = negative;
        let Some(found) = found else {
            if let Some(declared) = declared.filter(|_| out.found.is_empty()) {
                out.hint = hint(problem, &declared, stopped);
            }
            break;
        };
        if let Some(tilt) = leans(problem, &out.correction, &found) {
            out.hint = out.found.is_empty().then_some(tilt);
            break;
        }
        let sure = found.sure;
        if sure {
            out.correction = out.correction.with(&found.change);
        }
        out.found.push(found);
        if !sure || stopped() {
            break;
        }
    }
    out
}

/// A gravity that is off by less than a fault is: a base that leans.
fn leans(problem: &Problem, base: &Correction, found: &Found) -> Option<Hint> {
    let Change::Gravity(gravity) = found.change else {
        return None;
    };
    let now = base.gravity.unwrap_or(problem.robot.tree().gravity());
    let small = |change: &Change| match change {
        Change::Zero(j, angle) => Some(Small::Zero(*j, *angle, 0.0)),
        _ => None,
    };
    (hypotheses::angle(&gravity, &now) < TILT).then(|| Hint {
        small: Small::Tilt(gravity),
        error: found.error,
        gain: found.gain,
        needed: found.needed,
        tried: found.tried,
        tied: found.tied.iter().filter_map(small).collect(),
    })
}

/// What was found, joints whose friction drives them, and the set-up as it is, fitted to few rows where they are poses.
type Round = (Option<Found>, Vec<Negative>, Option<Trial>);

fn round(
    problem: &Problem,
    base: &Correction,
    moving: &[usize],
    stopped: &(dyn Fn() -> bool + Sync),
) -> Option<Round> {
    let few = problem.sample.spread(SCREENED);
    let all: Vec<usize> = (0..problem.sample.len()).collect();
    let Some(declared) = Trial::new(problem, base.clone(), &few, BLOCKS, None) else {
        let found = impossible(problem, base, moving, [&few, &all])?;
        return Some((Some(found), Vec::new(), None));
    };
    let few_judged = judged(problem, None, None, declared);
    let declared = &few_judged.trial;
    if !doubtful(problem, declared, &few_judged.positives, &few, moving) {
        let negative = negative(&few_judged.positives);
        return Some((None, negative, Some(few_judged.trial)));
    }
    let mut changes = hypotheses::of_torques(problem, moving);
    changes.extend(hypotheses::of_positions(problem, moving));
    changes.extend(hypotheses::of_zeros(problem));
    changes.extend(hypotheses::of_gravity(problem, base));
    let tried = changes.len();
    let usual = sizes(problem, base);
    let score = |change: &Change| {
        if stopped() {
            return None;
        }
        let trial = Trial::new(problem, base.with(change), &few, 1, Some(declared))?;
        Some(trial.fit.score + sizes(problem, &trial.by) - usual)
    };
    let mut scores: Vec<Option<f64>> = changes.par_iter().map(score).collect();
    if stopped() {
        return None;
    }
    let few_rows = Fitted {
        problem,
        base,
        rows: &few,
        blocks: 1,
        declared,
    };
    let fitted = few_rows.proposals(&changes, &scores, moving);
    let fixed = changes.len();
    scores.extend(fitted.iter().map(|(_, score)| Some(*score)));
    changes.extend(fitted.into_iter().map(|(change, _)| change));
    let whole = Trial::new(problem, base.clone(), &all, BLOCKS, None)?;
    let whole = judged(problem, None, None, whole);
    let negative = negative(&whole.positives);
    let mut order: Vec<usize> = (0..changes.len())
        .filter(|i| scores[*i].is_some())
        .collect();
    // stable: the simplest of equals stays first
    order.sort_by(|a, b| {
        scores[*b]
            .unwrap_or(0.0)
            .total_cmp(&scores[*a].unwrap_or(0.0))
    });
    let forbidden = joints_below(&whole.positives, NEGATIVE);
    let forced = |change: &Change| match change {
        // a motor behind a linkage is no joint
        Change::Sign(_, joints) if problem.channels.drive == Drive::Motors => {
            !forbidden.is_empty() && (joints.len() == 1 || *joints == moving)
        }
        Change::Sign(_, joints) => {
            !forbidden.is_empty()
                && (*joints == forbidden
                    || *joints == moving
                    || matches!(&joints[..], [j] if forbidden.contains(j)))
        }
        _ => false,
    };
    let better = |i: &usize| scores[*i].is_some_and(|s| s > declared.fit.score);
    let mut short: Vec<usize> = order
        .iter()
        .copied()
        .filter(better)
        .take(SHORT_LIST)
        .collect();
    let rest: Vec<usize> = order
        .iter()
        .copied()
        .filter(|i| forced(&changes[*i]) && !short.contains(i))
        .collect();
    short.extend(rest);
    short.sort_unstable();
    let declared = Some(&whole.trial);
    let judge = |i: &usize| {
        let change = (base, &changes[*i]);
        on_all_rows(problem, change, *i >= fixed, &all, declared)
    };
    let list: Vec<Judged> = short.par_iter().filter_map(judge).collect();
    let found = decide(problem, &whole, list, tried);
    Some((found, negative, Some(few_judged.trial)))
}
