//! From what was chosen to two tables: estimates, and a model that predicts.

use nalgebra::{DMatrix, DVector};

use super::error::DiagnoseError;
use super::prepared::moved;
use super::search::{Chosen, Field, own_joint};
use crate::effect::{Added, AugmentedModel};
use crate::judge::{Agreement, BlockSums, ErrorGain, Terms, agreement};

/// An effect that was chosen, with what its parts say.
#[derive(Debug, Clone)]
pub struct Verified {
    pub chosen: Chosen,
    pub agreement: Agreement,
    /// Amplitude of the joint fit with all that was chosen.
    pub amplitude: Vec<f64>,
}

/// Where the terms of an effect stand.
pub struct TermPlaces {
    /// The first of its coefficients.
    pub first: usize,
    /// Shape parameters that are refined, and the place of each.
    pub shapes: Vec<(usize, usize)>,
}

/// The joint fit of declared terms and effects.
pub struct Estimates {
    /// Values of the declared unknowns, about the fitted model, then of every effect's coefficients.
    pub values: DVector<f64>,
    /// By the block jackknife and what is known beforehand: of unknowns, then of each effect's coefficients and shape.
    pub covariance: DMatrix<f64>,
    /// Of the declared unknowns beside fixed effects, in independent rows.
    pub information: DMatrix<f64>,
    /// Where the coefficients of each effect begin in it, and where its shapes stand.
    pub places: Vec<TermPlaces>,
}

/// Places of the coefficients of each effect behind the declared unknowns.
fn places(field: &Field, effects: &[Chosen]) -> Vec<Vec<usize>> {
    let mut next = field.summed.declared.len();
    let place = |c: &Chosen| {
        let first = next;
        next += field.terms_of(c.candidate).len();
        (first..next).collect()
    };
    effects.iter().map(place).collect()
}

/// Asks the parts of the data for every effect that was chosen; what sums with `noisier` positions change is in doubt.
pub fn verified(field: &Field, chosen: &[Chosen], noisier: Option<&BlockSums>) -> Vec<Verified> {
    let (prepared, numbers) = (field.prepared, field.numbers());
    let terms = field.terms(chosen);
    let values = terms.fit(&field.total(), &[]).values;
    let noisier = noisier.map(|sums| sums.over(0..prepared.blocks.list.len()));
    let of = |(at, own): (usize, Vec<usize>)| {
        let asked = (own.as_slice(), &values);
        let sums = &field.summed.sums;
        let mut agreement = agreement(sums, &prepared.blocks, &terms, asked, numbers);
        let effect = field.effect(&chosen[at]);
        if let Some(sums) = &noisier {
            let part = by_noise(&terms, sums, (prepared.unknowns.len(), asked), &agreement);
            // an effect must not be made by noise; a number that can be measured must not be hidden by it either
            let measured = effect.law.entry.measurable;
            agreement.doubt(if measured { part } else { part.max(0.0) }, numbers);
        }
        // one that gains nothing beside all the others, those after it too, is not confirmed
        let gain = beside_the_others(field, chosen, at);
        let joint = own_joint(effect.place);
        if !gain.is_ok_and(|(gain, _)| gain.is_beyond(numbers.screen, joint)) {
            agreement.s = 0.0;
        }
        Verified {
            agreement,
            amplitude: own.iter().map(|i| values[*i]).collect(),
            chosen: chosen[at].clone(),
        }
    };
    let places = places(field, chosen).into_iter();
    places.enumerate().map(of).collect()
}

/// The part of an effect's amplitude that noise of the positions adds, or takes off, beside all the others as they are.
fn by_noise(
    terms: &Terms,
    noisier: &[DMatrix<f64>],
    (declared, (own, values)): (usize, (&[usize], &DVector<f64>)),
    agreement: &Agreement,
) -> f64 {
    let others = (declared..terms.len()).filter(|i| !own.contains(i));
    let held: Vec<(usize, f64)> = others.map(|i| (i, values[i])).collect();
    let change = terms.fit(noisier, &held).values - values;
    let own = own.iter().map(|i| change[*i]);
    agreement.part(&DVector::from_vec(own.collect()))
}

/// Gain of an effect beside all the others, and the squared error without it.
pub fn beside_the_others(
    field: &Field,
    chosen: &[Chosen],
    at: usize,
) -> Result<(ErrorGain, f64), DiagnoseError> {
    let mut others = chosen.to_vec();
    let own = others.remove(at).candidate;
    let terms = field.terms(&others);
    let left_out = field.left_out(&terms)?;
    let gain = left_out.gain(field.terms_of(own));
    Ok((gain, left_out.error()))
}

impl Estimates {
    /// The joint fit with some effects.
    pub fn of(field: &Field, effects: &[Chosen]) -> Result<Self, DiagnoseError> {
        let rows_per_independent = field.prepared.case.prior.rows_per_independent;
        let total = field.total();
        let values = field.terms(effects).fit(&total, &[]).values;
        let (terms, places) = with_shapes(field, effects);
        let left_out = field.left_out(&terms)?;
        let without: Vec<&DVector<f64>> = left_out.values().collect();
        let count = without.len() as f64;
        let zero = DVector::zeros(terms.len());
        let mean = without.iter().fold(zero, |sum, x| sum + *x) / count;
        let mut covariance = DMatrix::zeros(terms.len(), terms.len());
        for x in without {
            let off = x - &mean;
            covariance.ger((count - 1.0) / count, &off, &off, 1.0);
        }
        let known = terms.known_before(&total);
        let known = known.ok_or_else(|| field.prepared.nothing_determined())?;
        covariance += known * rows_per_independent;
        Ok(Estimates {
            values,
            covariance,
            information: field.summed.declared.information(&total) / rows_per_independent,
            places,
        })
    }
}

/// Terms of declared unknowns and effects, each with the slopes by its shape, and where these stand.
fn with_shapes(field: &Field, effects: &[Chosen]) -> (Terms, Vec<TermPlaces>) {
    let mut terms = field.summed.declared.clone();
    let mut places = Vec::new();
    for c in effects {
        let candidate = &field.candidates[c.candidate];
        let first = terms.len();
        terms.list.extend_from_slice(field.terms_of(c.candidate));
        let mut shapes = Vec::new();
        for ((k, _), term) in candidate
            .slopes
            .iter()
            .zip(&field.summed.layout.slopes[c.candidate])
        {
            if !candidate.effect.held[*k] {
                shapes.push((*k, terms.len()));
                terms.list.push(term.clone());
            }
        }
        places.push(TermPlaces { first, shapes });
    }
    (terms, places)
}

/// The declared model with effects of given amplitudes, its unknowns those of the fit beside them.
pub fn model(field: &Field, effects: &[(&Chosen, Vec<f64>)]) -> AugmentedModel {
    let chosen: Vec<Chosen> = effects.iter().map(|(c, _)| (*c).clone()).collect();
    let held = places(field, &chosen).into_iter().flatten();
    let amplitudes = effects.iter().flat_map(|(_, a)| a.iter().copied());
    let held: Vec<(usize, f64)> = held.zip(amplitudes).collect();
    let values = field.terms(&chosen).fit(&field.total(), &held).values;
    let mut model = moved(&field.summed.about, &field.prepared.unknowns, &values);
    let added = effects.iter().map(|(c, linear)| effect(field, c, linear));
    model.effects.extend(added);
    model
}

/// An effect with its amplitudes.
pub fn effect(field: &Field, chosen: &Chosen, linear: &[f64]) -> Added {
    Added {
        linear: linear.to_vec(),
        ..field.effect(chosen).clone()
    }
}
