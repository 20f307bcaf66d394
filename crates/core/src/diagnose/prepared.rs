//! The declared model fitted, one pass over the rows with every candidate, and what the search chose.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::candidates::{Candidate, NotTried, candidates, is_friction_law};
use super::error::DiagnoseError;
use super::held_out::HeldOutRows;
use super::memory::memory_s;
use super::orders;
use super::outcome::SplitErrors;
use super::problem::case::Case;
use super::problem::data_split::{DataSplit, LogRole, Piece};
use super::problem::fit::{Declared, Fitted, determines_some, fit};
use super::problem::pass::{ColumnLayout, Data, pass};
use super::problem::unknowns::{Unknowns, step};
use super::search::{Chosen, Field, Looked};
use super::unexplained::errors::{self, Counted, Errors};
use super::watch::Watch;
use crate::effect::{AugmentedModel, Cover};
use crate::judge::{BlockSums, Blocks, BlocksLeftOut, Terms, TimeBlock, compare, divide};
use crate::motion::{MotionError, Stretch};
use crate::robot::model::JointFriction;

/// The declared model fitted, and the data divided.
pub struct PreparedCase<'a> {
    pub case: &'a Case,
    pub split: &'a DataSplit,
    pub data: Data<'a>,
    pub declared: Declared<'a>,
    pub unknowns: Unknowns,
    pub fitted: Fitted,
    pub cover: Cover,
    /// Blocks that are fitted.
    pub blocks: Blocks,
    /// These, then those that only judge.
    pub all_blocks: Vec<TimeBlock>,
    /// Neighbouring pieces of the split that a bootstrap draws together.
    pub together: usize,
}

/// What the search came to.
pub struct SearchedCase {
    pub candidates: Vec<Candidate>,
    pub not_tried: Vec<NotTried>,
    pub layout: ColumnLayout,
    pub sums: BlockSums,
    pub chosen: Vec<Chosen>,
    pub looked: Vec<Looked>,
    /// Squared error of blocks left out by all that was chosen, in the weights of the joints.
    pub error: f64,
    /// Whether the declared model explains more of blocks left out than no torque does.
    pub determined: bool,
}

impl<'a> PreparedCase<'a> {
    pub fn of(case: &'a Case, split: &'a DataSplit) -> Result<Self, DiagnoseError> {
        let numbers = &case.numbers;
        let declared = Declared {
            open: &case.open,
            prior: &case.prior,
            keep: case.keep,
            ridge: numbers.ridge,
        };
        let data = Data {
            stretches: &case.stretches,
            filters: &case.filters,
            split,
            rest_speed: &case.rest_speed,
        };
        let logs = split.logs(&case.stretches, LogRole::Train);
        let whole = divide(&logs, f64::INFINITY, numbers).list;
        let fitted = fit(&case.given, declared, (&data, &whole), None)?;
        let train = case.stretches_of(LogRole::Train);
        let unknowns = Unknowns::of(&case.given, &case.open, case.keep);
        let mut cover = Cover::of(&case.given.model.robot, &train, case.cutoff_hz);
        let raw = residuals(&fitted.model, &train);
        orders::find(&mut cover, &raw, &train, &case.filters)?;
        drop(raw);
        let residual = filtered(&fitted.model, &data)?;
        let memory = memory_s(&residual, &logs, split);
        let reach = |s: &Stretch| case.filters.of(s).trim as f64 * s.dt;
        let reach = case.stretches.iter().map(reach).fold(0.0, f64::max);
        let least = (numbers.memory_times * memory).max(reach);
        let blocks = divide(&logs, least, numbers);
        let judging = divide(&split.logs(&case.stretches, LogRole::Veto), least, numbers);
        let all_blocks = [blocks.list.as_slice(), &judging.list].concat();
        let rows = |p: &Piece| p.rows.len() as f64 * split.step_s[p.stretch];
        let lengths: Vec<f64> = split.pieces.iter().map(rows).collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
        Ok(PreparedCase {
            together: (least / mean).ceil().max(1.0) as usize,
            case,
            split,
            data,
            declared,
            unknowns,
            fitted,
            cover,
            blocks,
            all_blocks,
        })
    }

    /// Blocks that only judge.
    pub fn judging(&self) -> usize {
        self.all_blocks.len() - self.blocks.list.len()
    }

    fn sums(
        &self,
        candidates: &[Candidate],
        layout: &ColumnLayout,
        model: &AugmentedModel,
    ) -> Result<BlockSums, MotionError> {
        let columns = (&self.unknowns, candidates);
        pass(model, columns, layout, &self.data, &self.all_blocks)
    }

    /// What is searched, by sums of products.
    pub fn field<'b>(
        &'b self,
        (candidates, layout): (&'b [Candidate], &'b ColumnLayout),
        sums: &'b BlockSums,
        watch: Watch<'b>,
    ) -> Field<'b> {
        Field {
            candidates,
            terms: &layout.candidates,
            sums,
            judging: self.judging(),
            numbers: &self.case.numbers,
            watch,
        }
    }

    /// The declared terms about the fitted model.
    pub fn terms(&self, layout: &ColumnLayout) -> Terms {
        let mut terms = (self.declared).terms(&self.unknowns, layout, &self.fitted.model);
        terms.weights.clone_from(&self.fitted.weights);
        terms
    }

    /// Chooses what gains; once more about the friction laws that it chose, where they change what a direction is.
    pub fn search(&self, watch: Watch) -> Result<SearchedCase, DiagnoseError> {
        let (candidates, not_tried) = candidates(&self.fitted.model, self.case, &self.cover);
        let layout = ColumnLayout::of(&self.unknowns, &candidates);
        let mut model = self.fitted.model.clone();
        let mut sums = self.sums(&candidates, &layout, &model)?;
        let declared = self.terms(&layout);
        let nothing = DiagnoseError::NothingDetermined {
            unknowns: self.unknowns.len(),
        };
        if !determines_some(&sums, &declared) && !self.case.keep {
            return Err(nothing);
        }
        let numbers = &self.case.numbers;
        let parts = (&candidates[..], &layout);
        let Some(alone) = BlocksLeftOut::new(&sums, self.judging(), &declared) else {
            return Err(nothing);
        };
        let errors = alone.errors();
        let determined = compare(&torque_squares(&sums, &layout), &errors, &declared.weights)
            .is_beyond(numbers.screen, None);
        let search = |sums: &BlockSums| match self.blocks.parts >= numbers.parts {
            false => Some((Vec::new(), Vec::new())),
            true => self.field(parts, sums, watch).search(&declared),
        };
        let Some((mut chosen, mut looked)) = search(&sums) else {
            return Err(nothing);
        };
        // what goes by a joint's direction goes by its friction law
        let smooth = chosen.iter().map(|c| &candidates[c.candidate].0);
        let smooth: Vec<_> = smooth
            .filter(|e| is_friction_law(e) && e.law.direction.is_some())
            .cloned()
            .collect();
        if !smooth.is_empty() {
            model.effects.extend(smooth);
            sums = self.sums(&candidates, &layout, &model)?;
            (chosen, looked) = search(&sums).ok_or(nothing)?;
        }
        let error = errors.iter().flat_map(|e| e.iter().zip(&declared.weights));
        Ok(SearchedCase {
            error: error.map(|(e, w)| e * w).sum(),
            determined,
            candidates,
            not_tried,
            layout,
            sums,
            chosen,
            looked,
        })
    }

    /// The declared model fitted anew beside effects that are held.
    pub fn refit(&self, start: &AugmentedModel) -> Result<AugmentedModel, MotionError> {
        let data = (&self.data, self.blocks.list.as_slice());
        Ok(fit(start, self.declared, data, Some(&self.fitted.weights))?.model)
    }

    pub fn held_out(&self, role: LogRole) -> HeldOutRows<'_> {
        HeldOutRows {
            case: self.case,
            split: self.split,
            role,
            together: self.together,
        }
    }

    pub fn split_errors(&self, model: &AugmentedModel) -> Result<SplitErrors, DiagnoseError> {
        let train = self.held_out(LogRole::Train).errors(model)?;
        let holdout = self.held_out(LogRole::Holdout).errors(model)?;
        Ok(SplitErrors {
            train: train.ok_or(DiagnoseError::TooFewRows {
                rows: 0,
                unknowns: self.unknowns.len(),
            })?,
            holdout,
        })
    }

    pub fn moving(
        &self,
        model: &AugmentedModel,
        role: LogRole,
    ) -> Result<Option<Errors>, MotionError> {
        let case = self.case;
        let counted = match case.given.model.friction.iter().any(JointFriction::jumps) {
            true => Counted::Moving,
            false => Counted::All,
        };
        let pieces = errors::pieces(
            model,
            &case.stretches,
            (&case.filters, &case.rest_speed),
            self.split,
            (role, counted),
        )?;
        Ok(errors::summed(model, &case.units, (&pieces, self.together)))
    }
}

/// Squared torque of every block, `[block][joint]`.
fn torque_squares(sums: &BlockSums, layout: &ColumnLayout) -> Vec<Vec<f64>> {
    let of_block = |joints: &Vec<DMatrix<f64>>| {
        let each = joints.iter().enumerate();
        let square = |(j, s): (usize, &DMatrix<f64>)| s[(layout.torque(j), layout.torque(j))];
        each.map(square).collect()
    };
    sums.blocks.iter().map(of_block).collect()
}

/// Raw residuals along stretches, `[stretch][joint][sample]`.
pub fn residuals(model: &AugmentedModel, stretches: &[Stretch]) -> Vec<Vec<Vec<f64>>> {
    let of = |s: &Stretch| model.residual(s, &model.torques(s));
    stretches.par_iter().map(of).collect()
}

/// Filtered residuals along all stretches, `[stretch][joint][row]`.
pub fn filtered(model: &AugmentedModel, data: &Data) -> Result<Vec<Vec<Vec<f64>>>, MotionError> {
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
    unknowns: &Unknowns,
    values: &DVector<f64>,
) -> AugmentedModel {
    let mut model = fitted.clone();
    step(&mut model, unknowns, &values.as_slice()[..unknowns.len()]);
    model
}
