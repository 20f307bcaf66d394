//! The curve that takes the place of an effect whose numbers no machine has.

use crate::diagnose::candidates::candidate::Candidate;
use crate::diagnose::candidates::columns::columns;
use crate::diagnose::candidates::score::CandidateTest;
use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::rows::scene;
use crate::effect::{Added, LAWS, Place, Role};
use crate::motion::MotionError;

/// A curve over the signal that the entry of a refused effect names, on its joint: the best of its ends. None where it
/// names none, or where `tried` is there already.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn stand_in(
    refused: &Candidate,
    at: &FittedModel,
    problem: &FitProblem,
    tried: &[Candidate],
) -> Result<Option<Candidate>, MotionError> {
    let chance = refused.placebo_p_value;
    let refused = &refused.effect;
    let (Some(signal), Place::Joint(j)) = (refused.law.entry.otherwise, refused.place) else {
        return Ok(None);
    };
    let Some(law) = LAWS.iter().find(|law| law.entry.role == Role::StandIn) else {
        return Ok(None);
    };
    let curves = at
        .model
        .effects
        .iter()
        .chain(tried.iter().map(|c| &c.effect));
    let same = |e: &Added| e.place == refused.place && e.curve().is_some_and(|c| c.0 == signal);
    if curves.into_iter().any(same) {
        return Ok(None);
    }
    let torques = problem.torques(&at.model);
    let along = problem.stretches.iter().zip(&torques).enumerate();
    let scenes: Vec<_> = along
        .filter(|(i, _)| !problem.split.ignores(*i, j))
        .map(|(_, (stretch, torques))| scene(&at.model, stretch, torques))
        .collect();
    let test = CandidateTest::new(at, problem);
    let mut best: Option<(f64, Candidate)> = None;
    for ends in signal.ends(&scenes, j, problem.cover.joints[j].range()) {
        let none = vec![0.0; law.linear.len()];
        let mut effect = Added::new(law, refused.place, signal.shape(ends), none);
        let columns = columns(&at.model, problem, &torques, &effect)?;
        let Some(score) = test.score(&columns, law.linear.len(), effect.shape.len()) else {
            continue;
        };
        if best.as_ref().is_none_or(|(gain, _)| score.cv_gain > *gain) {
            effect.linear.clone_from(&score.beta);
            best = Some((score.cv_gain, Candidate::open(effect, Some(score), "")));
        }
    }
    // it says what the refused effect said, which placebos have judged
    Ok(best.map(|(_, candidate)| Candidate {
        placebo_p_value: chance,
        ..candidate
    }))
}
