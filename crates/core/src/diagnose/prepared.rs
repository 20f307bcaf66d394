//! The declared model fitted, one pass over the rows with every candidate, and what the search chose.

use nalgebra::DVector;
use rayon::prelude::*;

use super::candidates::candidates;
use super::error::DiagnoseError;
use super::held_out::{HeldOutRows, split_errors};
use super::memory::memory_s;
use super::orders;
use super::outcome::SplitErrors;
use super::problem::case::DiagnosisCase;
use super::problem::constant_columns::ConstantColumns;
use super::problem::data_split::{DataSplit, LogRole, Piece};
use super::problem::fit::{WeightedModel, fit};
use super::problem::pass::{ColumnLayout, WeightedRows};
use super::problem::unknowns::{DiagnosisUnknowns, step};
use super::refit::ModelRefit;
use super::unexplained::errors::UseErrors;
use crate::effect::{AugmentedModel, LogCoverage, ModelEffect};
use crate::judge::{BlockSums, Blocks, BlocksLeftOut, LogRows, Term, Terms, compare, divide};
use crate::motion::{MotionError, Stretch};
use crate::robot::model::JointFriction;

/// The declared model fitted, and the data divided.
pub struct PreparedCase<'a> {
    pub case: &'a DiagnosisCase,
    pub refit: &'a ModelRefit<'a>,
    pub data: WeightedRows<'a>,
    pub unknowns: DiagnosisUnknowns,
    pub fitted: WeightedModel,
    pub cover: LogCoverage,
    /// Blocks that are fitted.
    pub blocks: Blocks,
    /// Neighbouring pieces of the split that a bootstrap draws together.
    pub together: usize,
}

/// Sums of products about a model.
#[derive(Clone)]
pub struct SummedProducts {
    /// The declared model that they are about.
    pub about: AugmentedModel,
    /// Friction laws by whose direction friction goes.
    pub directions: Vec<ModelEffect>,
    pub layout: ColumnLayout,
    pub sums: BlockSums,
    pub declared: Terms,
}

impl<'a> PreparedCase<'a> {
    pub fn of(
        case: &'a DiagnosisCase,
        (split, constant): (&'a DataSplit, &'a ConstantColumns),
        refit: &'a ModelRefit<'a>,
    ) -> Result<Self, DiagnoseError> {
        let numbers = &case.numbers;
        let data = WeightedRows {
            stretches: &case.stretches,
            filters: &case.filters,
            split,
            rest_speed: &case.rest_speed,
            constant: Some(constant),
        };
        let logs = split.logs(case.rows(), LogRole::Train);
        let whole = divide(&logs, f64::INFINITY, (1, 1)).list;
        let fitted = fit(case, &case.given, (&data, &whole), None)?;
        let train = case.stretches_of(LogRole::Train);
        let mut cover = LogCoverage::of(&case.given.model.robot, &train, case.cutoff_hz);
        let raw = residuals(&fitted.model, &train);
        orders::find(&mut cover, &raw, &train, &case.filters)?;
        drop(raw);
        let residual = filtered(&fitted.model, &data)?;
        let memory = memory_s(&residual, &logs, split);
        let prepared = PreparedCase {
            together: 1,
            case,
            refit,
            data,
            unknowns: case.unknowns(),
            fitted,
            cover,
            blocks: Blocks::default(),
        };
        let prepared = prepared.divided(&logs, memory);
        if prepared.blocks.list.len() >= numbers.blocks {
            return Ok(prepared);
        }
        let rest = prepared.memory_of_rest(&logs)?;
        let finer = prepared.divided(&logs, rest.min(memory));
        Ok(match finer.blocks.list.len() < numbers.blocks {
            true => finer.divided(&logs, memory),
            false => finer,
        })
    }

    /// Divided into blocks beside which a residual's memory \[s\] is short.
    fn divided(mut self, logs: &[LogRows], memory: f64) -> Self {
        let (case, split) = (self.case, self.data.split);
        let numbers = &case.numbers;
        let reach = |s: &Stretch| case.filters.of(s).trim as f64 * s.dt;
        let reach = case.stretches.iter().map(reach).fold(0.0, f64::max);
        let least = (numbers.memory_times * memory).max(reach);
        let count = (numbers.blocks, 1);
        self.blocks = divide(logs, least, count);
        let rows = |p: &Piece| p.rows.len() as f64 * split.step_s[p.stretch];
        let lengths: Vec<f64> = split.pieces.iter().map(rows).collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
        self.together = (least / mean).ceil().max(1.0) as usize;
        self
    }

    /// Memory \[s\] of the residual beside the one effect that explains most: too few numbers to whiten noise.
    fn memory_of_rest(&self, logs: &[LogRows]) -> Result<f64, DiagnoseError> {
        let model = &self.fitted.model;
        let (candidates, _) = candidates(model, self.case, &self.cover);
        let summed = self.summed(model.clone(), &candidates, &[])?;
        let total = self.field(&candidates, &summed).total();
        let beside = |own: &Vec<Term>| {
            let fit = summed.declared.with(own).fit(&total, &[]);
            (summed.declared.weigh(&fit.squares), fit.values)
        };
        let terms = summed.layout.candidates.par_iter();
        let fits: Vec<_> = terms.map(beside).collect();
        let fits = candidates.iter().zip(fits);
        let Some((candidate, (_, values))) = fits.min_by(|a, b| a.1.0.total_cmp(&b.1.0)) else {
            return Ok(f64::INFINITY);
        };
        let mut with = moved(model, &self.unknowns, &values);
        with.effects.push(ModelEffect {
            linear: values.as_slice()[self.unknowns.len()..].to_vec(),
            ..candidate.effect.clone()
        });
        Ok(memory_s(
            &filtered(&with, &self.data)?,
            logs,
            self.data.split,
        ))
    }

    pub fn nothing_determined(&self) -> DiagnoseError {
        DiagnoseError::NothingDetermined {
            unknowns: self.unknowns.len(),
        }
    }

    /// The declared model fitted anew beside effects that are held.
    pub fn refitted(&self, start: &AugmentedModel) -> Result<AugmentedModel, MotionError> {
        let data = (&self.data, self.blocks.list.as_slice());
        Ok(fit(self.case, start, data, Some(&self.fitted.weights))?.model)
    }

    /// Whether the declared numbers of a fitted model gain on blocks left out over those of another.
    pub fn is_better(
        &self,
        fitted: &AugmentedModel,
        other: &AugmentedModel,
    ) -> Result<bool, MotionError> {
        let given = self.summed(other.clone(), &[], &[])?;
        let fitted = self.summed(fitted.clone(), &[], &[])?;
        let weights = &fitted.declared.weights;
        let nothing = DVector::zeros(self.unknowns.len());
        let squares = |block: &Vec<_>| given.declared.squares(block, &nothing);
        let as_given: Vec<_> = given.sums.blocks.iter().map(squares).collect();
        let left_out = BlocksLeftOut::new(&fitted.sums, 0, &fitted.declared);
        Ok(left_out.is_some_and(|left_out| {
            let gain = compare(&as_given, &left_out.errors(), weights);
            gain.is_beyond(self.case.numbers.screen, None)
        }))
    }

    pub fn held_out(&self, role: LogRole) -> HeldOutRows<'_> {
        HeldOutRows::of((self.case, self.data.split, self.together), role)
    }

    pub fn split_errors(&self, model: &AugmentedModel) -> Result<SplitErrors, DiagnoseError> {
        split_errors((self.case, self.data.split, self.together), model)
    }

    /// Errors without the rows in which friction at rest takes whatever the torque is.
    pub fn moving(
        &self,
        model: &AugmentedModel,
        role: LogRole,
    ) -> Result<Option<UseErrors>, MotionError> {
        let friction = &self.case.given.model.friction;
        let rows = HeldOutRows {
            moving: friction.iter().any(JointFriction::jumps),
            ..self.held_out(role)
        };
        rows.errors(model)
    }
}

/// Raw residuals along stretches, `[stretch][joint][sample]`.
pub fn residuals(model: &AugmentedModel, stretches: &[Stretch]) -> Vec<Vec<Vec<f64>>> {
    let of = |s: &Stretch| model.residual(s, &model.torques(s));
    stretches.par_iter().map(of).collect()
}

/// Filtered residuals along all stretches, `[stretch][joint][row]`.
pub fn filtered(
    model: &AugmentedModel,
    data: &WeightedRows,
) -> Result<Vec<Vec<Vec<f64>>>, MotionError> {
    let of = |stretch: &Stretch| {
        let raw = model.residual(stretch, &model.torques(stretch));
        let channels: Vec<&[f64]> = raw.iter().map(Vec::as_slice).collect();
        data.filters.of(stretch).run(&channels)
    };
    data.stretches.par_iter().map(of).collect()
}

/// A model about the fitted one, its unknowns moved.
pub fn moved(
    fitted: &AugmentedModel,
    unknowns: &DiagnosisUnknowns,
    values: &DVector<f64>,
) -> AugmentedModel {
    let mut model = fitted.clone();
    step(&mut model, unknowns, &values.as_slice()[..unknowns.len()]);
    model
}
