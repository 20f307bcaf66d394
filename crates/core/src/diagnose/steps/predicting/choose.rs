//! Which terms take part of the error of blocks left out, in every turn the best of each joint.

use rayon::prelude::*;

use super::StepResult;
use crate::diagnose::candidates::{exclude, is_untold};
use crate::diagnose::problem::case::DiagnosisCase;
use crate::diagnose::search::{ChosenCandidate, Field, own_joint};
use crate::diagnose::watch::DiagnosisWatch;
use crate::effect::{AugmentedModel, Family, LogCoverage, ModelEffect, Role, ShapeSearch};
use crate::judge::ErrorGain;

/// Whether an effect may be written for prediction alone: friction, what goes round with the position, and what goes by
/// the load, with its shape inside its range. The corner of Coulomb friction, by whose
/// direction all other friction goes, is named from three deviations on. A law of time, of the pose or of another
/// joint's motion is told from others by other motions alone, an elasticity or a delay is no torque of which a part predicts, and a formula of the user's own
/// is named or not.
pub(super) fn may_predict(
    model: &AugmentedModel,
    (case, cover): (&DiagnosisCase, &LogCoverage),
    effect: &ModelEffect,
) -> bool {
    let (law, entry) = (effect.law, effect.law.entry);
    let goes_round = entry.search == ShapeSearch::Orders;
    let predicts = |family: &Family| match family {
        Family::Velocity | Family::Load | Family::Memory => true,
        Family::Position => goes_round,
        _ => false,
    };
    let by_pose = entry.families.contains(&Family::Position) && !goes_round;
    let of_columns =
        entry.role == Role::Columns && law.formula.is_none() && law.direction.is_none();
    predicts(&effect.family()) && !by_pose && of_columns && !is_untold(model, case, cover, effect)
}

/// A candidate that passes for a joint.
struct AdmittedCandidate {
    candidate: usize,
    gain: ErrorGain,
    joint: usize,
    /// Part of the joint's rms error that it takes off.
    part: f64,
}

impl Field<'_> {
    /// Chooses what predicts: in every turn the best of each joint, until none takes what one asks of it.
    pub(super) fn choose_predicting(
        &self,
        watch: DiagnosisWatch,
    ) -> StepResult<Vec<ChosenCandidate>> {
        let of_model = &self.summed.about.effects;
        let own = |i: &usize| {
            let effect = &self.candidates[*i].effect;
            !self.terms_of(*i).is_empty() && !of_model.iter().any(|e| exclude(e, effect))
        };
        let mut open: Vec<usize> = (0..self.candidates.len()).filter(own).collect();
        let mut chosen: Vec<ChosenCandidate> = Vec::new();
        for _ in 0..self.prepared.case.prediction.of_a_joint {
            watch.unless_stopped()?;
            let terms = self.terms(&chosen);
            let left_out = self.left_out(&terms)?;
            let errors = left_out.errors();
            let joints = terms.weights.len();
            let before: Vec<f64> = (0..joints)
                .map(|j| terms.weights[j] * errors.iter().map(|e| e[j]).sum::<f64>())
                .collect();
            let look = |i: &usize| {
                let gain = left_out.gain(self.terms_of(*i));
                self.admitted(*i, gain, &before)
            };
            let admitted: Vec<AdmittedCandidate> = open.par_iter().filter_map(look).collect();
            let mut next: Vec<&AdmittedCandidate> = Vec::new();
            for j in 0..joints {
                let own = admitted.iter().filter(|a| a.joint == j);
                let best = own.max_by(|a, b| a.part.total_cmp(&b.part));
                let effect = |a: &AdmittedCandidate| &self.candidates[a.candidate].effect;
                let stands =
                    |a: &&AdmittedCandidate| !next.iter().any(|n| exclude(effect(n), effect(a)));
                next.extend(best.filter(stands));
            }
            if next.is_empty() {
                break;
            }
            // where nothing was taken the next turn finds what this one did
            open.retain(|i| {
                let effect = &self.candidates[*i].effect;
                let taken =
                    |a: &&AdmittedCandidate| exclude(&self.candidates[a.candidate].effect, effect);
                let near = next.iter().any(|a| effect.place.touches(a.joint));
                near && !next.iter().any(taken)
            });
            chosen.extend(next.into_iter().map(|a| ChosenCandidate {
                candidate: a.candidate,
                gain: a.gain.clone(),
                error: left_out.error(),
                alternatives: Vec::new(),
                accepted: false,
            }));
        }
        Ok(chosen)
    }

    /// A candidate for the joint whose error it takes most off, where that is enough and no other joint loses as much;
    /// `before` are the weighted squares of blocks left out, joint by joint.
    fn admitted(
        &self,
        candidate: usize,
        gain: ErrorGain,
        before: &[f64],
    ) -> Option<AdmittedCandidate> {
        let numbers = &self.prepared.case.prediction;
        let part = |j: usize| match before[j] > 0.0 {
            true => 1.0 - (1.0 - gain.joints[j][0] / before[j]).max(0.0).sqrt(),
            false => 0.0,
        };
        let passes = |j: &usize| {
            let [value, error] = gain.joints[*j];
            value > 0.0 && value > numbers.errors * error && part(*j) > numbers.part
        };
        let loses = |j: usize| {
            let [value, error] = gain.joints[j];
            value < -numbers.errors * error && part(j) < -numbers.part
        };
        let joint = match own_joint(self.candidates[candidate].effect.place) {
            Some(j) => Some(j).filter(passes),
            None if !gain.is_beyond(numbers.errors, None) => None,
            None => {
                let own = (0..before.len()).filter(passes);
                own.max_by(|a, b| part(*a).total_cmp(&part(*b)))
            }
        }?;
        let harmless = (0..before.len()).all(|j| j == joint || !loses(j));
        let part = part(joint);
        harmless.then_some(AdmittedCandidate {
            candidate,
            gain,
            joint,
            part,
        })
    }
}
