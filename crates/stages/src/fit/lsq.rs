//! The inertial parameters by linear least squares, and friction with them where it is not known.

use super::by_motion::by_motion;
use super::computed_torque::{mostly_offset, no_drive};
use super::contact::moved_by_bridges;
use super::dynamics::IdentifiedDynamics;
use super::judged_estimate::JudgedEstimate;
use super::lsq_notes::lsq_notes;
use super::lsq_problem::{LsqProblem, LsqSettings};
use super::replayed_torque::replayed;
use crate::held_out::residual::{ErrorOfLog, JointResidual};
use crate::held_out::validate::errors_on_fitted;
use crate::input::control::Control;
use crate::input::dataset::Dataset;
use crate::input::error::IdentifyError;
use crate::input::lsq_rows::LsqRows;
use crate::input::position_cutoff::choose_smoothing;

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
    let problem = LsqProblem::new(data, settings)?;
    let (rows, judged) = fit(&problem, control)?;
    let bridged = moved_by_bridges(&problem, &judged, control)?;
    let notes = lsq_notes(&problem, &rows, &judged, bridged)?;
    let mut found = IdentifiedDynamics::new(&problem, &rows, judged, notes)?;
    // every figure is that of the numbers that are written
    let model = found.model(&data.setup, problem.friction_file());
    let (errors, by_log) = errors_on_fitted(data, &model, control)?;
    found.joints = errors.joints.into_iter().map(JointResidual::of).collect();
    if by_log.len() > 1 {
        found.by_log = by_log.into_iter().map(ErrorOfLog::of).collect();
    }
    found.notes.extend(no_drive(&problem, &found)?);
    found.notes.extend(mostly_offset(&found));
    found.notes.extend(replayed(&data.logs, control)?);
    // what is set aside is looked at row by row
    if data.reduced.is_empty() {
        found.set_blocks_aside(data, &model, control)?;
    }
    if let Some(window) = settings.open_loop {
        by_motion(data, &mut found, window, control)?;
    }
    Ok(found)
}

/// Fits the same parameters and says nothing of them: no notes, no errors, no data set aside.
pub(crate) fn lsq_parameters(
    data: &Dataset,
    settings: &LsqSettings,
    control: &Control,
) -> Result<IdentifiedDynamics, IdentifyError> {
    let problem = LsqProblem::new(data, settings)?;
    let (rows, judged) = fit(&problem, control)?;
    IdentifiedDynamics::new(&problem, &rows, judged, Vec::new())
}

/// Reads the rows and solves for the unknowns.
fn fit<'a>(
    problem: &LsqProblem<'a>,
    control: &'a Control,
) -> Result<(LsqRows<'a>, JudgedEstimate), IdentifyError> {
    let data = problem.data;
    let smoothing = choose_smoothing(data, &problem.columns.known_laws(), control)?;
    let mut rows = LsqRows::new(data, smoothing, control);
    let estimate = problem.estimate(&mut rows)?;
    let judged = JudgedEstimate::new(problem, &rows, estimate)?;
    Ok((rows, judged))
}
