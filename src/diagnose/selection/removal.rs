//! Which effect a later one made superfluous.

use crate::diagnose::candidates::columns::columns;
use crate::diagnose::candidates::score::CandidateTest;
use crate::diagnose::problem::case::SelectionLimits;
use crate::diagnose::problem::fit::{FittedModel, fit};
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::motion::MotionError;

/// An effect without which the model is as good: it no longer passes what let it in.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn superfluous(
    at: &FittedModel,
    problem: &FitProblem,
    limits: &SelectionLimits,
) -> Result<Option<usize>, MotionError> {
    if at.model.effects.len() < 2 {
        return Ok(None);
    }
    let mut worst: Option<(usize, f64)> = None;
    for (i, effect) in at.model.effects.iter().enumerate() {
        let mut model = at.model.clone();
        model.effects.remove(i);
        let without = fit(&model, problem)?;
        let test = CandidateTest::new(&without, problem);
        let torques = problem.torques(&without.model);
        let columns = columns(&without.model, problem, &torques, effect)?;
        let score = test.score(&columns, effect.linear.len(), effect.shape.len());
        let needed = score.as_ref().is_some_and(|s| {
            s.cv_gain >= limits.cv_gain && s.delta_bic > 0.0 && s.p_value <= limits.false_alarm
        });
        let gain = score.map_or(0.0, |s| s.cv_gain);
        if !needed && worst.is_none_or(|(_, least)| gain < least) {
            worst = Some((i, gain));
        }
    }
    Ok(worst.map(|(i, _)| i))
}
