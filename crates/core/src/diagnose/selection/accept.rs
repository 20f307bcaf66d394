//! What a candidate must pass to be added: all tests must agree.

use crate::diagnose::candidates::baseline::Baseline;
use crate::diagnose::candidates::candidate::Candidate;
use crate::diagnose::candidates::columns::columns;
use crate::diagnose::candidates::score::spread;
use crate::diagnose::candidates::search::RoundResult;
use crate::diagnose::placebo::draws::Placebos;
use crate::diagnose::placebo::processing::Artefact;
use crate::diagnose::problem::case::SelectionLimits;
use crate::diagnose::problem::data_split::DataSplit;
use crate::diagnose::problem::fit::FittedModel;
use crate::diagnose::problem::fit_problem::FitProblem;
use crate::diagnose::problem::wide_motion::WideMotion;
use crate::effect::{Place, Seen, Torques};
use crate::motion::MotionError;

/// Standard errors by which the error on the veto pieces may grow by chance.
const VETO_CHANCE: f64 = 1.0;

impl SelectionLimits {
    /// Whether the squared errors on the pieces that may veto grow by more than the limit, and by more than
    /// chance makes of them.
    pub(crate) fn vetoes(&self, before: &[f64], after: &[f64]) -> bool {
        let sum = |x: &[f64]| x.iter().sum::<f64>();
        let chance = match before.len() {
            0 | 1 => 0.0,
            _ => VETO_CHANCE * spread(before, after),
        };
        sum(after) > self.veto_ratio * sum(before) + chance
    }
}

/// How much a candidate removes, over what there is.
#[derive(Debug, Clone, Copy)]
struct Worth {
    of_declared: f64,
    of_noise: f64,
}

/// Decides on all candidates of a round but for chance.
pub(crate) fn accept<'a>(
    found: &mut [Candidate],
    limits: &SelectionLimits,
    (at, split): (&FittedModel, &DataSplit),
    baseline: &Baseline,
    seen: &dyn Fn(Place) -> Seen<'a>,
) {
    for candidate in found {
        let removed = candidate.score.as_ref().map_or(0.0, |s| s.gain) * at.square;
        let place = candidate.effect.place;
        let worth = Worth {
            of_declared: removed / baseline.declared_square(at, place),
            of_noise: removed / baseline.noise_square(at, split, place),
        };
        // a size that may be zero is judged with its deviation, after the fit
        let broken = candidate
            .effect
            .broken(&seen(place), &|rule| rule.may_be_zero);
        decide(candidate, limits, (worth, broken.map(|(_, why)| why)));
    }
}

/// Puts those that are left to the last test: placebos of a model that lacks nothing are seldom as good.
///
/// # Errors
/// [`MotionError`] of the filters.
pub(crate) fn beyond_chance(
    found: &mut RoundResult,
    limits: &SelectionLimits,
    (at, problem): (&FittedModel, &FitProblem),
    torques: &[Torques],
    wide: Option<&WideMotion>,
) -> Result<(), MotionError> {
    let left = |c: &Candidate| c.accepted || c.significant || c.impossible;
    if !found.candidates.iter().any(left) {
        return Ok(());
    }
    let placebos = Placebos::of(&found.test.blocks, &found.tried);
    let artefact = wide
        .map(|wide| Artefact::of(at, problem, wide))
        .transpose()?;
    let pairs = found.candidates.iter_mut().zip(&found.tried).enumerate();
    for (i, (candidate, tried)) in pairs.filter(|(_, (c, _))| left(c)) {
        let p = placebos.p_value(i, tried);
        candidate.placebo_p_value = Some(p);
        if p > limits.false_alarm {
            candidate.reject(&format!(
                "not significant (corrected p = {p:.3} by placebos, at most {} is asked)",
                limits.false_alarm
            ));
            continue;
        }
        let Some(artefact) = &artefact else { continue };
        let effect = &candidate.effect;
        let columns = columns(&at.model, problem, torques, effect)?;
        let alone = found
            .test
            .p_value_beyond(&columns, effect.linear.len(), artefact);
        let beyond = placebos.p_value_of(i, tried, alone);
        candidate.placebo_p_value = Some(p.max(beyond));
        if beyond > limits.false_alarm {
            candidate.reject(&format!(
                "filtering and noise of the positions alone leave such a residual in a model that lacks nothing; \
                 beyond that, p = {beyond:.3}"
            ));
        }
    }
    Ok(())
}

/// Puts a candidate to every other test; `broken` says why its numbers are none that a machine has.
fn decide(
    candidate: &mut Candidate,
    limits: &SelectionLimits,
    (worth, broken): (Worth, Option<String>),
) {
    let Some(s) = &candidate.score else { return };
    let refusal = if !s.beta.iter().all(|b| b.is_finite()) {
        Some("its coefficients are not finite".to_owned())
    } else if s.unique_share < limits.unique_share {
        Some(format!(
            "the declared parameters explain all but {:.2} % of it",
            100.0 * s.unique_share
        ))
    } else {
        None
    };
    let small = if worth.of_declared < limits.worth {
        let percent = 100.0 * worth.of_declared;
        Some(format!(
            "too small to matter: {percent:.2} % of the declared model's squared residual"
        ))
    } else if worth.of_noise < limits.over_noise {
        let times = worth.of_noise;
        Some(format!(
            "too small to matter: {times:.2} of the noise's power"
        ))
    } else {
        None
    };
    let doubt = if s.delta_bic <= 0.0 {
        Some(format!(
            "not worth its parameters: its gain in BIC is {:.1} with {:.0} effective rows",
            s.delta_bic, s.effective_rows
        ))
    } else if s.cv_gain < limits.cv_gain {
        Some(format!(
            "cross-validation: {:+.2} % of the squared error",
            100.0 * s.cv_gain
        ))
    } else if s.cv_gain < limits.cv_certainty * s.cv_std {
        Some(format!(
            "cross-validation is uncertain: {:+.2} +- {:.2} %",
            100.0 * s.cv_gain,
            100.0 * s.cv_std
        ))
    } else if limits.vetoes(&s.vetoes[0], &s.vetoes[1]) {
        Some(format!(
            "vetoed: it makes the squared error on data set aside {:.3} times as large",
            s.vetoes[1].iter().sum::<f64>() / s.vetoes[0].iter().sum::<f64>()
        ))
    } else {
        None
    };
    let significant = refusal.is_none() && doubt.is_none();
    let passed = significant && small.is_none();
    candidate.impossible = passed && broken.is_some();
    candidate.significant = significant && broken.is_none();
    candidate.accepted = passed && broken.is_none();
    candidate.reason = refusal.or(broken).or(small).or(doubt).unwrap_or_default();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::candidates::score::CandidateScore;
    use crate::effect::Added;

    fn decided(change: impl Fn(&mut CandidateScore), worth: Worth) -> Candidate {
        let mut score = CandidateScore {
            beta: vec![1.0],
            gain: 0.2,
            unique_share: 0.5,
            p_value: 1e-9,
            delta_bic: 30.0,
            effective_rows: 500.0,
            cv_gain: 0.2,
            cv_std: 0.05,
            folds: vec![1.0; 10],
            vetoes: [vec![1.0; 10], vec![0.9; 10]],
        };
        change(&mut score);
        let laws = crate::effect::LAWS;
        let law = laws.iter().find(|l| l.entry.name == "torque-offset");
        let law = law.unwrap();
        let mut candidate = Candidate {
            effect: Added::new(law, Place::Joint(0), Vec::new(), vec![1.0]),
            score: Some(score),
            accepted: false,
            significant: false,
            impossible: false,
            placebo_p_value: None,
            reason: String::new(),
        };
        decide(&mut candidate, &SelectionLimits::default(), (worth, None));
        candidate
    }

    #[test]
    fn what_is_no_chance_and_too_small_is_significant_and_not_accepted() {
        let large = Worth {
            of_declared: 0.5,
            of_noise: 3.0,
        };
        let small = Worth {
            of_noise: 0.05,
            ..large
        };
        let found = decided(|_| {}, large);
        assert!(found.accepted && found.significant && found.reason.is_empty());
        let found = decided(|_| {}, small);
        assert!(!found.accepted && found.significant);
        assert!(found.reason.starts_with("too small"), "{}", found.reason);
        // what fails another test too is no remainder, whichever reason is told
        type ScoreChange = fn(&mut CandidateScore);
        let failures: [(ScoreChange, &str); 5] = [
            (
                |s| s.unique_share = 1e-4,
                "the declared parameters explain all but 0.01 %",
            ),
            (|s| s.delta_bic = -1.0, "not worth"),
            (|s| s.cv_gain = 0.001, "cross-validation:"),
            (|s| s.cv_std = 0.3, "cross-validation is uncertain"),
            (|s| s.vetoes[1] = vec![1.1; 10], "vetoed"),
        ];
        for (change, says) in failures {
            let found = decided(change, large);
            assert!(!found.accepted && !found.significant, "{says}");
            assert!(found.reason.starts_with(says), "{}", found.reason);
            assert!(!decided(change, small).significant, "{says}");
        }
    }
}
