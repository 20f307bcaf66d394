//! From what was chosen to two tables: estimates, and a model that predicts.

use nalgebra::{DMatrix, DVector};

use super::problem::unknowns::{Unknowns, step};
use super::search::{Chosen, Field, own_joint};
use crate::effect::{Added, AugmentedModel};
use crate::judge::{Agreement, BlockSums, Blocks, BlocksLeftOut, ErrorGain, Terms, agreement};

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
    /// By the block jackknife, and of what is known beforehand: of the declared unknowns, then of each effect's
    /// coefficients and shape.
    pub covariance: DMatrix<f64>,
    /// What the fitted rows and what is known beforehand say of the declared unknowns beside fixed effects, counted
    /// in independent rows.
    pub information: DMatrix<f64>,
    /// Where the coefficients of each effect begin in it, and where its shapes stand.
    pub places: Vec<TermPlaces>,
}

/// Places of the coefficients of each effect behind `declared` unknowns.
fn places(field: &Field, declared: usize, effects: &[Chosen]) -> Vec<Vec<usize>> {
    let mut next = declared;
    let place = |c: &Chosen| {
        let first = next;
        next += field.terms[c.candidate].len();
        (first..next).collect()
    };
    effects.iter().map(place).collect()
}

/// Asks the parts of the data for every effect that was chosen; one that gains nothing beside all the others is not
/// confirmed. What sums with `noisier` positions change in an amplitude, the positions' own noise has done too.
pub fn verified(
    field: &Field,
    declared: &Terms,
    chosen: &[Chosen],
    blocks: &Blocks,
    noisier: Option<&BlockSums>,
) -> Vec<Verified> {
    let terms = declared.with(&field.terms_of(chosen));
    let values = terms.fit(&field.total(), &[]).values;
    let fitted = 0..field.sums.blocks.len() - field.judging;
    let noisier = noisier.map(|sums| sums.over(fitted));
    let places = places(field, declared.len(), chosen);
    let of = |(at, own): (usize, Vec<usize>)| {
        let mut agreement = agreement(field.sums, blocks, &terms, (&own, &values), field.numbers);
        if let Some(sums) = &noisier {
            let part = by_noise(&terms, sums, (declared.len(), &own, &values), &agreement);
            let effect = &field.candidates[chosen[at].candidate].effect;
            let measured = effect.law.entry.measurable;
            agreement.doubt(if measured { part } else { part.max(0.0) }, field.numbers);
        }
        if !is_needed(field, declared, chosen, at) {
            agreement.s = 0.0;
        }
        Verified {
            agreement,
            amplitude: own.iter().map(|i| values[*i]).collect(),
            chosen: chosen[at].clone(),
        }
    };
    places.into_iter().enumerate().map(of).collect()
}

/// The part of an effect's amplitude that noise of the positions adds, or takes off, beside all the others as they are.
/// An effect must not be made by noise; a number that can be measured must not be hidden by it either.
fn by_noise(
    terms: &Terms,
    noisier: &[DMatrix<f64>],
    (declared, own, values): (usize, &[usize], &DVector<f64>),
    agreement: &Agreement,
) -> f64 {
    let others = (declared..terms.len()).filter(|i| !own.contains(i));
    let held: Vec<(usize, f64)> = others.map(|i| (i, values[i])).collect();
    let change = terms.fit(noisier, &held).values - values;
    let own = own.iter().map(|i| change[*i]);
    agreement.part(&DVector::from_vec(own.collect()))
}

/// Whether an effect passes the screen beside all the others, those that came after it too.
fn is_needed(field: &Field, declared: &Terms, chosen: &[Chosen], at: usize) -> bool {
    let place = field.candidates[chosen[at].candidate].effect.place;
    beside_the_others(field, declared, chosen, at)
        .is_some_and(|(gain, _)| gain.is_beyond(field.numbers.screen, own_joint(place)))
}

/// Gain of an effect beside all the others, and the squared error without it; none where these data determine nothing.
pub fn beside_the_others(
    field: &Field,
    declared: &Terms,
    chosen: &[Chosen],
    at: usize,
) -> Option<(ErrorGain, f64)> {
    let mut others = chosen.to_vec();
    let own = others.remove(at).candidate;
    let terms = declared.with(&field.terms_of(&others));
    let left_out = BlocksLeftOut::new(field.sums, field.judging, &terms)?;
    Some((left_out.gain(&field.terms[own]), left_out.error()))
}

impl Estimates {
    /// The joint fit with some effects; none where these data determine nothing.
    pub fn of(
        field: &Field,
        declared: &Terms,
        effects: &[Chosen],
        rows_per_independent: f64,
    ) -> Option<Self> {
        let terms = declared.with(&field.terms_of(effects));
        let total = field.total();
        let values = terms.fit(&total, &[]).values;
        let (terms, places) = with_shapes(field, declared, effects);
        let left_out = BlocksLeftOut::new(field.sums, field.judging, &terms)?;
        let without: Vec<&DVector<f64>> = left_out.values().collect();
        let count = without.len() as f64;
        let zero = DVector::zeros(terms.len());
        let mean = without.iter().fold(zero, |sum, x| sum + *x) / count;
        let mut covariance = DMatrix::zeros(terms.len(), terms.len());
        for x in without {
            let off = x - &mean;
            covariance.ger((count - 1.0) / count, &off, &off, 1.0);
        }
        covariance += terms.known_before(&total)? * rows_per_independent;
        Some(Estimates {
            values,
            covariance,
            information: declared.information(&total) / rows_per_independent,
            places,
        })
    }
}

/// Terms of declared unknowns and effects, each with the slopes by its shape, and where these stand.
fn with_shapes(field: &Field, declared: &Terms, effects: &[Chosen]) -> (Terms, Vec<TermPlaces>) {
    let mut terms = declared.clone();
    let mut places = Vec::new();
    for c in effects {
        let candidate = &field.candidates[c.candidate];
        let first = terms.len();
        terms.list.extend_from_slice(&field.terms[c.candidate]);
        let mut shapes = Vec::new();
        for ((k, _), term) in candidate.slopes.iter().zip(&field.slopes[c.candidate]) {
            if !candidate.effect.held[*k] {
                shapes.push((*k, terms.len()));
                terms.list.push(term.clone());
            }
        }
        places.push(TermPlaces { first, shapes });
    }
    (terms, places)
}

/// Values of the declared unknowns beside effects of given amplitudes.
pub fn beside(field: &Field, declared: &Terms, effects: &[(&Chosen, Vec<f64>)]) -> Vec<f64> {
    let chosen: Vec<Chosen> = effects.iter().map(|(c, _)| (*c).clone()).collect();
    let terms = declared.with(&field.terms_of(&chosen));
    let places = places(field, declared.len(), &chosen);
    let held = places.into_iter().flatten();
    let amplitudes = effects.iter().flat_map(|(_, a)| a.iter().copied());
    let held: Vec<(usize, f64)> = held.zip(amplitudes).collect();
    let values = terms.fit(&field.total(), &held).values;
    values.iter().take(declared.len()).copied().collect()
}

/// A model with effects of given amplitudes, its declared unknowns moved.
pub fn model(
    field: &Field,
    (fitted, unknowns): (&AugmentedModel, &Unknowns),
    values: &[f64],
    effects: &[(&Chosen, Vec<f64>)],
) -> AugmentedModel {
    let mut model = fitted.clone();
    step(&mut model, unknowns, values);
    let added = effects.iter().map(|(c, linear)| effect(field, c, linear));
    model.effects.extend(added);
    model
}

/// An effect with its amplitudes.
pub fn effect(field: &Field, chosen: &Chosen, linear: &[f64]) -> Added {
    let shape = &field.candidates[chosen.candidate].effect;
    Added {
        linear: linear.to_vec(),
        ..shape.clone()
    }
}
