//! Stretches in which something pushes the robot, and rows that a fit hangs on.

use super::judged_estimate::JudgedEstimate;
use super::lsq_problem::LsqProblem;
use crate::input::control::Control;
use crate::input::dataset::Dataset;
use crate::input::error::IdentifyError;
use crate::input::log_data::{LogData, bridges};
use crate::input::lsq_rows::{LsqRows, PositionReading};
use crate::input::position_cutoff::choose_smoothing;
use crate::input::robot_setup::RobotSetup;
use crate::input::unknowns::columns;
use crate::note::{FitNote, NumberWithStd, StageNote};
use cft_ident_core::inertia::jumps::ResidualJump;
use cft_ident_core::inertia::solve::{Fit, RowWeighting, fit};
use cft_ident_files::config::robot_file::FrictionLawKind;
use cft_ident_logs::log::{RowFault, escape};

/// Deviations by which rows move a parameter: twice as many miss doubtful fits, half as many report chance.
const MOVED_DEVIATIONS: f64 = 4.0;
/// Room on both sides of a stretch that is to be left out \[s\]: the filters carry it so far.
const ROOM_S: f64 = 0.1;

/// Stretches of these logs in which something pushes the robot, one note each.
pub(crate) fn contacts(
    setup: &RobotSetup,
    logs: &[LogData],
    control: &Control,
) -> Result<Vec<StageNote>, IdentifyError> {
    let linear = setup.file.friction_law() != FrictionLawKind::DoubleTanh;
    if !linear || setup.robot.joints() < 2 {
        return Ok(Vec::new());
    }
    let data = Dataset::new(setup, logs);
    let mut rows = LsqRows::new(&data, choose_smoothing(&data, &[], control)?, control);
    rows.fold(PositionReading::Declared, &columns(setup, None), None)?;
    contacts_in(&rows)
}

/// The stretches that were seen as rows were folded for the first time, one note each.
pub(crate) fn contacts_in(rows: &LsqRows) -> Result<Vec<StageNote>, IdentifyError> {
    let noted = |(log, jump): (&LogData, &ResidualJump)| {
        let first = log.first_row()?;
        Ok(StageNote::Fit(contact(rows.setup, log, jump, first)))
    };
    rows.jumps().into_iter().map(noted).collect()
}

/// `first` is the time of the first row that is read, as the rows have it [s].
fn contact(setup: &RobotSetup, log: &LogData, jump: &ResidualJump, first: f64) -> FitNote {
    let [from, to] = jump.span.map(|t| t - first);
    let names = setup.robot.joint_names();
    let joints = jump.joints.iter();
    FitNote::Contact {
        log: escape(&log.name()),
        joints: joints.clone().map(|(j, _)| names[*j].clone()).collect(),
        ratio: joints.map(|(_, ratio)| *ratio).fold(0.0, f64::max),
        span: [from, to],
        leave_out: [(from - ROOM_S).max(0.0), to + ROOM_S],
    }
}

/// Parameters that a linear fit of logs finds elsewhere where spikes stay as they were logged.
pub(crate) fn moved_by_bridges(
    problem: &LsqProblem,
    judged: &JudgedEstimate,
    control: &Control,
) -> Result<Option<FitNote>, IdentifyError> {
    if !problem.is_linear() || !bridges(&problem.data.logs)? {
        return Ok(None);
    }
    let kept = problem.data.setup.keeping(RowFault::Spike);
    let data = Dataset::new(&problem.data.setup, &problem.data.logs).of_robot(kept, control)?;
    let mut kept = LsqRows::new(&data, choose_smoothing(&data, &[], control)?, control);
    let as_logged = kept.fold(PositionReading::Declared, &problem.columns, None)?;
    let bridged = fit(&judged.estimate.basis.sums, RowWeighting::Wls);
    let (Ok(bridged), Ok(as_logged)) = (bridged, fit(&as_logged, RowWeighting::Wls)) else {
        return Ok(None);
    };
    let number = |fit: &Fit, i: usize| {
        Some(NumberWithStd {
            value: *fit.theta.get(i).filter(|_| fit.determined[i])?,
            std: fit.covariance[(i, i)].max(0.0).sqrt(),
        })
    };
    let moved = judged
        .unknowns
        .iter()
        .enumerate()
        .filter_map(|(i, unknown)| {
            let (a, b) = (number(&bridged, i)?, number(&as_logged, i)?);
            let far = (a.value - b.value).abs() > MOVED_DEVIATIONS * a.std.hypot(b.std);
            far.then(|| (unknown.key.clone(), [a, b]))
        });
    let moved: Vec<_> = moved.collect();
    Ok((!moved.is_empty()).then_some(FitNote::HangsOnBridged { moved }))
}
