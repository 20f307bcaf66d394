//! What is chosen of all candidates: one pass over the rows, then the search; once more about the friction laws that
//! are found, for what goes by a joint's direction goes by its law.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidates::{EffectCandidate, NotTried, candidates, exclude, is_friction_law};
use super::change::stepped_joints;
use super::error::DiagnoseError;
use super::outcome::FoundEffect;
use super::polish::with_columns_of;
use super::prepared::{PreparedCase, SummedProducts};
use super::problem::case::AcceptedEffect;
use super::problem::fit::{declared_terms, determines_some};
use super::problem::pass::{ColumnLayout, WeightedRows, pass};
use super::search::{ChosenCandidate, Field, RejectedCandidate};
use super::tables::EffectEstimates;
use super::watch::DiagnosisWatch;
use crate::effect::{AugmentedModel, ModelEffect};
use crate::explain::ErrorText;
use crate::judge::{BlockSums, Bound, TimeBlock, compare, weighted};
use crate::motion::{MotionError, Stretch};

/// Coefficients that a law can do without and that are within so many deviations of nil.
fn needless(step: &FoundEffect, deviations: f64) -> impl Iterator<Item = usize> {
    let effect = &step.estimate;
    let (first, size) = (effect.shape.len(), effect.parameters());
    (0..effect.linear.len()).filter(move |k| {
        let key = effect.law.entry.key(effect.law.linear[*k]);
        let variance = step.covariance[(first + k) * (size + 1)];
        let within = effect.linear[*k].powi(2) <= deviations * deviations * variance;
        key.is_some_and(|key| key.optional) && within
    })
}

/// What the search came to.
pub struct SearchedCase {
    /// Those that were chosen in their best shape.
    pub candidates: Vec<EffectCandidate>,
    pub not_tried: Vec<NotTried>,
    pub summed: SummedProducts,
    pub chosen: Vec<ChosenCandidate>,
    pub looked: Vec<RejectedCandidate>,
    /// Squared error of blocks left out by all that was chosen, in the weights of the joints.
    pub error: f64,
    /// The sums with as much noise again in the positions; none where nothing was chosen.
    pub noisier: Option<BlockSums>,
    /// Friction laws by whose direction friction goes.
    pub directions: Vec<ModelEffect>,
    /// Whether the declared model explains more of blocks left out than no torque does.
    pub determined: bool,
}

impl PreparedCase<'_> {
    /// Sums about a model; friction goes by the `directions` of these laws.
    pub fn summed(
        &self,
        about: AugmentedModel,
        candidates: &[EffectCandidate],
        directions: &[ModelEffect],
    ) -> Result<SummedProducts, MotionError> {
        self.summed_over(about, candidates, (directions, &self.blocks.list))
    }

    /// The same over some blocks.
    pub fn summed_over(
        &self,
        about: AugmentedModel,
        candidates: &[EffectCandidate],
        (directions, blocks): (&[ModelEffect], &[TimeBlock]),
    ) -> Result<SummedProducts, MotionError> {
        let layout = ColumnLayout::of(&self.unknowns, candidates);
        let mut declared = declared_terms(self.case, &self.unknowns, &layout, &about);
        declared.weights.clone_from(&self.fitted.weights);
        let mut summed = SummedProducts {
            about,
            directions: directions.to_vec(),
            layout,
            sums: BlockSums::default(),
            declared,
        };
        summed.sums = self.passed(&summed, candidates, (&self.data, blocks))?;
        Ok(summed)
    }

    /// A pass over rows for the same columns.
    fn passed(
        &self,
        summed: &SummedProducts,
        candidates: &[EffectCandidate],
        (data, blocks): (&WeightedRows, &[TimeBlock]),
    ) -> Result<BlockSums, MotionError> {
        let mut beside = summed.about.clone();
        beside.effects.extend_from_slice(&summed.directions);
        let columns = (&self.unknowns, candidates);
        pass(&beside, columns, &summed.layout, data, blocks)
    }

    /// The sums with as much noise again in the positions as they have, in the mean over both signs of it.
    pub fn noisier(
        &self,
        summed: &SummedProducts,
        candidates: &[EffectCandidate],
    ) -> Result<BlockSums, MotionError> {
        let mut candidates = candidates.to_vec();
        let summed_too = candidates.iter_mut().zip(&summed.layout.candidates);
        let not = summed_too.filter(|(_, terms)| terms.is_empty());
        not.for_each(|(candidate, _)| candidate.clear_columns());
        let with = |sign: f64| {
            let stretches = self.data.stretches.par_iter().enumerate();
            let noisy = stretches.map(|(seed, s)| {
                let filter = self.data.filters.of(s);
                filter.with_added_noise(s, seed as u64, sign)
            });
            let noisy: Vec<Stretch> = noisy.collect::<Result<_, _>>()?;
            let data = WeightedRows {
                stretches: &noisy,
                constant: None,
                ..self.data
            };
            self.passed(summed, &candidates, (&data, &self.blocks.list))
        };
        Ok(with(1.0)?.mean(&with(-1.0)?))
    }

    pub fn field<'b>(
        &'b self,
        candidates: &'b [EffectCandidate],
        summed: &'b SummedProducts,
    ) -> Field<'b> {
        Field {
            prepared: self,
            candidates,
            summed,
        }
    }

    /// Chooses what gains, and what the user wants.
    pub fn search(&self, watch: DiagnosisWatch) -> Result<SearchedCase, DiagnoseError> {
        let model = &self.fitted.model;
        let (mut candidates, not_tried) = candidates(model, self.case, &self.cover);
        let mut summed = self.summed(model.clone(), &candidates, &[])?;
        if !determines_some(&summed.sums, &summed.declared) && self.case.kept.is_none() {
            return Err(self.nothing_determined());
        }
        let field = self.field(&candidates, &summed);
        let left_out = field.left_out(&summed.declared)?;
        let errors = left_out.errors();
        let weights = &summed.declared.weights;
        let gain = compare(&torque_squares(&summed.sums), &errors, weights);
        let determined = gain.is_beyond(self.case.numbers.screen, None);
        let error = weighted(&errors, weights);
        let (mut chosen, mut looked) = (Vec::new(), Vec::new());
        let mut directions = Vec::new();
        if self.blocks.list.len() >= self.case.numbers.least_blocks {
            let stepped = stepped_joints(&field, &left_out);
            (chosen, looked) = field.search(Vec::new(), &stepped, watch)?;
            let smooth = |c: &&ChosenCandidate| {
                let effect = field.effect(c);
                is_friction_law(effect) && effect.law.direction.is_some()
            };
            let laws: Vec<ChosenCandidate> = chosen.iter().filter(smooth).cloned().collect();
            directions = self.agreed(&mut candidates, &summed, &laws)?;
            if !directions.is_empty() {
                summed = self.summed(model.clone(), &candidates, &directions)?;
                let field = self.field(&candidates, &summed);
                (chosen, looked) = field.search(laws, &stepped, watch)?;
            }
        }
        let field = self.field(&candidates, &summed);
        self.accept(&field, &not_tried, &mut chosen)?;
        let mut noisier = None;
        if !chosen.is_empty() {
            summed = self.polished(&mut candidates, &summed, &chosen, &directions)?;
            noisier = Some(self.noisier(&summed, &candidates)?);
        }
        Ok(SearchedCase {
            noisier,
            error,
            determined,
            candidates,
            not_tried,
            summed,
            chosen,
            looked,
            directions,
        })
    }

    /// Gives effects that stand the shapes that they want now that the others left, and takes out numbers that a law can do
    /// without and these data do not show; whether that moved anything.
    pub fn forget_those_that_left(
        &self,
        searched: &mut SearchedCase,
        judged: &[FoundEffect],
    ) -> Result<bool, MotionError> {
        let chosen = searched.chosen.iter().zip(judged);
        let standing: Vec<_> = chosen.filter(|(_, step)| step.written.is_some()).collect();
        let bends = |c: &ChosenCandidate| !searched.candidates[c.candidate].slopes.is_empty();
        let mut moves =
            standing.len() < judged.len() && standing.iter().any(|(chosen, _)| bends(chosen));
        for (chosen, step) in &standing {
            let own = &mut searched.candidates[chosen.candidate];
            for k in needless(step, self.case.numbers.screen) {
                moves |= own.bounds[k] != Bound::NIL;
                own.bounds[k] = Bound::NIL;
                own.effect.held[step.estimate.shape.len() + k] = true;
            }
        }
        if !moves {
            return Ok(false);
        }
        let standing: Vec<ChosenCandidate> = standing.iter().map(|(c, _)| (*c).clone()).collect();
        let SearchedCase {
            candidates,
            summed,
            directions,
            chosen,
            ..
        } = &mut *searched;
        let found = self.polished(candidates, summed, &standing, directions)?;
        let asked = with_columns_of(candidates, chosen);
        *summed = self.summed(found.about, &asked, directions)?;
        searched.noisier = Some(self.noisier(summed, &asked)?);
        Ok(true)
    }

    /// Friction laws in their best shape that are sure, with no amplitude.
    fn agreed(
        &self,
        candidates: &mut [EffectCandidate],
        summed: &SummedProducts,
        laws: &[ChosenCandidate],
    ) -> Result<Vec<ModelEffect>, DiagnoseError> {
        if laws.is_empty() {
            return Ok(Vec::new());
        }
        let polished = self.polished(candidates, summed, laws, &[])?;
        let field = self.field(candidates, &polished);
        let estimates = EffectEstimates::of(&field, laws)?;
        let numbers = field.numbers();
        let sure = (laws.iter().zip(&estimates.places)).filter(|(_, place)| {
            let found = estimates
                .fit
                .amplitude(&place.terms, (None, false), numbers);
            found.s > 0.0
        });
        let law = |c: &ChosenCandidate| {
            let mut law = candidates[c.candidate].effect.clone();
            law.linear.fill(0.0);
            law
        };
        Ok(sure.map(|(c, _)| law(c)).collect())
    }

    /// Adds the effects that the user wants, each in the shape that gains most; what cannot stand beside one leaves.
    fn accept(
        &self,
        field: &Field,
        not_tried: &[NotTried],
        chosen: &mut Vec<ChosenCandidate>,
    ) -> Result<(), DiagnoseError> {
        let (wishes, robot) = (&self.case.wishes, &self.case.given.model.robot);
        for wanted in wishes.accepted.iter().filter(|w| !wishes.is_formula(w)) {
            let is = |c: usize| wanted.is(&field.candidates[c].effect, robot);
            let found = chosen.iter_mut().filter(|c| is(c.candidate));
            if let Some(found) = found.max_by(|a, b| a.gain.value.total_cmp(&b.gain.value)) {
                found.accepted = true;
                continue;
            }
            let own: Vec<usize> = (0..field.candidates.len()).filter(|c| is(*c)).collect();
            let stays = |c: &&ChosenCandidate| {
                let mut own = own.iter().map(|i| &field.candidates[*i].effect);
                !own.any(|own| exclude(field.effect(c), own))
            };
            let others: Vec<ChosenCandidate> = chosen.iter().filter(stays).cloned().collect();
            let terms = field.terms(&others);
            let left_out = field.left_out(&terms)?;
            let with_gain =
                |candidate: &usize| (*candidate, left_out.gain(field.terms_of(*candidate)));
            let gains = own.par_iter().map(with_gain).collect::<Vec<_>>();
            let best = (gains.into_iter()).max_by(|a, b| a.1.value.total_cmp(&b.1.value));
            let Some((candidate, gain)) = best else {
                return Err(self.not_there(wanted, not_tried));
            };
            let name =
                |c: usize| AcceptedEffect::of(&field.candidates[c].effect, robot).to_string();
            if left_out.share_of_its_own(field.terms_of(candidate)) <= self.case.numbers.ridge {
                return Err(DiagnoseError::Accept {
                    name: name(candidate),
                    why: ErrorText::new("these data do not show it: its torque is zero all along, or the same as that of other parameters").remedy("log a motion in which it differs from them"),
                });
            }
            let effect = &field.candidates[candidate].effect;
            let excluded = |c: &&ChosenCandidate| exclude(field.effect(c), effect);
            if let Some(other) = chosen.iter().filter(excluded).find(|c| c.accepted) {
                return Err(DiagnoseError::Exclusive {
                    first: name(other.candidate),
                    second: name(candidate),
                });
            }
            chosen.retain(|c| !excluded(&c));
            chosen.push(ChosenCandidate {
                candidate,
                gain,
                error: left_out.error(),
                alternatives: Vec::new(),
                accepted: true,
            });
        }
        Ok(())
    }

    /// Why an effect that the user wants is no candidate.
    fn not_there(&self, wanted: &AcceptedEffect, not_tried: &[NotTried]) -> DiagnoseError {
        let robot = &self.case.given.model.robot;
        let own = not_tried
            .iter()
            .find(|n| n.law.entry.name == wanted.name && n.place.name(robot) == wanted.joint);
        DiagnoseError::Accept {
            name: wanted.to_string(),
            why: match own {
                Some(own) => ErrorText::new(&own.lacking),
                None => ErrorText::new("there is no such effect at this place, or the model has it already: see `candidates` in the JSON document for those that there are").remedy("a formula is there with --search"),
            },
        }
    }
}

/// Squared torque of every block, `[block][joint]`: it stands before the residual, which is last.
fn torque_squares(sums: &BlockSums) -> Vec<Vec<f64>> {
    let square = |s: &DMatrix<f64>| s[(s.nrows() - 2, s.nrows() - 2)];
    let of_block = |joints: &Vec<_>| joints.iter().map(square).collect();
    sums.blocks.iter().map(of_block).collect()
}
