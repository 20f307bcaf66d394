//! The fit of the declared model, its effects held: a few linear steps, each from one pass over the rows.

use nalgebra::{DMatrix, DVector};

use super::pass::{ColumnLayout, Data, pass};
use super::prior::ParameterPrior;
use super::unknowns::{FreeParameters, Unknowns, step};
use crate::effect::AugmentedModel;
use crate::judge::{BlockSums, Terms, TimeBlock};
use crate::motion::MotionError;

/// What is open and known of a declared model.
#[derive(Clone, Copy)]
pub struct Declared<'a> {
    pub open: &'a FreeParameters,
    pub prior: &'a ParameterPrior,
    /// The inertial parameters are kept.
    pub keep: bool,
    /// Part of the diagonal that holds what the data do not determine.
    pub ridge: f64,
}

/// A fitted model with the weights of its joints.
#[derive(Debug, Clone)]
pub struct Fitted {
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
///
/// # Errors
/// [`MotionError`] of the filter.
pub fn fit(
    start: &AugmentedModel,
    declared: Declared,
    (data, blocks): (&Data, &[TimeBlock]),
    weights: Option<&[f64]>,
) -> Result<Fitted, MotionError> {
    let unknowns = Unknowns::of(start, declared.open, declared.keep);
    let layout = ColumnLayout::of(&unknowns, &[]);
    let mut model = start.clone();
    let mut found: Option<Fitted> = None;
    for _ in 0..PASSES {
        let sums = pass(&model, (&unknowns, &[]), &layout, data, blocks)?;
        let total = sums.over(0..blocks.len());
        let rows: Vec<f64> = (0..total.len()).map(|j| sums.rows_of(j)).collect();
        let mut terms = declared.terms(&unknowns, &layout, &model);
        let here = terms.squares(&total, &DVector::zeros(unknowns.len()));
        let mut next = here.clone();
        let mut delta = DVector::zeros(unknowns.len());
        for _ in 0..REWEIGHTED {
            terms.weights = weights.map_or_else(|| weights_of(&next, &rows), <[f64]>::to_vec);
            let fit = terms.fit(&total, &[]);
            (next, delta) = (fit.squares, fit.values);
        }
        let weighted = |squares: &[f64]| -> f64 {
            let known = squares.iter().zip(&terms.weights);
            known.map(|(s, w)| s * w).sum()
        };
        let promised = weighted(&here) - weighted(&next);
        let settled = found.is_some() && promised <= SETTLED * weighted(&here);
        found = Some(Fitted {
            model: model.clone(),
            weights: weights.map_or_else(|| weights_of(&here, &rows), <[f64]>::to_vec),
        });
        if settled {
            break;
        }
        step(&mut model, &unknowns, delta.as_slice());
    }
    found.ok_or(MotionError::TooFewSamples { samples: 0 })
}

/// 1 / variance of each joint's residual; nothing of a joint without rows.
fn weights_of(squares: &[f64], rows: &[f64]) -> Vec<f64> {
    let of = |(square, rows): (&f64, &f64)| match *square > 0.0 {
        true => rows / square,
        false => 0.0,
    };
    squares.iter().zip(rows).map(of).collect()
}

impl Declared<'_> {
    /// The terms of the declared unknowns about a model, with no weights yet.
    pub fn terms(
        &self,
        unknowns: &Unknowns,
        layout: &ColumnLayout,
        model: &AugmentedModel,
    ) -> Terms {
        Terms {
            list: layout.declared.clone(),
            weights: vec![0.0; layout.columns.len()],
            prior: self.prior.over(unknowns, model),
            ridge: self.ridge,
        }
    }
}

/// Whether blocks determine any unknown: its column is not the same nothing everywhere.
pub fn determines_some(sums: &BlockSums, terms: &Terms) -> bool {
    let total: Vec<DMatrix<f64>> = sums.over(0..sums.blocks.len());
    let some = |(j, column): &(usize, usize)| total[*j][(*column, *column)] > 0.0;
    terms.list.iter().any(|t| t.columns.iter().any(some))
}
