//! The one-joint experiment.

use super::aim::ExciteAim;
use super::judge::{judged, refuse_broken};
use super::names::OutputNames;
use super::{ExciteRun, written};
use crate::cli::{CliError, Outcome};
use cft_ident_files::config::Trajectory;
use cft_ident_plant::excite::ladder::{LadderTask, design_ladder};
use cft_ident_plant::excite::strokes::{StrokesTask, design_strokes};
use cft_ident_plant::excite::{LawForeseen, Motion};
use cft_ident_report::report::json::JsonDocument;
use cft_ident_stages::identify::RobotSetup;

pub(super) fn ladder_task(bench: &ExciteRun, joint: &str) -> LadderTask {
    let part = match &bench.aim {
        Some(ExciteAim::Ladder { part, .. }) => *part,
        _ => 1.0,
    };
    LadderTask {
        joint: joint.to_owned(),
        seconds: bench.seconds,
        part,
        seed: bench.args.seed,
        rate_hz: bench.rate_hz,
        reserve: bench.args.margin,
    }
}

/// Strokes that tell an effect with a memory from its like.
pub(super) fn strokes(bench: &ExciteRun, names: &OutputNames) -> Result<Outcome, CliError> {
    let Some(ExciteAim::Strokes {
        joint,
        effect,
        width,
        torque,
    }) = &bench.aim
    else {
        return Err(CliError::usage("no effect with a memory is named"));
    };
    let logged = RobotSetup::new("", bench.file.clone());
    let task = StrokesTask {
        joint: joint.clone(),
        effect: *effect,
        width: *width,
        torque: *torque,
        cutoff_hz: logged.settings().cutoff_hz,
        rate_hz: bench.rate_hz,
        reserve: bench.args.margin,
    };
    let found = design_strokes(&bench.machine, &task)?;
    let trajectory = Trajectory::Points(found.file);
    let motion = Motion::of_file(&bench.machine, &trajectory, bench.seconds, bench.args.seed)?;
    let channels = &bench.machine.channels;
    let mut judged = judged(bench, &motion, channels, None, None)?;
    judged.separates = Some(found.separation);
    // it is not meant to separate the inertias
    judged.warnings.clear();
    refuse_broken(&judged)?;
    let of = (&*names.shown(), Some(trajectory));
    let report = written(bench, &motion, &judged, names, of)?;
    Ok(Outcome::new(
        report.text_for(bench.context.screen),
        JsonDocument::new("excite", &bench.inputs, &judged.warnings, &judged)?,
    ))
}

pub(super) fn ladder(
    bench: &ExciteRun,
    joint: &str,
    names: &OutputNames,
) -> Result<Outcome, CliError> {
    let bar = bench.context.progress("designing", None);
    let task = ladder_task(bench, joint);
    let found = design_ladder(&bench.machine, &task)?;
    drop(bar);
    bench.context.check()?;
    let trajectory = Trajectory::SingleJoint(found.file);
    let motion = Motion::of_file(&bench.machine, &trajectory, task.seconds, task.seed)?;
    let friction = LawForeseen {
        joint: joint.to_owned(),
        parameters: found.expected,
        usual_relative_std: Some(found.usual),
    };
    let channels = &bench.machine.channels;
    let mut judged = judged(bench, &motion, channels, None, Some(friction))?;
    judged.evaluations = Some(found.evaluations);
    refuse_broken(&judged)?;
    let of = (&*names.shown(), Some(trajectory));
    let report = written(bench, &motion, &judged, names, of)?;
    Ok(Outcome::new(
        report.text_for(bench.context.screen),
        JsonDocument::new("excite", &bench.inputs, &judged.warnings, &judged)?,
    ))
}
