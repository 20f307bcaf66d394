//! Formulas before the judge of every other effect: each an effect of the user's own whose shapes are refined, asked of
//! blocks and of data set aside.

use super::Proposed;
use super::picture::OnHeldOut;
use super::term::{FormulaTerm, ShapeNumber, Source, TermNames, named};
use crate::diagnose::accepted::refuse_failed;
use crate::diagnose::candidates::refined_shapes;
use crate::diagnose::error::DiagnoseError;
use crate::diagnose::outcome::JudgedEffects;
use crate::diagnose::outcome::{
    FormulaEnd, FormulaSymmetry, FoundEffect, FoundFormula, StepStatus,
};
use crate::diagnose::polish::with_columns_of;
use crate::diagnose::prepared::PreparedCase;
use crate::diagnose::problem::case::formula_name;
use crate::diagnose::problem::pass::EffectCandidate;
use crate::diagnose::search::ChosenCandidate;
use crate::diagnose::searched::SearchedCase;
use crate::diagnose::steps::judge;
use crate::diagnose::tables::beside_the_others;
use crate::effect::formula::{FormulaDefinition, FormulaShape};
use crate::effect::{EffectPlace, ModelEffect, own};
use crate::judge::Bound;
use crate::robot::FormulaSignal;

/// A shape is refined from half to twice its value on the grid; a wave within so much of it.
const AROUND: [f64; 2] = [0.5, 2.0];
const WAVE: [f64; 2] = [0.95, 1.05];

/// What was made of a search: formulas, and the outcome with those that the user accepts.
pub struct SearchedFormulas {
    pub formulas: Vec<FoundFormula>,
    pub accepted: Option<(SearchedCase, JudgedEffects)>,
}

impl PreparedCase<'_> {
    /// Judges what is proposed beside the effects that are confirmed.
    pub fn judged_formulas(
        &self,
        searched: &SearchedCase,
        confirmed: &[ChosenCandidate],
        proposed: Vec<Proposed>,
    ) -> Result<SearchedFormulas, DiagnoseError> {
        let all: Vec<&Proposed> = proposed.iter().collect();
        let mut formulas = Vec::new();
        if !all.is_empty() {
            let (_, judged) = self.with_formulas(searched, confirmed, &all)?;
            let first = judged.steps.len() - all.len();
            for (p, step) in all.iter().zip(&judged.steps[first..]) {
                let mut found = self.found(searched, confirmed, p, step.clone());
                if let Some(place) = step.written {
                    let held = OnHeldOut::of(self, (&judged.proposed, place), p.joint)?;
                    found.picture = held.picture(&found.signals);
                    found.at_reversals = held.at_reversals();
                }
                formulas.push(found);
            }
        }
        let wishes = &self.case.wishes;
        let names = self.case.given.model.robot.joint_names();
        let joint = |p: &Proposed| names[p.joint].as_str();
        let mut accepted = all;
        accepted.retain(|p| wishes.wants_formula(joint(p)));
        let found = |of: Option<&str>| accepted.iter().any(|p| Some(joint(p)) == of);
        let mut asked = wishes.accepted.iter().filter(|w| wishes.is_formula(w));
        if let Some(wanted) = asked.find(|w| !found(w.joint.as_deref())) {
            return Err(DiagnoseError::Accept {
                name: wanted.to_string(),
                why: "no formula was found there: see `formulas` in the JSON document".into(),
            });
        }
        let some = !accepted.is_empty();
        let accepted = some.then(|| self.with_formulas(searched, confirmed, &accepted));
        let accepted = accepted.transpose()?;
        if let Some((_, judged)) = &accepted {
            refuse_failed(self, judged)?;
        }
        Ok(SearchedFormulas { formulas, accepted })
    }

    /// Some formulas beside the effects that stay, in their best shape, and what the judge makes of all of them.
    fn with_formulas(
        &self,
        searched: &SearchedCase,
        confirmed: &[ChosenCandidate],
        taken: &[&Proposed],
    ) -> Result<(SearchedCase, JudgedEffects), DiagnoseError> {
        let stays = |c: &&ChosenCandidate| {
            let same = |own: &ChosenCandidate| own.candidate == c.candidate;
            taken.iter().all(|p| p.beside.iter().any(same))
        };
        let mut chosen: Vec<ChosenCandidate> = confirmed.iter().filter(stays).cloned().collect();
        let mut candidates = with_columns_of(&searched.candidates, &chosen);
        for p in taken {
            chosen.push(ChosenCandidate {
                candidate: candidates.len(),
                gain: p.selected.gain.clone(),
                error: p.selected.error,
                alternatives: Vec::new(),
                accepted: true,
            });
            candidates.push(self.candidate(p)?);
        }
        let about = searched.summed.about.clone();
        let summed = self.summed(about, &candidates, &searched.directions)?;
        let summed = self.polished(&mut candidates, &summed, &chosen, &searched.directions)?;
        let first = chosen.len() - taken.len();
        let field = self.field(&candidates, &summed);
        for at in first..chosen.len() {
            let beside = beside_the_others(&field, &chosen, at)?;
            (chosen[at].gain, chosen[at].error) = (beside.gain, beside.error);
        }
        let case = SearchedCase {
            noisier: Some(self.noisier(&summed, &candidates)?),
            candidates,
            summed,
            chosen,
            not_tried: searched.not_tried.clone(),
            looked: searched.looked.clone(),
            directions: searched.directions.clone(),
            error: searched.error,
            determined: searched.determined,
        };
        let judged = judge(self, &case)?;
        Ok((case, judged))
    }

    fn candidate(&self, of: &Proposed) -> Result<EffectCandidate, DiagnoseError> {
        let law = own::law(&self.definition(of), &self.case.given.model.robot)?;
        let shapes = named(&of.terms, &self.names(of.joint));
        let shape = shapes.iter().map(|s| s.value).collect();
        let linear = vec![0.0; law.linear.len()];
        let effect = ModelEffect::new(law, EffectPlace::Joint(of.joint), shape, linear);
        Ok(EffectCandidate {
            bounds: vec![Bound::NONE; law.linear.len()],
            slopes: refined_shapes(&self.fitted.model, self.case, &self.cover, &effect),
            effect,
        })
    }

    pub(super) fn names(&self, joint: usize) -> TermNames<'_> {
        let robot = &self.case.given.model.robot;
        let units = (0..robot.joints()).map(|k| robot.joint_kind(k).position_unit());
        TermNames {
            joint,
            joints: robot.joint_names(),
            positions: units.collect(),
            torques: &self.case.units,
        }
    }

    /// A formula as an effect of the user's own: its name is that of its joint.
    fn definition(&self, of: &Proposed) -> FormulaDefinition {
        let names = &self.names(of.joint);
        let shapes = named(&of.terms, names);
        let mut coefficients: Vec<[String; 3]> = Vec::new();
        for term in &of.terms {
            let unit = term.unit(names).unwrap_or_default();
            for text in term.texts(names, &shapes) {
                let name = format!("c{}", coefficients.len() + 1);
                coefficients.push([name, unit.clone(), text]);
            }
        }
        let joint = &names.joints[of.joint];
        let mut sources = of.terms.iter().flat_map(FormulaTerm::sources);
        FormulaDefinition {
            name: self.free_name(&formula_name(joint)),
            joints: Some(vec![joint.clone()]),
            coefficients,
            shapes: shapes.iter().map(range).collect(),
            friction: self.symmetry(of).odd > 0.5,
            at_rest: sources.all(Source::is_position),
            meaning: "a formula of what was left, found by diagnose --search".to_owned(),
        }
    }

    /// A name, numbered where the given model has an effect that is called so.
    fn free_name(&self, name: &str) -> String {
        let known = |own: &String| self.case.given.effects.iter().any(|e| e.name() == own);
        let numbered = (2..).map(|k| format!("{name}-{k}"));
        let mut all = std::iter::once(name.to_owned()).chain(numbered);
        all.find(|own| !known(own)).unwrap_or_default()
    }

    fn symmetry(&self, of: &Proposed) -> FormulaSymmetry {
        FormulaSymmetry::of(&of.terms, &of.selected.squares, of.joint)
    }

    fn found(
        &self,
        searched: &SearchedCase,
        confirmed: &[ChosenCandidate],
        of: &Proposed,
        step: FoundEffect,
    ) -> FoundFormula {
        let stays =
            |c: &&ChosenCandidate| !of.beside.iter().any(|own| own.candidate == c.candidate);
        let replaced = confirmed.iter().filter(stays);
        let end = match &step {
            _ if of.p_value > self.case.formula.chance => FormulaEnd::Chance,
            step if step.status == StepStatus::Seen => FormulaEnd::Unsure,
            step if step.joints.iter().any(|j| j.worsened) => FormulaEnd::Worse,
            _ => FormulaEnd::Found,
        };
        FoundFormula {
            joint: of.joint,
            end,
            definition: self.definition(of),
            step,
            p_value: of.p_value,
            share: of.selected.gain.value / of.selected.error.max(f64::MIN_POSITIVE),
            symmetry: self.symmetry(of),
            signals: signals(&of.terms),
            picture: None,
            at_reversals: None,
            in_place_of: replaced
                .map(|c| searched.candidates[c.candidate].effect.clone())
                .collect(),
        }
    }
}

fn range(shape: &ShapeNumber) -> FormulaShape {
    let around = match shape.name.starts_with('n') {
        true => WAVE,
        false => AROUND,
    };
    FormulaShape {
        name: shape.name.clone(),
        unit: shape.unit.clone(),
        range: around.map(|times| times * shape.value),
    }
}

/// Signals that terms are functions of, each once, those of the first terms first.
fn signals(terms: &[FormulaTerm]) -> Vec<(FormulaSignal, usize)> {
    let mut all = Vec::new();
    let own = |source| match source {
        Source::Signal(of, j) | Source::State(of, j, _) => vec![(of, j)],
        Source::Sum(i, j) => [i, j].map(|j| (FormulaSignal::Position, j)).to_vec(),
    };
    let sources = terms.iter().flat_map(FormulaTerm::sources);
    for signal in sources.flat_map(own) {
        if !all.contains(&signal) {
            all.push(signal);
        }
    }
    all
}
