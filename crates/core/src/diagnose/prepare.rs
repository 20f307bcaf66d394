//! Which rows of the logs do what, whether they can be fitted at all, and what a model leaves in them.

use super::error::DiagnoseError;
use super::faults::channels::suspicion;
use super::problem::case::Case;
use super::problem::data_split::{DataSplit, LogRole};
use crate::effect::{AugmentedModel, Torques, stationary_joints};
use crate::motion::Stretch;

/// Which rows do what. Of a log that is fitted or may veto those of stationary joints count for nothing; along the
/// others nothing counts.
pub(super) fn data_split(case: &Case, fitted: &[Stretch]) -> DataSplit {
    let robot = &case.given.model.robot;
    let mut of_fitted = stationary_joints(robot, fitted).into_iter();
    let vetoing = case.stretches_of(LogRole::Veto);
    let mut of_vetoing = stationary_joints(robot, &vetoing).into_iter();
    let of = |s: &Stretch| match case.roles[s.log] {
        LogRole::Train => of_fitted.next(),
        LogRole::Veto => of_vetoing.next(),
        LogRole::Holdout => None,
    };
    let all = vec![true; robot.joints()];
    let ignored = case.stretches.iter().map(of);
    DataSplit {
        ignored: ignored.map(|i| i.unwrap_or_else(|| all.clone())).collect(),
        stationary: stationary_joints(robot, &case.stretches),
        ..DataSplit::of(&case.stretches, &case.roles, &case.filters, case.cutoff_hz)
    }
}

/// Refuses what cannot be fitted. Faults of the data come before any physics.
pub(super) fn check(case: &Case, split: &DataSplit, unknowns: usize) -> Result<(), DiagnoseError> {
    let rows = split.fitted_rows();
    if rows < 10 * unknowns || split.folds < 3 {
        return Err(DiagnoseError::TooFewRows { rows, unknowns });
    }
    for (j, joint) in case.given.model.robot.joint_names().iter().enumerate() {
        let silent = |s: &Stretch| s.tau[j].iter().all(|x| *x == 0.0);
        if case.stretches.iter().all(silent) {
            return Err(DiagnoseError::NoTorque {
                joint: joint.clone(),
            });
        }
    }
    match suspicion(&case.given, &case.stretches, &case.filters, split)? {
        Some(found) => Err(DiagnoseError::Channels(found)),
        None => Ok(()),
    }
}

/// Raw residuals along stretches, `[stretch][joint][sample]`.
pub(super) fn residuals<'a>(
    model: &AugmentedModel,
    stretches: &[Stretch],
    torques: impl Iterator<Item = &'a Torques>,
) -> Vec<Vec<Vec<f64>>> {
    let of = |(stretch, torques): (&Stretch, &Torques)| match torques.hat.is_empty() {
        // along a log in which nothing moves
        true => model.residual(stretch, &model.torques(stretch)),
        false => model.residual(stretch, torques),
    };
    stretches.iter().zip(torques).map(of).collect()
}
