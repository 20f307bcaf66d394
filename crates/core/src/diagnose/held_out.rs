//! What data that nothing was fitted to say of every effect.

use super::error::DiagnoseError;
use super::outcome::SplitErrors;
use super::problem::case::DiagnosisCase;
use super::problem::data_split::{DataSplit, LogRole};
use super::unexplained::errors::{self, ErrorsByPiece, JointChange, UseErrors};
use crate::effect::AugmentedModel;
use crate::motion::MotionError;

/// Rows of one use on which models are compared.
#[derive(Clone, Copy)]
pub struct HeldOutRows<'a> {
    pub case: &'a DiagnosisCase,
    pub split: &'a DataSplit,
    pub role: LogRole,
    /// Without those in which friction at rest takes whatever the torque is.
    pub moving: bool,
    /// Neighbouring pieces that a bootstrap draws together.
    pub together: usize,
}

/// Errors of a model on fitted and held-out rows, neighbouring pieces drawn together so many at a time.
pub fn split_errors(
    (case, split, together): (&DiagnosisCase, &DataSplit, usize),
    model: &AugmentedModel,
) -> Result<SplitErrors, DiagnoseError> {
    let of = |role| HeldOutRows::of((case, split, together), role);
    let train = of(LogRole::Train).errors(model)?;
    Ok(SplitErrors {
        train: train.ok_or_else(|| DiagnoseError::TooFewRows {
            rows: 0,
            unknowns: case.unknowns().len(),
        })?,
        holdout: of(LogRole::Holdout).errors(model)?,
    })
}

/// What an effect does to data that it was not fitted to.
#[derive(Debug, Clone)]
pub struct EffectChange {
    /// Mean relative error without and with it.
    pub mean: [f64; 2],
    pub joints: Vec<JointChange>,
}

impl<'a> HeldOutRows<'a> {
    pub fn of(
        (case, split, together): (&'a DiagnosisCase, &'a DataSplit, usize),
        role: LogRole,
    ) -> Self {
        HeldOutRows {
            case,
            split,
            role,
            moving: false,
            together,
        }
    }

    fn pieces(&self, model: &AugmentedModel) -> Result<ErrorsByPiece, MotionError> {
        errors::pieces(model, self.case, self.split, (self.role, self.moving))
    }

    /// Errors of a model; none where there are no such rows.
    pub fn errors(&self, model: &AugmentedModel) -> Result<Option<UseErrors>, MotionError> {
        let pieces = self.pieces(model)?;
        Ok(errors::summed(self.case, (&pieces, self.together)))
    }

    /// What the second model changes; none where there are no such rows.
    pub fn change(
        &self,
        models: [&AugmentedModel; 2],
    ) -> Result<Option<EffectChange>, MotionError> {
        let [before, after] = [self.pieces(models[0])?, self.pieces(models[1])?];
        let means = [&before, &after].map(errors::mean_relative_error);
        let names = models[0].model.robot.joint_names();
        let [Some(without), Some(with)] = means else {
            return Ok(None);
        };
        Ok(Some(EffectChange {
            mean: [without, with],
            joints: errors::changes(names, (&before, &after), self.together),
        }))
    }
}
