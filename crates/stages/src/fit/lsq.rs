//! The inertial parameters by linear least squares, and friction with them where it is not known.

use super::by_motion::by_motion;
use super::consistent::{ConsistentLinks, consistent, or_plain_fit};
use super::contact::hangs_on_bridged;
use super::dynamics::{EssentialFit, IdentifiedDynamics};
use super::estimate::{FitRows, InertialEstimate, estimate};
use super::gains::CurrentGains;
use super::geometry::geometry;
use super::known_friction::FrictionBefore;
use super::lsq_notes::{confounded, negative, rests};
use super::weakest::weakest;
use crate::held_out::hold_out::{Held, hold_out, or_note};
use crate::held_out::open_loop::is_in_si;
use crate::held_out::residual::{JointResidual, RelativeError};
use crate::held_out::validate::errors_on_fitted;
use crate::input::control::Control;
use crate::input::dataset::{Dataset, GivenModel};
use crate::input::error::IdentifyError;
use crate::input::gain_error::GainError;
use crate::input::log_data::LogData;
use crate::input::model::refined;
use crate::input::own_settings::CutoffCosts;
use crate::input::passes::LogPasses;
use crate::input::reduced::error::ReducedError;
use crate::input::reduced::reduced_log::{MadeWith, ReducedLog};
use crate::input::repeated::each_row_once;
use crate::input::unknowns::{FittedUnknown, columns, unknowns};
use crate::note::{FitNote, StageNote};
use cft_ident_core::inertia::accumulate::RelativeResidual;
use cft_ident_core::inertia::encoder::correct;
use cft_ident_core::inertia::essential::{EssentialParameters, essential};
use cft_ident_core::inertia::gains::by_gains;
use cft_ident_core::inertia::solution::FitError;
use cft_ident_core::inertia::solve::{factor, residual_of, weights_of};
use cft_ident_core::robot::model::JointFriction;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::campaign::EstimatorKind;
use cft_ident_files::config::robot_file::FrictionLawKind;

/// How the inertial parameters are fitted.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LsqSettings<'a> {
    /// How parameters are estimated from the rows.
    pub estimator: EstimatorKind,
    /// Physically consistent parameters beside those of the plain fit.
    pub consistent: bool,
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

/// Fits the inertial parameters.
///
/// # Errors
/// Logs that cannot be used, settings that contradict the robot file, and data that determine none
/// of the parameters.
pub fn lsq(
    data: &Dataset,
    settings: &LsqSettings,
    control: &Control,
) -> Result<IdentifiedDynamics, IdentifyError> {
    let (setup, logs) = (&data.setup, data.logs.as_slice());
    let estimator = settings.estimator;
    let friction = (settings.friction).map(|given| (given.name.as_str(), &given.file));
    setup.check_gains()?;
    each_row_once(setup, &[("fit", logs)])?;
    if settings.gains.is_some() && friction.is_some() {
        return Err(GainError::FrictionGiven.into());
    }
    let law = friction.is_none() && setup.file.friction_law() == FrictionLawKind::DoubleTanh;
    if law && !matches!(estimator, EstimatorKind::Wls | EstimatorKind::Oe) {
        return Err(IdentifyError::LawIsNotLinear {
            estimator: estimator.name(),
        });
    }
    let reduced: Vec<&ReducedLog> = logs.iter().filter_map(LogData::reduced).collect();
    if let Some(part) = reduced.first()
        && estimator != EstimatorKind::Wls
    {
        return Err(ReducedError::NeedsLog {
            log: part.name().to_owned(),
            what: format!("what the estimator {} reads", estimator.name()),
            remedy: "a reduced log holds rows as `--estimator wls` weighs them: take that, or give the log itself",
        }
        .into());
    }
    let before = friction.map(|given| {
        let hold = settings.hold_friction || estimator == EstimatorKind::Ols || !reduced.is_empty();
        FrictionBefore::of(setup, given, logs, (estimator, hold), control)
    });
    let before = before.transpose()?;
    let linear = columns(setup, before.as_ref().map(|b| b.known.as_slice()));
    let name = friction.map(|(name, _)| name);
    let wanted = MadeWith::of(
        &setup.file,
        name.zip(before.as_ref().map(|b| b.known.as_slice())),
    );
    for part in &reduced {
        part.belongs_to(&wanted)?;
    }
    let known = linear.known.iter();
    let laws: Vec<_> = known
        .map(|known| Some(JointFriction::DoubleTanh(known.as_ref()?.law)))
        .collect();
    let own = setup.own_settings(logs, &laws, control)?;
    let costs: Vec<CutoffCosts> = own.iter().map(|own| own.costs.clone()).collect();
    let mut passes = LogPasses::new(setup, logs, control).each_by_itself(own);
    passes.plain = estimator == EstimatorKind::Ols;
    let mut estimated = estimate(&mut passes, linear.clone(), estimator, law)?;
    if let Some(gains) = settings.gains {
        share_uncertainty(&mut estimated, gains)?;
    }
    let (essential, essential_error) = essentials(&estimated)?;
    let resting = estimated.basis.sums.resting_shares();
    // in amperes nothing says what a body can be
    let consistent = match settings.consistent && is_in_si(setup) {
        true => {
            let fastest = setup.fastest(logs)?;
            let found = consistent(setup, &estimated, &fastest);
            or_plain_fit(found, &mut passes.notes)
        }
        false => None,
    };
    // estimates without their bias; a model predicts best with what was fitted to positions as noisy as these
    if let Some(bias) = estimated.bias.take() {
        let stay = !consistent.as_ref().is_some_and(|of| of.in_use);
        let fit = &mut estimated.fit;
        correct(&mut fit.theta, &mut fit.covariance, &bias, stay);
    }
    let InertialEstimate {
        columns,
        fit,
        mut covariance,
        account,
        basis: FitRows { sums, .. },
        ..
    } = estimated;
    let u = fit.theta.len();
    covariance
        .view_mut((0, 0), (u, u))
        .copy_from(&fit.covariance);
    let mut notes = passes.contacts()?;
    notes.extend(StageNote::of_robot(&setup.file));
    notes.extend(settings.gains.iter().flat_map(|g| g.notes.clone()));
    let of_fit = consistent.iter().flat_map(ConsistentLinks::notes);
    let of_fit = of_fit
        .chain(
            friction
                .is_none()
                .then_some(FitNote::FrictionFitted { law }),
        )
        .chain(account.notes())
        .chain(held_by_parts(settings, &reduced));
    notes.extend(of_fit.map(StageNote::Fit));
    notes.append(&mut passes.notes);
    notes.extend(rests(setup, &resting).map(StageNote::Fit));
    let mut friction_of_fit = Vec::new();
    let mut friction_prior = Vec::new();
    if let (Some(before), Some((_, file))) = (&before, friction) {
        friction_prior = before.kept(file, &passes.inputs);
        // what a fit has among its unknowns is no friction beside them
        if columns.known.iter().any(Option::is_some) {
            friction_of_fit = before.after(setup, &columns, &covariance);
            let fastest = setup.fastest(logs)?;
            notes.extend(before.beyond(setup, &columns, &covariance, &fastest));
        }
    }
    let summary = passes.summary.take().ok_or(IdentifyError::NoLog)?;
    let mut inputs = std::mem::take(&mut passes.inputs);
    inputs.extend(settings.gains.iter().flat_map(|g| g.inputs.clone()));
    let unknowns = unknowns(setup, &columns, &fit, &essential);
    let plain = matches!(estimator, EstimatorKind::Ols | EstimatorKind::Wls) && !law;
    if plain && before.is_none() && reduced.is_empty() {
        let rows = (&linear, &sums);
        let hangs = hangs_on_bridged(setup, logs, rows, &unknowns, control)?;
        notes.extend(hangs.map(StageNote::Fit));
    }
    let doubts = confounded(&fit, &unknowns).into_iter();
    notes.extend(doubts.chain(negative(&unknowns)).map(StageNote::Fit));
    let costs: Vec<&CutoffCosts> = costs.iter().collect();
    let (position_cutoffs, wrong) = CutoffCosts::described(&costs, setup, &columns, &fit);
    notes.extend(wrong);
    if unknowns
        .iter()
        .all(|u| u.verdict == Verdict::NotIdentifiable)
    {
        return Err(IdentifyError::NothingDetermined);
    }
    let known = |u: &&FittedUnknown| u.verdict == Verdict::Identified && !u.negligible;
    let left = |e: &RelativeResidual| e.moving.unwrap_or(e.all);
    let least = fit
        .relative_error
        .iter()
        .map(left)
        .fold(f64::INFINITY, f64::min);
    if !unknowns.iter().any(|u| known(&u)) && least > NOISE_ONLY_SHARE {
        return Err(IdentifyError::OnlyNoise { left: least });
    }
    let of_geometry = geometry(setup, fit.condition.normalised, &unknowns);
    let found = of_geometry.iter().cloned().map(Box::new);
    notes.extend(found.map(FitNote::Geometry).map(StageNote::Fit));
    let plain_error: Vec<f64> = fit.relative_error.iter().map(left).collect();
    let mut found = IdentifiedDynamics {
        held: Held::default(),
        by_motion: None,
        essential: EssentialFit {
            count: essential.essential.iter().filter(|e| **e).count(),
            joints: RelativeError::each(setup, &essential_error),
        },
        condition: fit.condition,
        rank: fit.rank,
        weakest_direction: weakest(&fit, &unknowns),
        samples: fit.rows * setup.robot.joints() as u64,
        effective_samples: fit.effective_rows * setup.robot.joints() as f64,
        unconstrained_residual: match &consistent {
            Some(of) if of.in_use => RelativeError::each(setup, &plain_error),
            _ => Vec::new(),
        },
        joints: Vec::new(),
        friction: friction_of_fit,
        friction_prior,
        position_cutoffs,
        columns,
        fit,
        covariance,
        account,
        gains: settings.gains.map_or(Vec::new(), |g| g.joints.clone()),
        consistent,
        unknowns,
        summary,
        inputs,
        notes,
        setup: of_geometry,
    };
    // every figure is that of the numbers that are written
    let file = found.model(setup, friction.map(|(_, file)| file));
    let errors = errors_on_fitted(setup, &file, logs, control)?;
    found.joints = errors.joints.into_iter().map(JointResidual::of).collect();
    // what is set aside is looked at row by row
    if reduced.is_empty() {
        let smoothed = setup.smoothed_as(&found.position_cutoffs);
        let tried = refined(&file, &setup.name)
            .and_then(|model| hold_out(&smoothed, (&file, &model), (logs, &found.inputs), control));
        found.held = or_note(tried, &mut found.notes)?;
    }
    if let Some(window) = settings.open_loop {
        by_motion(setup, &mut found, logs, window, control)?;
    }
    Ok(found)
}

/// Friction that could move with the rows of logs stays where reduced ones have it.
fn held_by_parts(settings: &LsqSettings, reduced: &[&ReducedLog]) -> Option<FitNote> {
    let part = reduced.first()?;
    let moved = settings.friction.is_some()
        && !settings.hold_friction
        && settings.estimator == EstimatorKind::Wls;
    moved.then(|| FitNote::FrictionOfReduced {
        log: part.name().to_owned(),
    })
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

/// Share that a fit leaves of every joint where noise is as large as the torque: noise leaves 0.7 of their sum.
const NOISE_ONLY_SHARE: f64 = 0.7;
/// The essential unknowns, and the relative residual of each joint with those alone.
fn essentials(
    estimated: &InertialEstimate,
) -> Result<(EssentialParameters, Vec<f64>), IdentifyError> {
    let (fit, basis) = (&estimated.fit, &estimated.basis);
    let weights = weights_of(
        &basis.sums,
        &residual_of(&basis.sums, &(&fit.theta - &basis.shift))?,
    );
    let factor = factor(&basis.sums, &weights)?;
    // targets without the laws that the rows are linear about: a parameter is absent at 0
    let mut whole = factor.clone();
    let u = factor.ncols() - 1;
    let target = factor.column(u) + factor.columns(0, u) * &basis.shift;
    whole.set_column(u, &target);
    let rows = (fit.rows * basis.sums.columns.joints as u64) as f64;
    let found = essential(&whole, rows, fit.effective_rows / fit.rows as f64)?;
    // on the rows of the fit, which a robust one has weighted; the residual of all rows grows alike
    let whole = residual_of(&basis.sums, &(&fit.theta - &basis.shift))?;
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
