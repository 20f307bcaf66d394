//! Chosen effects in their best shape: Gauss-Newton over shapes, amplitudes and the declared unknowns together, a small
//! pass over the rows for each step.

use nalgebra::DVector;

use super::candidates::{EffectCandidate, refined_shapes};
use super::prepared::{PreparedCase, SummedProducts, moved};
use super::search::ChosenCandidate;
use crate::effect::{AugmentedModel, ModelEffect};
use crate::judge::Term;
use crate::motion::MotionError;

const STEPS: usize = 6;
/// A step that takes less than this part off the squares is the last.
const SETTLED: f64 = 1e-5;
/// Times that a step is halved where it makes the fit worse.
const HALVED: usize = 4;

/// A fit of chosen effects in some shape.
struct Point {
    summed: SummedProducts,
    candidates: Vec<EffectCandidate>,
    /// Of the declared unknowns, then of every coefficient.
    values: DVector<f64>,
    squares: f64,
    /// Of every shape that is refined: where to go from here.
    step: Vec<f64>,
}

impl PreparedCase<'_> {
    /// Moves the shapes of chosen candidates to where all blocks want them: sums of these alone, about the model fitted with them.
    pub fn polished(
        &self,
        candidates: &mut [EffectCandidate],
        summed: &SummedProducts,
        chosen: &[ChosenCandidate],
        directions: &[ModelEffect],
    ) -> Result<SummedProducts, MotionError> {
        let field = self.field(candidates, summed);
        let values = field.terms(chosen).fit(&field.total(), &[]).values;
        let mut list = candidates.to_vec();
        for (i, candidate) in list.iter_mut().enumerate() {
            if !chosen.iter().any(|c| c.candidate == i) {
                candidate.clear_columns();
            }
        }
        let start = self.there(&list, chosen, &values, &[]);
        let mut best = self.point(summed.about.clone(), start, (chosen, directions))?;
        for _ in 0..STEPS {
            let Some(next) = self.better(&best, chosen, directions)? else {
                break;
            };
            let settled = best.squares - next.squares <= SETTLED * best.squares;
            best = next;
            if settled {
                break;
            }
        }
        for c in chosen {
            let found = &best.candidates[c.candidate];
            let own = &mut candidates[c.candidate];
            own.effect.shape.clone_from(&found.effect.shape);
            own.slopes.clone_from(&found.slopes);
            for (k, room) in &found.slopes {
                own.effect.held[*k] = room.least == 0.0 || room.most == 0.0;
            }
        }
        Ok(best.summed)
    }

    /// A step on; none where no part of it makes the fit better.
    fn better(
        &self,
        from: &Point,
        chosen: &[ChosenCandidate],
        directions: &[ModelEffect],
    ) -> Result<Option<Point>, MotionError> {
        let about = moved(&from.summed.about, &self.unknowns, &from.values);
        let mut part = 1.0;
        for _ in 0..HALVED {
            let step: Vec<f64> = from.step.iter().map(|x| part * x).collect();
            let list = self.there(&from.candidates, chosen, &from.values, &step);
            let next = self.point(about.clone(), list, (chosen, directions))?;
            if next.squares < from.squares {
                return Ok(Some(next));
            }
            part *= 0.5;
        }
        Ok(None)
    }

    /// Candidates with the amplitudes of a fit, a step on.
    fn there(
        &self,
        list: &[EffectCandidate],
        chosen: &[ChosenCandidate],
        values: &DVector<f64>,
        step: &[f64],
    ) -> Vec<EffectCandidate> {
        let mut list = list.to_vec();
        let (mut at, mut steps) = (self.unknowns.len(), step.iter());
        for c in chosen {
            let own = &mut list[c.candidate];
            for x in &mut own.effect.linear {
                *x = values[at];
                at += 1;
            }
            for ((k, _), by) in own.slopes.iter().zip(&mut steps) {
                own.effect.shape[*k] += by;
            }
            own.slopes = refined_shapes(&self.fitted.model, self.case, &self.cover, &own.effect);
        }
        list
    }

    fn point(
        &self,
        about: AugmentedModel,
        candidates: Vec<EffectCandidate>,
        (chosen, directions): (&[ChosenCandidate], &[ModelEffect]),
    ) -> Result<Point, MotionError> {
        // a law that is chosen gives the direction in its present shape
        let present = |d: &ModelEffect| {
            let mut own = chosen.iter().map(|c| &candidates[c.candidate].effect);
            let own = own.find(|e| e.name() == d.name() && e.place == d.place);
            let mut direction = own.unwrap_or(d).clone();
            direction.linear.fill(0.0);
            direction
        };
        let directions: Vec<ModelEffect> = directions.iter().map(present).collect();
        let summed = self.summed(about, &candidates, &directions)?;
        let field = self.field(&candidates, &summed);
        let (total, terms) = (field.total(), field.terms(chosen));
        let fit = terms.fit(&total, &[]);
        let slopes = |c: &ChosenCandidate| summed.layout.slopes[c.candidate].clone();
        let slopes: Vec<Term> = chosen.iter().flat_map(slopes).collect();
        let all = terms.with(&slopes).fit(&total, &[]).values;
        Ok(Point {
            squares: terms.weigh(&fit.squares),
            step: all.iter().skip(terms.len()).copied().collect(),
            values: fit.values,
            summed,
            candidates,
        })
    }
}
