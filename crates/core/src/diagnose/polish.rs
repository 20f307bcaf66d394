//! Chosen effects in their best shape: damped Gauss-Newton steps over shapes, amplitudes and the declared unknowns
//! together, a small pass over the rows for each. The unknowns in which the torque is linear are solved anew at every
//! point, so that the shapes and the slopes of friction laws alone are searched (variable projection: Golub and Pereyra
//! 1973). What a step minimises, squares and prior, is what it is accepted by.

use nalgebra::DVector;

use super::candidates::{EffectCandidate, refined_shapes, shape_by_physics};
use super::prepared::{PreparedCase, SummedProducts, moved};
use super::problem::unknowns::Unknown;
use super::search::ChosenCandidate;
use crate::effect::{AugmentedModel, ModelEffect};
use crate::judge::Term;
use crate::math::descent::{StepControl, Trial, descend};
use crate::motion::MotionError;
use crate::robot::model::JointFriction;

/// Most steps that are tried, each a pass over the rows: what has not ended by then hardly moves.
const MOST_STEPS: usize = 24;
/// A step that takes less than this part off the cost is the last.
const SETTLED: f64 = 1e-5;
/// Damping of the steps.
const DAMPING: StepControl = StepControl::damping(10.0, 10.0, [1e-9, 1e3]);

/// A fit of chosen effects in some shape.
struct Point {
    summed: SummedProducts,
    candidates: Vec<EffectCandidate>,
    /// Of the declared unknowns, then of every coefficient; slopes of friction laws stay.
    values: DVector<f64>,
    /// Weighted squares and what the prior takes.
    cost: f64,
    /// How every shape that is refined moves the torque.
    slopes: Vec<Term>,
}

/// The candidates, of which those that are chosen alone have columns.
pub fn with_columns_of(
    candidates: &[EffectCandidate],
    chosen: &[ChosenCandidate],
) -> Vec<EffectCandidate> {
    let mut list = candidates.to_vec();
    for (i, candidate) in list.iter_mut().enumerate() {
        if !chosen.iter().any(|c| c.candidate == i) {
            candidate.clear_columns();
        }
    }
    list
}

impl PreparedCase<'_> {
    /// Moves the shapes of chosen candidates to where all blocks want them: sums of these alone, about the model fitted with
    /// them. A shape that runs to an end of its range is held at the value that physics gives it, where there is one.
    pub fn polished(
        &self,
        candidates: &mut [EffectCandidate],
        summed: &SummedProducts,
        chosen: &[ChosenCandidate],
        directions: &[ModelEffect],
    ) -> Result<SummedProducts, MotionError> {
        let polished = self.moved_to_minimum(candidates, summed, (chosen, directions))?;
        let mut held = false;
        for c in chosen {
            let own = &mut candidates[c.candidate];
            let model = &self.fitted.model;
            let by_physics = shape_by_physics(model, self.case, &self.cover, &own.effect);
            if let Some((k, value)) = by_physics {
                (own.effect.shape[k], own.effect.held[k], held) = (value, true, true);
                own.slopes = refined_shapes(model, self.case, &self.cover, &own.effect);
            }
        }
        if !held {
            return Ok(polished);
        }
        let asked = with_columns_of(candidates, chosen);
        let again = self.summed(polished.about, &asked, directions)?;
        self.moved_to_minimum(candidates, &again, (chosen, directions))
    }

    fn moved_to_minimum(
        &self,
        candidates: &mut [EffectCandidate],
        summed: &SummedProducts,
        (chosen, directions): (&[ChosenCandidate], &[ModelEffect]),
    ) -> Result<SummedProducts, MotionError> {
        let field = self.field(candidates, summed);
        let values = field.terms(chosen).fit(&field.total(), &[]).values;
        let list = with_columns_of(candidates, chosen);
        let start = self.there(&list, chosen, &values, &[]);
        let begun = self.point(summed.about.clone(), start, (chosen, directions))?;
        let mut step = |from: &Point, damping: f64| {
            let values = self.step_from(from, chosen, damping);
            let about = moved(&from.summed.about, &self.unknowns, &values);
            let by: Vec<f64> = values.iter().skip(from.values.len()).copied().collect();
            let list = self.there(&from.candidates, chosen, &values, &by);
            let next = self.point(about, list, (chosen, directions))?;
            let gained = from.cost - next.cost;
            Ok::<_, MotionError>(match gained > 0.0 {
                true if gained <= SETTLED * from.cost => Trial::Last(next),
                true => Trial::Accepted(next),
                false if gained >= -SETTLED * from.cost => Trial::Settled,
                false => Trial::Rejected,
            })
        };
        let (best, _, _) = descend(begun, &DAMPING, MOST_STEPS, &mut step)?;
        for c in chosen {
            let found = &best.candidates[c.candidate];
            let own = &mut candidates[c.candidate];
            own.effect.shape.clone_from(&found.effect.shape);
            // by which the slopes of its torque go
            own.effect.linear.clone_from(&found.effect.linear);
            own.slopes.clone_from(&found.slopes);
            for (k, room) in &found.slopes {
                own.effect.held[*k] = room.least == 0.0 || room.most == 0.0;
            }
        }
        Ok(best.summed)
    }

    /// Unknowns in which the torque is not linear.
    fn bent(&self) -> Vec<usize> {
        let friction = &self.fitted.model.model.friction;
        let bends = |unknown: &Unknown| match unknown {
            Unknown::Friction { joint, k } => {
                matches!(friction[*joint], JointFriction::DoubleTanh(_)) && *k >= 3
            }
            _ => false,
        };
        let list = self.unknowns.list.iter().enumerate();
        list.filter(|(_, unknown)| bends(unknown))
            .map(|(i, _)| i)
            .collect()
    }

    /// The damped step of all unknowns: those of the model, the coefficients, the shapes.
    fn step_from(&self, from: &Point, chosen: &[ChosenCandidate], damping: f64) -> DVector<f64> {
        let field = self.field(&from.candidates, &from.summed);
        let all = field.terms(chosen).with(&from.slopes);
        let mut bent = self.bent();
        bent.extend(from.values.len()..all.len());
        all.damped_values(&field.total(), (&bent, damping))
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
        let terms = field.terms(chosen);
        let held: Vec<(usize, f64)> = self.bent().into_iter().map(|i| (i, 0.0)).collect();
        let fit = terms.fit(&field.total(), &held);
        let slopes = |c: &ChosenCandidate| summed.layout.slopes[c.candidate].clone();
        let known = self
            .case
            .prior
            .cost(&self.unknowns, (&summed.about, &fit.values));
        Ok(Point {
            cost: terms.weigh(&fit.squares) + known,
            slopes: chosen.iter().flat_map(slopes).collect(),
            values: fit.values,
            summed,
            candidates,
        })
    }
}
