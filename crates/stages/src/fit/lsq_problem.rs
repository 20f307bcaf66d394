//! What a fit of the inertial parameters is asked for: its unknowns, and the friction that is known before it.

use super::estimate::{InertialEstimate, estimate};
use super::gains::CurrentGains;
use super::known_friction::FrictionBefore;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::gain_error::GainError;
use crate::input::lsq_rows::LsqRows;
use crate::input::reduced::reduced_log::MadeWith;
use crate::input::repeated::{each_row_once, fitted_identities};
use crate::input::unknowns::columns;
use crate::note::FitNote;
use cft_ident_core::inertia::columns::RegressorColumns;
use cft_ident_core::inertia::gains::by_gains;
use cft_ident_core::inertia::solution::FitError;
use cft_ident_core::inertia::solve::{residual_of, weights_of};
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::robot_file::FrictionLawKind;

/// How the inertial parameters are fitted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LsqSettings<'a> {
    /// How parameters are estimated from the rows.
    pub estimator: EstimatorKind,
    /// Physically consistent parameters beside those of the plain fit.
    pub consistent: bool,
    /// They are in use whatever the plain fit gains on blocks left out, for the fit is made again as a model was made.
    pub consistent_whatever: bool,
    /// The model that holds the friction of every joint; without one, friction is fitted together with the inertias.
    pub friction: Option<&'a GivenModel>,
    /// The friction of `friction` stays as it is; otherwise it is refined with the inertias, but for `ols`.
    pub hold_friction: bool,
    /// Then fit a single axis to the motion that its torques make, in windows of so many seconds that begin at measured
    /// states; without a length, blocks that are set aside choose it.
    pub open_loop: Option<Option<f64>>,
    /// Gains that were fitted before, whose uncertainty the parameters share.
    pub gains: Option<&'a CurrentGains>,
}

/// A fit that can be made of its data.
pub(crate) struct LsqProblem<'a> {
    pub data: &'a Dataset,
    pub settings: &'a LsqSettings<'a>,
    /// Law (18) is fitted with the inertias.
    pub law: bool,
    /// The friction that is known beforehand, where a model holds it.
    pub before: Option<FrictionBefore>,
    /// Columns of the rows of every log.
    pub columns: RegressorColumns,
}

impl<'a> LsqProblem<'a> {
    /// Which unknowns the fit has.
    ///
    /// # Errors
    /// Settings that contradict the robot file or the logs, and rows that are given twice.
    pub fn new(data: &'a Dataset, settings: &'a LsqSettings<'a>) -> Result<Self, IdentifyError> {
        let (setup, estimator) = (&data.setup, settings.estimator);
        setup.check_gains()?;
        each_row_once(&[("fit", fitted_identities(data))])?;
        if settings.gains.is_some() && settings.friction.is_some() {
            return Err(GainError::FrictionGiven.into());
        }
        let given = settings.friction.is_some();
        let law = !given && setup.file.friction_law() == FrictionLawKind::DoubleTanh;
        if law && !matches!(estimator, EstimatorKind::Wls | EstimatorKind::Oe) {
            let estimator = estimator.name();
            return Err(IdentifyError::LawIsNotLinear { estimator });
        }
        if estimator != EstimatorKind::Wls {
            data.needs_rows(
                &format!("what the estimator {} reads", estimator.name()),
                "a reduced log holds rows as `--estimator wls` weighs them: take that, or give the log itself",
            )?;
        }
        let hold =
            settings.hold_friction || estimator == EstimatorKind::Ols || !data.reduced.is_empty();
        let before = settings.friction.map(|given| {
            let given = (given.name.as_str(), &given.file);
            FrictionBefore::of(data, given, (estimator, hold))
        });
        let before = before.transpose()?;
        let known = before.as_ref().map(|before| before.known.as_slice());
        let problem = LsqProblem {
            columns: columns(setup, known),
            law,
            before,
            data,
            settings,
        };
        problem.check_reduced()?;
        Ok(problem)
    }

    /// Refuses reduced logs of other columns.
    fn check_reduced(&self) -> Result<(), IdentifyError> {
        let given = self.settings.friction.zip(self.before.as_ref());
        let friction = given.map(|(given, before)| (given.name.as_str(), before.known.as_slice()));
        let wanted = MadeWith::of(&self.data.setup.file, friction);
        for part in &self.data.reduced {
            part.belongs_to(&wanted)?;
        }
        Ok(())
    }

    /// The model file that holds the friction.
    pub fn friction_file(&self) -> Option<&'a ModelFile> {
        self.settings.friction.map(|given| &given.file)
    }

    /// Whether the parameters are a linear function of the rows of logs, friction among the unknowns.
    pub fn is_linear(&self) -> bool {
        let least_squares = matches!(
            self.settings.estimator,
            EstimatorKind::Ols | EstimatorKind::Wls
        );
        least_squares && !self.law && self.before.is_none() && self.data.reduced.is_empty()
    }

    /// Fits the unknowns; their covariance has the part of the gains by which torques were made.
    ///
    /// # Errors
    /// Logs that cannot be used, and rows that determine nothing.
    pub fn estimate(&self, rows: &mut LsqRows) -> Result<InertialEstimate, IdentifyError> {
        let estimator = self.settings.estimator;
        rows.weighs_rests = estimator != EstimatorKind::Ols;
        let mut estimated = estimate(rows, self.columns.clone(), estimator, self.law)?;
        if let Some(gains) = self.settings.gains {
            share_uncertainty(&mut estimated, gains)?;
        }
        Ok(estimated)
    }

    /// Says that friction which could move with the rows of logs stays where reduced ones have it.
    pub fn friction_of_reduced(&self) -> Option<FitNote> {
        let part = self.data.reduced.first()?;
        let settings = self.settings;
        let moved = settings.friction.is_some() && !settings.hold_friction;
        let log = part.name().to_owned();
        moved.then_some(FitNote::FrictionOfReduced { log })
    }
}

/// Adds to the covariance of a fit that of the gains by which its torques were made.
fn share_uncertainty(
    estimated: &mut InertialEstimate,
    gains: &CurrentGains,
) -> Result<(), FitError> {
    let (fit, basis) = (&mut estimated.fit, &estimated.basis);
    let std = residual_of(&basis.sums, &(&fit.theta - &basis.shift))?;
    let weights = weights_of(&basis.sums, &std);
    let slopes = by_gains(&basis.sums, &weights, &basis.shift)?;
    fit.covariance += &slopes * &gains.covariance * slopes.transpose();
    Ok(())
}
