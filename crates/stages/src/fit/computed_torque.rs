//! Whether what stands for torques was measured: controllers log what they compute or ask for, too.

use super::dynamics::IdentifiedDynamics;
use super::lsq_problem::LsqProblem;
use crate::held_out::residual::JointResidual;
use crate::input::error::IdentifyError;
use crate::input::log_data::LogData;
use crate::input::robot_setup::RobotSetup;
use crate::input::unknowns::FittedUnknown;
use crate::note::{FitNote, StageNote};
use cft_ident_core::inertia::columns::JointTerm;
use cft_ident_logs::inspect::{ChannelRole, commanded_role};
use cft_ident_logs::log::{FurtherCommand, escape};

/// What no drive shows that was measured.
struct NoDrive {
    /// Relative error of the torque, of every joint that moves, a fraction: the torque of the best drives that were
    /// measured is missed by more than 1 %, that of a model by its digits alone.
    error: f64,
    /// Torque of the friction at the joint's top speed over the rms torque, of every joint, a fraction: bearings alone
    /// take some percent.
    friction: f64,
}

/// Times the error of the whole torque from which on that of what varies is said too.
const MORE: f64 = 2.0;

const NO_DRIVE: NoDrive = NoDrive {
    error: 0.005,
    friction: 0.005,
};

/// Columns of torques whose names say that they were commanded or computed, one note for all logs.
pub(crate) fn asked_for(setup: &RobotSetup, logs: &[LogData]) -> Option<FitNote> {
    if setup.file.log.torque.is_some() {
        return None;
    }
    let logs = logs.iter().map(|log| log.recording().layout());
    let mut columns: Vec<String> = logs
        .flat_map(|layout| layout.torques.iter())
        .filter(|channel| commanded_role(&channel.column).is_some())
        .map(|channel| escape(&channel.column))
        .collect();
    columns.dedup();
    columns.truncate(setup.robot.joints());
    (!columns.is_empty()).then_some(FitNote::AskedFor { columns })
}

/// Commanded velocities and torques that logs hold and the law of the controller leaves out, by the keys for them; what is
/// 0 throughout adds nothing to it.
pub(crate) fn unused_commands(
    setup: &RobotSetup,
    logs: &[LogData],
) -> Vec<(&'static str, Vec<String>)> {
    let Some(law) = &setup.file.log.torque else {
        return Vec::new();
    };
    let mut out = Vec::new();
    let unnamed = |command: &FurtherCommand| law.columns_of(*command).is_none();
    for command in FurtherCommand::ALL.into_iter().filter(unnamed) {
        let role = ChannelRole::of_command(command);
        let is_asked = |name: &str| commanded_role(name) == Some(role);
        let names = logs.iter().map(|log| log.recording().columns(&is_asked));
        let mut columns: Vec<String> = names.flatten().map(|name| escape(&name)).collect();
        columns.dedup();
        columns.truncate(setup.robot.joints());
        if !columns.is_empty() {
            out.push((command.key(), columns));
        }
    }
    out
}

/// Torques that are an offset for so large a part that the error of what varies is more than twice that of the whole.
pub(crate) fn mostly_offset(found: &IdentifiedDynamics) -> Vec<StageNote> {
    let own = |joint: &JointResidual| -> Option<StageNote> {
        let is = |u: &&FittedUnknown| u.key == "offset" && u.joint.as_ref() == Some(&joint.joint);
        let offset = found.unknowns.iter().find(is)?.fitted;
        let whole = joint.headline();
        let rmse = joint.rmse_moving.unwrap_or(joint.rmse);
        let torque = rmse / whole;
        let varying = rmse / (torque * torque - offset * offset).max(rmse * rmse).sqrt();
        (whole > 0.0 && varying > MORE * whole).then(|| {
            StageNote::Fit(FitNote::MostlyOffset {
                joint: joint.joint.clone(),
                errors: [whole, varying],
            })
        })
    };
    found.joints.iter().filter_map(own).collect()
}

/// A fit that is better than a measured drive allows, and has no friction at all.
pub(crate) fn no_drive(
    problem: &LsqProblem,
    found: &IdentifiedDynamics,
) -> Result<Option<StageNote>, IdentifyError> {
    if problem.before.is_some() {
        return Ok(None);
    }
    let speeds = problem.data.top_speeds()?;
    let own = &found.columns.own;
    let base = found.unknowns.len() - own.iter().map(Vec::len).sum::<usize>();
    let (mut error, mut friction): (f64, f64) = (0.0, 0.0);
    let mut place = base;
    for ((joint, terms), speed) in found.joints.iter().zip(own).zip(speeds) {
        let of = found.unknowns[place..].iter().zip(terms);
        let taken = of.map(|(unknown, term)| match term {
            JointTerm::Viscous => unknown.fitted.abs() * speed,
            JointTerm::Offset => 0.0,
            _ => unknown.fitted.abs(),
        });
        let taken: f64 = taken.sum();
        place += terms.len();
        if !joint.moves() || joint.headline() <= 0.0 {
            continue;
        }
        let (rmse, relative) = match (joint.rmse_moving, joint.relative_error_moving) {
            (Some(rmse), Some(relative)) => (rmse, relative),
            _ => (joint.rmse, joint.relative_error),
        };
        error = error.max(relative);
        friction = friction.max(taken * relative / rmse);
    }
    let none = error > 0.0 && error < NO_DRIVE.error && friction < NO_DRIVE.friction;
    Ok(none.then_some(StageNote::Fit(FitNote::NoDrive { error, friction })))
}
