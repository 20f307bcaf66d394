//! What the data say of an estimate: which unknowns they determine, and which bodies can have them.

use super::consistent::{ConsistentLinks, consistent};
use super::estimate::InertialEstimate;
use super::geometry::geometry;
use super::lsq_problem::LsqProblem;
use crate::held_out::open_loop::is_in_si;
use crate::input::error::IdentifyError;
use crate::input::log_smoothing::CutoffCosts;
use crate::input::lsq_rows::LsqRows;
use crate::input::position_cutoff::PositionCutoff;
use crate::input::unknowns::{FittedUnknown, unknowns};
use crate::note::StageNote;
use crate::setup::Finding;
use cft_ident_core::inertia::accumulate::RelativeResidual;
use cft_ident_core::inertia::encoder::correct;
use cft_ident_core::inertia::essential::{EssentialParameters, essential};
use cft_ident_core::inertia::solve::{factor, residual_of, weights_of};
use cft_ident_core::verdict::Verdict;

/// Share that a fit leaves of every joint where noise is as large as the torque: noise leaves 0.7 of their sum.
const NOISE_ONLY_SHARE: f64 = 0.7;

/// An estimate, and what the data say of it.
pub(crate) struct JudgedEstimate {
    /// Without the bias of noisy positions.
    pub estimate: InertialEstimate,
    /// How many unknowns the data are really about, and the relative residual of each joint with those alone.
    pub essential: (usize, Vec<f64>),
    /// Physically consistent parameters, where they were asked for and were found.
    pub consistent: Option<ConsistentLinks>,
    /// They were asked for, and the plain fit stands alone.
    pub not_consistent: bool,
    pub unknowns: Vec<FittedUnknown>,
    pub position_cutoffs: Vec<PositionCutoff>,
    /// What is wrong with declared ones.
    pub wrong_cutoffs: Vec<StageNote>,
    /// Numbers of the geometry that make a parameter which the rows do not show.
    pub geometry: Vec<Finding>,
}

impl JudgedEstimate {
    /// # Errors
    /// Data that determine none of the parameters, or hold nothing but noise.
    pub fn new(
        problem: &LsqProblem,
        rows: &LsqRows,
        mut estimate: InertialEstimate,
    ) -> Result<Self, IdentifyError> {
        let setup = &problem.data.setup;
        let (essential, errors) = essentials(&estimate)?;
        // in amperes nothing says what a body can be
        let asked = problem.settings.consistent && is_in_si(setup);
        let consistent = match asked {
            true => consistent(
                setup,
                &estimate,
                &problem.data.top_speeds()?,
                problem.settings.consistent_whatever,
            ),
            false => None,
        };
        estimate.take_bias_off(consistent.as_ref());
        let unknowns = unknowns(setup, &estimate.columns, &estimate.fit, &essential);
        let costs = rows.cutoff_costs();
        let (position_cutoffs, wrong_cutoffs) =
            CutoffCosts::described(&costs, setup, &estimate.columns, &estimate.fit);
        let condition = estimate.fit.condition.normalised;
        let judged = JudgedEstimate {
            essential: (essential.essential.iter().filter(|e| **e).count(), errors),
            not_consistent: asked && consistent.is_none(),
            consistent,
            position_cutoffs,
            wrong_cutoffs,
            geometry: geometry(setup, condition, &unknowns),
            unknowns,
            estimate,
        };
        judged.check_determined()?;
        Ok(judged)
    }

    /// Refuses a fit that says nothing.
    fn check_determined(&self) -> Result<(), IdentifyError> {
        let open = |u: &FittedUnknown| u.verdict == Verdict::NotIdentifiable;
        if self.unknowns.iter().all(open) {
            return Err(IdentifyError::NothingDetermined);
        }
        let known = |u: &FittedUnknown| u.verdict == Verdict::Identified && !u.negligible;
        let left = self
            .plain_errors()
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        match !self.unknowns.iter().any(known) && left > NOISE_ONLY_SHARE {
            true => Err(IdentifyError::OnlyNoise { left }),
            false => Ok(()),
        }
    }

    /// What the plain fit leaves of the torque of each joint, in the rows in which it moves: fractions.
    pub fn plain_errors(&self) -> Vec<f64> {
        let moving = |e: &RelativeResidual| e.moving.unwrap_or(e.all);
        self.estimate
            .fit
            .relative_error
            .iter()
            .map(moving)
            .collect()
    }
}

impl InertialEstimate {
    /// Takes off the bias of noisy positions where it is known. A model predicts best with what was fitted to positions as
    /// noisy as these, so that its uncertainty takes the bias where no consistent parameters stand for it.
    fn take_bias_off(&mut self, consistent: Option<&ConsistentLinks>) {
        let fit = &mut self.fit;
        if let Some(bias) = self.bias.take() {
            let stay = !consistent.is_some_and(|of| of.in_use);
            correct(&mut fit.theta, &mut fit.covariance, &bias, stay);
        }
        let size = (fit.theta.len(), fit.theta.len());
        let own = &mut self.covariance.view_mut((0, 0), size);
        own.copy_from(&fit.covariance);
    }
}

/// The essential unknowns, and the relative residual of each joint with those alone.
fn essentials(
    estimated: &InertialEstimate,
) -> Result<(EssentialParameters, Vec<f64>), IdentifyError> {
    let (fit, basis) = (&estimated.fit, &estimated.basis);
    let whole = residual_of(&basis.sums, &(&fit.theta - &basis.shift))?;
    let factor = factor(&basis.sums, &weights_of(&basis.sums, &whole))?;
    // targets without the laws that the rows are linear about: a parameter is absent at 0
    let mut plain = factor.clone();
    let u = factor.ncols() - 1;
    let target = factor.column(u) + factor.columns(0, u) * &basis.shift;
    plain.set_column(u, &target);
    let rows = (fit.rows * basis.sums.columns.joints as u64) as f64;
    let found = essential(&plain, rows, fit.effective_rows / fit.rows as f64)?;
    // on the rows of the fit, which a robust one has weighted; the residual of all rows grows alike
    let alone = residual_of(&basis.sums, &(&found.theta - &basis.shift))?;
    let growth = alone
        .iter()
        .zip(&whole)
        .map(|(a, w)| if *w > 0.0 { a / w } else { 1.0 });
    let error = growth
        .zip(&fit.relative_error)
        .map(|(g, e)| g * e.moving.unwrap_or(e.all));
    Ok((found, error.collect()))
}
