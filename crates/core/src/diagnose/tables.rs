//! The joint fit of effects that were chosen, and what leaves their set.

use nalgebra::{DMatrix, DVector};

use super::error::DiagnoseError;
use super::prepared::moved;
use super::search::{ChosenCandidate, Field, own_joint};
use crate::effect::{AugmentedModel, ModelEffect};
use crate::judge::{EffectAmplitude, EffectTerms, ErrorGain, JointFit, Terms};

/// What the blocks say of an effect.
#[derive(Debug, Clone)]
pub struct VerifiedEffect {
    pub amplitude: EffectAmplitude,
    /// Its coefficients by block, all else as the joint fit has it.
    pub blocks: Vec<Vec<f64>>,
    pub beside: MarginalGain,
}

/// What an effect is worth beside others, which are refitted.
#[derive(Debug, Clone)]
pub struct MarginalGain {
    /// Gain on blocks left out, and their squared error without it.
    pub gain: ErrorGain,
    pub error: f64,
    /// Whether it takes off some joint's error there what one would notice.
    pub noticeable: bool,
}

/// The joint fit of declared terms and effects, shapes free.
pub struct EffectEstimates {
    pub fit: JointFit,
    /// Of its values.
    pub covariance: DMatrix<f64>,
    /// Where the terms of each effect stand.
    pub places: Vec<TermPlaces>,
    declared: usize,
}

/// Where the terms of an effect stand.
#[derive(Debug, Clone, PartialEq)]
pub struct TermPlaces {
    pub terms: EffectTerms,
    /// Shape parameters that are free, in the order of the slopes.
    pub shapes: Vec<usize>,
}

impl EffectEstimates {
    /// The joint fit with some effects.
    pub fn of(field: &Field, effects: &[ChosenCandidate]) -> Result<Self, DiagnoseError> {
        let rows = field.prepared.case.prior.rows();
        let (terms, places) = with_shapes(field, effects);
        let fitted = field.summed.sums.blocks.len();
        let fit = JointFit::new(&field.summed.sums, fitted, terms, rows);
        let mut fit = fit.ok_or_else(|| field.prepared.nothing_determined())?;
        if let Some(kept) = &field.prepared.case.kept {
            fit.widen_by_held(&field.summed.layout.held, kept);
        }
        Ok(EffectEstimates {
            covariance: fit.covariance(),
            fit,
            places,
            declared: field.summed.declared.len(),
        })
    }

    /// What the blocks say of one of the effects of the fit.
    pub fn verified(
        &self,
        field: &Field,
        effects: &[ChosenCandidate],
        at: usize,
        noisier: Option<&[DMatrix<f64>]>,
    ) -> Result<VerifiedEffect, DiagnoseError> {
        let own = field.effect(&effects[at]);
        let numbers = &field.numbers_of(own);
        let terms = &self.places[at].terms;
        let measured = own.law.entry.measurable;
        let beside = beside_the_others(field, effects, at)?;
        Ok(VerifiedEffect {
            amplitude: self.fit.amplitude(terms, (noisier, measured), numbers),
            blocks: self.fit.by_block(terms, numbers),
            beside,
        })
    }

    /// An effect of the fit with its coefficients.
    pub fn effect(&self, field: &Field, chosen: &ChosenCandidate, at: usize) -> ModelEffect {
        let own = self.places[at].terms.coefficients.clone();
        let linear: Vec<f64> = own.map(|i| self.fit.values[i]).collect();
        effect(field, chosen, &linear)
    }

    /// Covariance of (shape, linear) of an effect, row-major; a shape that is not free has none.
    pub fn covariance_of(&self, effect: &ModelEffect, at: usize) -> Vec<f64> {
        let all = &self.covariance;
        let (count, size) = (effect.shape.len(), effect.parameters());
        let TermPlaces { terms, shapes } = &self.places[at];
        let place = |k: usize| match k.checked_sub(count) {
            Some(linear) => Some(terms.coefficients.start + linear),
            None => {
                let at = shapes.iter().position(|shape| *shape == k)?;
                Some(terms.slopes[at])
            }
        };
        let of = |k: usize| {
            let (row, column) = (k / size, k % size);
            match (place(row), place(column)) {
                (Some(row), Some(column)) => all[(row, column)],
                (None, _) if row == column && !effect.held[row] => f64::INFINITY,
                _ => 0.0,
            }
        };
        (0..size * size).map(of).collect()
    }

    /// The declared model of the fit.
    pub fn model(&self, field: &Field) -> AugmentedModel {
        let own = self.fit.values.rows(0, self.declared).into_owned();
        moved(&field.summed.about, &field.prepared.unknowns, &own)
    }

    /// Information matrix of the declared unknowns beside fixed effects, in independent rows.
    pub fn information(&self, field: &Field) -> DMatrix<f64> {
        let rows = field.prepared.case.prior.rows_per_independent;
        self.fit.information(self.declared, rows)
    }
}

/// What an effect is worth beside all the others.
pub fn beside_the_others(
    field: &Field,
    chosen: &[ChosenCandidate],
    at: usize,
) -> Result<MarginalGain, DiagnoseError> {
    let mut others = chosen.to_vec();
    let own = others.remove(at);
    let terms = field.terms(&others);
    let left_out = field.left_out(&terms)?;
    let gain = left_out.gain(field.terms_of(own.candidate));
    let errors = left_out.errors();
    let numbers = field.numbers();
    let torques = &field.summed.sums.blocks;
    let joint = own_joint(field.effect(&own).place);
    let noticed = |j: usize| {
        let before: f64 = errors.iter().map(|e| e[j]).sum();
        let torque = |sums: &DMatrix<f64>| sums[(sums.nrows() - 2, sums.nrows() - 2)];
        let torque: f64 = torques.iter().map(|joints| torque(&joints[j])).sum();
        let weight = terms.weights[j];
        let after = match weight > 0.0 {
            true => (before - gain.joints[j][0] / weight).max(0.0),
            false => before,
        };
        let off = before.sqrt() - after.sqrt();
        off > numbers.noticeable * before.sqrt() && off > numbers.noticeable_torque * torque.sqrt()
    };
    let mut joints = 0..terms.weights.len();
    let noticeable = match joint {
        Some(j) => noticed(j),
        None => joints.any(noticed),
    };
    Ok(MarginalGain {
        error: left_out.error(),
        gain,
        noticeable,
    })
}

/// Terms of declared unknowns and effects, each with the slopes by its shape, and where these stand.
fn with_shapes(field: &Field, effects: &[ChosenCandidate]) -> (Terms, Vec<TermPlaces>) {
    let mut terms = field.summed.declared.clone();
    let mut places = Vec::new();
    for c in effects {
        let candidate = &field.candidates[c.candidate];
        let first = terms.len();
        terms.list.extend_from_slice(field.terms_of(c.candidate));
        let coefficients = first..terms.len();
        let (mut shapes, mut slopes) = (Vec::new(), Vec::new());
        let all = &field.summed.layout.slopes[c.candidate];
        for ((k, _), term) in candidate.slopes.iter().zip(all) {
            if !candidate.effect.held[*k] {
                shapes.push(*k);
                slopes.push(terms.len());
                terms.list.push(term.clone());
            }
        }
        places.push(TermPlaces {
            terms: EffectTerms {
                coefficients,
                slopes,
            },
            shapes,
        });
    }
    (terms, places)
}

/// The declared model with effects of given amplitudes, its unknowns those of the fit beside them.
pub fn model(field: &Field, effects: &[(&ChosenCandidate, Vec<f64>)]) -> AugmentedModel {
    let chosen: Vec<ChosenCandidate> = effects.iter().map(|(c, _)| (*c).clone()).collect();
    let first = field.summed.declared.len();
    let amplitudes = effects.iter().flat_map(|(_, a)| a.iter().copied());
    let held: Vec<(usize, f64)> = (first..).zip(amplitudes).collect();
    let values: DVector<f64> = field.terms(&chosen).fit(&field.total(), &held).values;
    let mut model = moved(&field.summed.about, &field.prepared.unknowns, &values);
    let added = effects.iter().map(|(c, linear)| effect(field, c, linear));
    model.effects.extend(added);
    model
}

/// An effect with its amplitudes.
pub fn effect(field: &Field, chosen: &ChosenCandidate, linear: &[f64]) -> ModelEffect {
    ModelEffect {
        linear: linear.to_vec(),
        ..field.effect(chosen).clone()
    }
}
