//! The errors that a model leaves of reduced logs, by their sums.

use super::dataset::Dataset;
use super::reduced::error::ReducedError;
use super::reduced::reduced_log::ReducedLog;
use super::robot_setup::RobotSetup;
use super::unknowns::columns;
use cft_ident_core::effect::AugmentedModel;
use cft_ident_core::inertia::columns::{JointTerm, RegressorColumns};
use cft_ident_core::number;
use cft_ident_core::robot::model::{JointFriction, Model};
use cft_ident_core::validate::{SummedRows, TorqueReconstruction};

/// Refuses reduced logs that were smoothed otherwise than validation smooths logs: by one cut-off of each joint for all.
pub(crate) fn check_smoothed_alike(data: &Dataset) -> Result<(), ReducedError> {
    let (setup, parts) = (&data.setup, &data.reduced);
    let Some(first) = parts.first().filter(|_| setup.finds_cutoffs()) else {
        return Ok(());
    };
    let together = match data.logs.is_empty() {
        true => &first.smoothing.cutoffs_hz,
        false => &*setup.position_cutoffs_hz,
    };
    for part in parts {
        let own = &part.smoothing.cutoffs_hz;
        let differs = |(_, (a, b)): &(usize, (&f64, &f64))| a != b;
        let joint = own.iter().zip(together).enumerate().find(differs);
        if let Some((j, (own, other))) = joint {
            let what = format!(
                "{} as smoothed as the other logs (by {} Hz, and they by {} Hz): its own rows chose it",
                setup.robot.joint_names()[j],
                number::significant(*own, 3),
                number::significant(*other, 3),
            );
            let remedy = "declare `position_cutoff_hz` in [filter] and reduce again, validate them one by one, or give the logs themselves";
            return Err(part.needs_log(&what, remedy));
        }
    }
    Ok(())
}

impl ReducedLog {
    /// Adds the errors of a model that is linear in its columns.
    ///
    /// # Errors
    /// A model with effects or with other friction, and one of another robot.
    pub(crate) fn add_errors(
        &self,
        all: &mut TorqueReconstruction,
        setup: &RobotSetup,
        refined: &AugmentedModel,
    ) -> Result<(), ReducedError> {
        if !refined.effects.is_empty() {
            let what = "the rows that effects are computed along";
            let remedy = "give the log itself, or a model without effects";
            return Err(self.needs_log(what, remedy));
        }
        self.belongs_to_robot(&setup.file)?;
        let known = self.known_friction();
        let columns = columns(setup, known.as_deref());
        let Some(theta) = unknowns_of(&refined.model, &columns) else {
            let what = "the friction of this model: its columns were made with another";
            let remedy = "reduce the log again with `-m` and this model, or give the log itself";
            return Err(self.needs_log(what, remedy));
        };
        let rows = self.rows(columns)?;
        for (j, error) in rows.squares(&theta.into()).into_iter().enumerate() {
            let [moving, resting] = [rows.moving[j], rows.resting[j]];
            let summed = SummedRows {
                error,
                torque: [moving.torque_square, resting.torque_square],
                rows: [moving.count, resting.count],
            };
            all.add_sums(j, &summed);
        }
        Ok(())
    }
}

/// The numbers of a model in the order of these columns; none where its friction is not theirs.
fn unknowns_of(model: &Model, columns: &RegressorColumns) -> Option<Vec<f64>> {
    let mut theta = model.theta.clone();
    for (j, own) in columns.own.iter().enumerate() {
        let viscous_coulomb = match (&model.friction[j], columns.known[j].as_ref()) {
            (JointFriction::DoubleTanh(law), Some(known)) => {
                let same = law.parameters() == known.law.parameters();
                same.then_some([0.0, 0.0])?
            }
            (JointFriction::ViscousCoulomb(law), None) => [law.viscous, law.coulomb],
            (JointFriction::None, None) => [0.0, 0.0],
            _ => return None,
        };
        theta.extend(own.iter().map(|own| match own {
            JointTerm::Viscous => viscous_coulomb[0],
            JointTerm::Coulomb => viscous_coulomb[1],
            JointTerm::Offset => model.offset[j],
            JointTerm::Saturating(_)
            | JointTerm::Law(_)
            | JointTerm::TorqueRate
            | JointTerm::TorqueBend => 0.0,
        }));
    }
    Some(theta)
}
