//! The fit of the declared model, its effects held: a few linear steps, each from one pass over the rows.

use nalgebra::DVector;

use super::case::DiagnosisCase;
use super::pass::{ColumnLayout, WeightedRows, pass};
use super::unknowns::{DiagnosisUnknowns, Unknown, step, value_of};
use crate::effect::AugmentedModel;
use crate::judge::{BlockSums, Terms, TimeBlock};
use crate::motion::MotionError;
use crate::robot::model::JointFriction;

/// A fitted model with the weights of its joints.
#[derive(Debug, Clone)]
pub struct WeightedModel {
    pub model: AugmentedModel,
    /// 1 / variance of each joint's residual.
    pub weights: Vec<f64>,
}

/// Most passes: a law that bends takes some.
const PASSES: usize = 4;
/// A step that promises less than this part of the squares is not worth another pass.
const SETTLED: f64 = 1e-6;
/// Times that the weights follow the residual.
const REWEIGHTED: usize = 3;

/// Fits the declared model to blocks, in weights where they are given. What the data do not determine stays.
pub fn fit(
    case: &DiagnosisCase,
    start: &AugmentedModel,
    (data, blocks): (&WeightedRows, &[TimeBlock]),
    weights: Option<&[f64]>,
) -> Result<WeightedModel, MotionError> {
    // nothing is fitted to the columns of what is held
    let unknowns = case.unknowns().without_held();
    let layout = ColumnLayout::of(&unknowns, &[]);
    let mut model = start.clone();
    let mut passes = 0;
    loop {
        passes += 1;
        let sums = pass(&model, (&unknowns, &[]), &layout, data, blocks)?;
        let total = sums.over(0..blocks.len());
        let rows: Vec<f64> = (0..total.len()).map(|j| sums.rows_of(j)).collect();
        let weights_at =
            |squares: &[f64]| weights.map_or_else(|| weights_of(squares, &rows), <[f64]>::to_vec);
        let mut terms = declared_terms(case, &unknowns, &layout, &model);
        let here = terms.squares(&total, &DVector::zeros(unknowns.len()));
        let mut next = here.clone();
        let mut delta = DVector::zeros(unknowns.len());
        for _ in 0..REWEIGHTED {
            terms.weights = weights_at(&next);
            let fit = terms.fit(&total, &[]);
            (next, delta) = (fit.squares, fit.values);
        }
        let promised = terms.weigh(&here) - terms.weigh(&next);
        let settled = passes > 1 && promised <= SETTLED * terms.weigh(&here);
        if settled || passes == PASSES {
            let weights = weights_at(&here);
            return Ok(WeightedModel { model, weights });
        }
        step(&mut model, &unknowns, delta.as_slice());
    }
}

/// 1 / variance of each joint's residual; nothing of a joint without rows.
fn weights_of(squares: &[f64], rows: &[f64]) -> Vec<f64> {
    let of = |(square, rows): (&f64, &f64)| match *square > 0.0 {
        true => rows / square,
        false => 0.0,
    };
    squares.iter().zip(rows).map(of).collect()
}

/// The terms of the declared unknowns about a model, with no weights yet. Friction that did not push does not come to push.
pub fn declared_terms(
    case: &DiagnosisCase,
    unknowns: &DiagnosisUnknowns,
    layout: &ColumnLayout,
    model: &AugmentedModel,
) -> Terms {
    let mut list = layout.declared.clone();
    for (term, unknown) in list.iter_mut().zip(&unknowns.list) {
        if let Unknown::Friction { joint, .. } = unknown
            && matches!(
                model.model.friction[*joint],
                JointFriction::ViscousCoulomb(_)
            )
            && value_of(&case.given, *unknown) >= 0.0
        {
            term.bound.least = -value_of(model, *unknown).max(0.0);
        }
    }
    Terms {
        list,
        weights: vec![0.0; layout.torques.len()],
        prior: case.prior.over(unknowns, model),
        ridge: case.numbers.ridge,
    }
}

/// Whether blocks determine any unknown: its column is not the same nothing everywhere.
pub fn determines_some(sums: &BlockSums, terms: &Terms) -> bool {
    let total = sums.over(0..sums.blocks.len());
    let some = |(j, column): &(usize, usize)| total[*j][(*column, *column)] > 0.0;
    terms.list.iter().any(|t| t.columns.iter().any(some))
}
