//! The formula of what is left of a joint: few terms of a library, found on blocks left out, judged as every effect is.
//!
//! ```text
//! what is left of a joint beside the effects that are confirmed (or beside none of its own)
//!      -> library: functions of signals, and products of two, whose units one constant makes right
//!      -> select: the greatest gain on blocks left out, exchanged, pruned
//!      -> chance: the same search where whole parts of the residual have another sign
//!      -> judged: its shapes refined, its amplitude, held-out data, no joint worse
//! ```
//!
//! Regression with few terms on a library (Brunton, Proctor and Kutz 2016), and not by evolution of trees: a library's
//! columns stand beside the declared ones in the same sums of products, so that every block can be left out and every
//! null can be drawn without a look at a row. What there is in Rust evolves trees on the squared error of all rows
//! (`symbolic_regression` 0.12, after SymbolicRegression.jl, is the best kept): no declared parameter is refitted beside a tree, no
//! block is left out, and a null of 99 searches would take hours. `exmex` evaluates what is found, as it does a user's
//! formulas.

mod columns;
mod judged;
mod library;
mod picture;
mod select;
mod symmetry;
mod term;
#[cfg(test)]
mod tests;

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use self::columns::RowsOfJoint;
use self::judged::SearchedFormulas;
use self::library::{FormulaContext, library};
use self::select::{SelectedTerms, TermProducts, gram};
use self::term::{FormulaTerm, TermNames};
use super::error::DiagnoseError;
use super::outcome::Diagnosis;
use super::outcome::JudgedEffects;
use super::prepared::PreparedCase;
use super::problem::pass::EffectCandidate;
use super::search::ChosenCandidate;
use super::searched::SearchedCase;
use super::watch::DiagnosisWatch;
use crate::effect::{AugmentedModel, EffectPlace};
use crate::judge::compare;

/// A formula of a joint before the judge.
pub struct Proposed {
    pub joint: usize,
    pub terms: Vec<FormulaTerm>,
    pub selected: SelectedTerms,
    /// Chance of a gain as large where whole parts of the residual have another sign.
    pub p_value: f64,
    /// Effects of the catalogue that stay beside it.
    pub beside: Vec<ChosenCandidate>,
}

impl PreparedCase<'_> {
    /// Formulas of joints whose residual is above its noise.
    pub(super) fn formulas(
        &self,
        (searched, judged): (&SearchedCase, &JudgedEffects),
        found: &Diagnosis,
        watch: DiagnosisWatch,
    ) -> Result<SearchedFormulas, DiagnoseError> {
        let joints: Vec<usize> = match self.blocks.list.len() >= self.case.numbers.least_blocks {
            true => found.structured_joints().collect(),
            false => Vec::new(),
        };
        let confirmed = searched.chosen.iter().zip(&judged.steps);
        let confirmed = confirmed.filter(|(_, step)| step.written.is_some());
        let confirmed: Vec<ChosenCandidate> = confirmed.map(|(c, _)| c.clone()).collect();
        let part = watch.part("formulas", joints.len());
        let mut proposed = Vec::new();
        for j in joints {
            watch.unless_stopped()?;
            proposed.extend(self.proposed(searched, &confirmed, j)?);
            part.step();
        }
        drop(part);
        self.judged_formulas(searched, &confirmed, proposed)
    }

    /// The formula of a joint beside what the catalogue found there, or in its place where it explains as much by itself.
    fn proposed(
        &self,
        searched: &SearchedCase,
        confirmed: &[ChosenCandidate],
        j: usize,
    ) -> Result<Option<Proposed>, DiagnoseError> {
        let of_joint = OfJoint::of(self, searched, confirmed, j);
        let terms = library(&self.around(&self.names(j)));
        let about = &searched.summed.about;
        let rows = self.joint_rows(about, &of_joint.candidates, &terms, j)?;
        let gram = gram(&rows.more);
        let search = |with_own: bool| -> Result<Option<Proposed>, DiagnoseError> {
            let kept = of_joint.kept(with_own);
            let Some(products) = self.products(&terms, (&rows, &gram, &kept), j) else {
                return Ok(None);
            };
            let Some(selected) = self.selected(&products, None) else {
                return Ok(None);
            };
            let p_value = self.chance(&products, &selected);
            let terms = selected.terms.iter().map(|t| terms[*t].clone()).collect();
            let (terms, selected) = self.reshaped(about, (&of_joint, &kept), (terms, selected))?;
            let stays = |c: &&ChosenCandidate| with_own || !of_joint.is_own(searched, c);
            Ok(Some(Proposed {
                joint: j,
                terms,
                selected,
                p_value,
                beside: confirmed.iter().filter(stays).cloned().collect(),
            }))
        };
        let beside = search(true)?;
        let alone = match of_joint.own.contains(&true) {
            true => search(false)?,
            false => None,
        };
        Ok(match (beside, alone) {
            (Some(beside), Some(alone)) => {
                let gain = compare(&alone.selected.left, &beside.selected.left, &[1.0]);
                let more = gain.is_beyond(self.case.numbers.screen, None);
                Some(if more { beside } else { alone })
            }
            (beside, alone) => alone.or(beside),
        })
    }

    fn selected(&self, products: &TermProducts, signs: Option<&[f64]>) -> Option<SelectedTerms> {
        let plain = vec![1.0; self.blocks.list.len()];
        let numbers = (&self.case.formula, &self.case.numbers);
        products.select(signs.unwrap_or(&plain), numbers)
    }

    fn products<'t>(
        &self,
        terms: &'t [FormulaTerm],
        rows: (&'t RowsOfJoint, &DMatrix<f64>, &[usize]),
        j: usize,
    ) -> Option<TermProducts<'t>> {
        let ridge = self.case.numbers.ridge;
        TermProducts::of(terms, rows, &self.names(j), ridge)
    }

    /// Terms chosen anew of these and of others with shapes near theirs, twice: what made good for a wrong shape falls out.
    fn reshaped(
        &self,
        about: &AugmentedModel,
        (of_joint, kept): (&OfJoint, &[usize]),
        (mut terms, mut selected): (Vec<FormulaTerm>, SelectedTerms),
    ) -> Result<(Vec<FormulaTerm>, SelectedTerms), DiagnoseError> {
        let j = of_joint.joint;
        for by in CLOSER {
            let mut near = terms.clone();
            near.extend(terms.iter().flat_map(|t| t.reshaped(&by)));
            if near.len() == terms.len() {
                break;
            }
            let rows = self.joint_rows(about, &of_joint.candidates, &near, j)?;
            let products = self.products(&near, (&rows, &gram(&rows.more), kept), j);
            let Some(found) = products.and_then(|p| self.selected(&p, None)) else {
                break;
            };
            terms = found.terms.iter().map(|t| near[*t].clone()).collect();
            selected = found;
        }
        Ok((terms, selected))
    }

    fn around<'b>(&'b self, names: &'b TermNames<'b>) -> FormulaContext<'b> {
        let stretches = &self.case.stretches;
        let joints = 0..self.cover.joints.len();
        let spread = |k: usize| {
            let all = stretches.iter().flat_map(|s| s.temperature[k].iter());
            let low = all.clone().fold(f64::INFINITY, |a, x| a.min(*x));
            all.fold(f64::NEG_INFINITY, |b, x| b.max(*x)) - low
        };
        let known = joints.clone();
        let known = known.filter(|k| stretches.iter().all(|s| s.has_temperature(*k)));
        let warm = known.map(|k| (k, spread(k)));
        let moves = |k: &usize| !self.cover.joints[*k].stationary;
        FormulaContext {
            cover: &self.cover,
            names,
            moving: joints.filter(moves).collect(),
            warm: warm.filter(|(_, s)| *s > 0.0).collect(),
        }
    }

    /// Chance of a gain as large where whole parts of the residual have another sign, until it is too large to be reported.
    fn chance(&self, products: &TermProducts, selected: &SelectedTerms) -> f64 {
        let numbers = &self.case.formula;
        let mut chance = ChaCha8Rng::seed_from_u64(numbers.seed);
        let mut signs = |_| {
            let sign = |_| if chance.random::<bool>() { 1.0 } else { -1.0 };
            let of_parts: Vec<f64> = (0..self.blocks.parts).map(sign).collect();
            let blocks = self.blocks.list.iter();
            blocks.map(|b| of_parts[b.part]).collect()
        };
        let draws: Vec<Vec<f64>> = (0..numbers.draws).map(&mut signs).collect();
        let (mut drawn, mut as_good) = (0, 0);
        for some in draws.chunks(TOGETHER) {
            let found = some.par_iter();
            let found = found.filter_map(|signs| self.selected(products, Some(signs)));
            let gains = found.filter(|s| s.even >= selected.even);
            (drawn, as_good) = (drawn + some.len(), as_good + gains.count());
            if (1 + as_good) as f64 > numbers.chance * (1 + numbers.draws) as f64 {
                break;
            }
        }
        (1 + as_good) as f64 / (1 + drawn) as f64
    }
}

/// What the model has at a joint beside a formula.
struct OfJoint {
    joint: usize,
    candidates: Vec<EffectCandidate>,
    /// Of each declared column: whether it is of an effect of the joint itself.
    own: Vec<bool>,
}

impl OfJoint {
    fn of(
        prepared: &PreparedCase,
        searched: &SearchedCase,
        confirmed: &[ChosenCandidate],
        joint: usize,
    ) -> Self {
        let candidate = |c: &ChosenCandidate| searched.candidates[c.candidate].clone();
        let candidates: Vec<EffectCandidate> = confirmed.iter().map(candidate).collect();
        let mut own = vec![false; prepared.unknowns.without_held().columns[joint].len()];
        for candidate in candidates.iter().filter(|c| c.effect.place.touches(joint)) {
            let is_own = candidate.effect.place == EffectPlace::Joint(joint);
            let count = candidate.bounds.len() + candidate.slopes.len();
            own.extend(std::iter::repeat_n(is_own, count));
        }
        OfJoint {
            joint,
            candidates,
            own,
        }
    }

    fn is_own(&self, searched: &SearchedCase, chosen: &ChosenCandidate) -> bool {
        searched.candidates[chosen.candidate].effect.place == EffectPlace::Joint(self.joint)
    }

    /// Declared columns, with those of the joint's own effects or without.
    fn kept(&self, with_own: bool) -> Vec<usize> {
        let all = 0..self.own.len();
        all.filter(|i| with_own || !self.own[*i]).collect()
    }
}

/// Numbers by which shapes are multiplied to be tried between those of the library, the second time closer.
const CLOSER: [[f64; 4]; 2] = [[0.6, 0.78, 1.28, 1.65], [0.88, 0.94, 1.06, 1.13]];

/// Draws that are searched side by side.
const TOGETHER: usize = 11;
