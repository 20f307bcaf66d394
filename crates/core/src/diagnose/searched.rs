//! What is chosen of all candidates: one pass over the rows, then the search; once more about the friction laws that
//! are found, for what goes by a joint's direction goes by its law.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidates::{Candidate, NotTried, candidates, is_friction_law};
use super::error::DiagnoseError;
use super::prepared::{PreparedCase, Summed};
use super::problem::fit::{declared_terms, determines_some};
use super::problem::pass::{ColumnLayout, Data, pass};
use super::search::{Chosen, Field, Looked};
use super::tables::verified;
use super::watch::Watch;
use crate::effect::{Added, AugmentedModel};
use crate::explain::ErrorText;
use crate::judge::{BlockSums, LEAST_PARTS, compare, weighted};
use crate::motion::{MotionError, Stretch};

/// What the search came to.
pub struct SearchedCase {
    /// Those that were chosen in their best shape.
    pub candidates: Vec<Candidate>,
    pub not_tried: Vec<NotTried>,
    pub summed: Summed,
    pub chosen: Vec<Chosen>,
    pub looked: Vec<Looked>,
    /// Squared error of blocks left out by all that was chosen, in the weights of the joints.
    pub error: f64,
    /// The sums with as much noise again in the positions; none where nothing was chosen.
    pub noisier: Option<BlockSums>,
    /// Friction laws by whose direction friction goes.
    pub directions: Vec<Added>,
    /// Whether the declared model explains more of blocks left out than no torque does.
    pub determined: bool,
}

impl PreparedCase<'_> {
    /// Sums about a model; friction goes by the `directions` of these laws.
    pub fn summed(
        &self,
        about: AugmentedModel,
        candidates: &[Candidate],
        directions: &[Added],
    ) -> Result<Summed, MotionError> {
        let layout = ColumnLayout::of(&self.unknowns, candidates);
        let mut declared = declared_terms(self.case, &self.unknowns, &layout, &about);
        declared.weights.clone_from(&self.fitted.weights);
        let mut summed = Summed {
            about,
            directions: directions.to_vec(),
            layout,
            sums: BlockSums::default(),
            declared,
        };
        summed.sums = self.passed(&summed, candidates, self.data.stretches)?;
        Ok(summed)
    }

    /// A pass over stretches for the same columns.
    fn passed(
        &self,
        summed: &Summed,
        candidates: &[Candidate],
        stretches: &[Stretch],
    ) -> Result<BlockSums, MotionError> {
        let mut beside = summed.about.clone();
        beside.effects.extend_from_slice(&summed.directions);
        let columns = (&self.unknowns, candidates);
        let data = Data {
            stretches,
            ..self.data
        };
        pass(&beside, columns, &summed.layout, &data, &self.all_blocks)
    }

    /// The sums with as much noise again in the positions as they have, in the mean over both signs of it.
    pub fn noisier(
        &self,
        summed: &Summed,
        candidates: &[Candidate],
    ) -> Result<BlockSums, MotionError> {
        let mut candidates = candidates.to_vec();
        let summed_too = candidates.iter_mut().zip(&summed.layout.candidates);
        let not = summed_too.filter(|(_, terms)| terms.is_empty());
        not.for_each(|(candidate, _)| candidate.bounds.clear());
        let with = |sign: f64| {
            let stretches = self.data.stretches.par_iter().enumerate();
            let noisy = stretches.map(|(seed, s)| {
                let filter = self.data.filters.of(s);
                filter.with_added_noise(s, seed as u64, sign)
            });
            let noisy: Vec<Stretch> = noisy.collect::<Result<_, _>>()?;
            self.passed(summed, &candidates, &noisy)
        };
        Ok(with(1.0)?.mean(&with(-1.0)?))
    }

    pub fn field<'b>(&'b self, candidates: &'b [Candidate], summed: &'b Summed) -> Field<'b> {
        Field {
            prepared: self,
            candidates,
            summed,
        }
    }

    /// Chooses what gains, and what the user wants.
    pub fn search(&self, watch: Watch) -> Result<SearchedCase, DiagnoseError> {
        let model = &self.fitted.model;
        let (mut candidates, not_tried) = candidates(model, self.case, &self.cover);
        let mut summed = self.summed(model.clone(), &candidates, &[])?;
        if !determines_some(&summed.sums, &summed.declared) && !self.case.keep {
            return Err(self.nothing_determined());
        }
        let field = self.field(&candidates, &summed);
        let errors = field.left_out(&summed.declared)?.errors();
        let weights = &summed.declared.weights;
        let gain = compare(&torque_squares(&summed.sums), &errors, weights);
        let determined = gain.is_beyond(self.case.numbers.screen, None);
        let error = weighted(&errors, weights);
        let (mut chosen, mut looked) = (Vec::new(), Vec::new());
        let mut directions = Vec::new();
        if self.blocks.parts >= LEAST_PARTS {
            (chosen, looked) = field.search(Vec::new(), watch)?;
            let smooth = |c: &&Chosen| {
                let effect = field.effect(c);
                is_friction_law(effect) && effect.law.direction.is_some()
            };
            let laws: Vec<Chosen> = chosen.iter().filter(smooth).cloned().collect();
            directions = self.agreed(&mut candidates, &summed, &laws)?;
            if !directions.is_empty() {
                summed = self.summed(model.clone(), &candidates, &directions)?;
                let field = self.field(&candidates, &summed);
                (chosen, looked) = field.search(laws, watch)?;
            }
        }
        self.accept(&candidates, &looked, error, &mut chosen)?;
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

    /// Friction laws in their best shape whose parts agree, with no amplitude.
    fn agreed(
        &self,
        candidates: &mut [Candidate],
        summed: &Summed,
        laws: &[Chosen],
    ) -> Result<Vec<Added>, MotionError> {
        if laws.is_empty() {
            return Ok(Vec::new());
        }
        let polished = self.polished(candidates, summed, laws, &[])?;
        let field = self.field(candidates, &polished);
        let found = verified(&field, laws, None);
        let agreed = found.iter().filter(|v| v.agreement.s > 0.0);
        let effects = agreed.map(|v| candidates[v.chosen.candidate].effect.clone());
        Ok(effects.collect())
    }

    /// Adds the effects that the user wants.
    fn accept(
        &self,
        candidates: &[Candidate],
        looked: &[Looked],
        error: f64,
        chosen: &mut Vec<Chosen>,
    ) -> Result<(), DiagnoseError> {
        let wishes = &self.case.wishes;
        for wanted in wishes.accepted.iter().filter(|w| !wishes.is_formula(w)) {
            let is = |c: usize| self.case.is_named(&candidates[c].effect, wanted);
            if chosen.iter().any(|c| is(c.candidate)) {
                continue;
            }
            let own = looked.iter().filter(|l| is(l.candidate));
            let best = own.max_by(|a, b| a.gain.value.total_cmp(&b.gain.value));
            let best = best.ok_or_else(|| not_there(wanted))?;
            chosen.push(Chosen {
                candidate: best.candidate,
                gain: best.gain.clone(),
                error,
                alternatives: Vec::new(),
            });
        }
        Ok(())
    }
}

fn not_there((name, joint): &(String, Option<String>)) -> DiagnoseError {
    let place = joint.as_ref().map_or(String::new(), |j| format!(" of {j}"));
    DiagnoseError::Accept {
        name: format!("{name}{place}"),
        why: ErrorText::new("it was not among the candidates: see `candidates` in the JSON document for those that there are").remedy("a formula is there with --search"),
    }
}

/// Squared torque of every block, `[block][joint]`: it stands before the residual, which is last.
fn torque_squares(sums: &BlockSums) -> Vec<Vec<f64>> {
    let square = |s: &DMatrix<f64>| s[(s.nrows() - 2, s.nrows() - 2)];
    let of_block = |joints: &Vec<_>| joints.iter().map(square).collect();
    sums.blocks.iter().map(of_block).collect()
}
