//! The one-joint experiment.

use super::aim::Aim;
use super::judge::{judged, refuse_broken};
use super::names::Names;
use super::{Bench, written};
use crate::cli::{CliError, Outcome};
use cft_ident_files::config::Trajectory;
use cft_ident_plant::excite::ladder::{LadderTask, design_ladder};
use cft_ident_plant::excite::{LawForeseen, Motion};
use cft_ident_report::report::json::Document;

pub(super) fn ladder_task(bench: &Bench, joint: &str) -> LadderTask {
    let (seconds, part) = match &bench.aim {
        Some(Aim::Ladder { seconds, part, .. }) => (*seconds, *part),
        _ => (bench.args.seconds, 1.0),
    };
    LadderTask {
        joint: joint.to_owned(),
        seconds,
        part,
        seed: bench.args.seed,
        rate_hz: bench.rate_hz,
        reserve: bench.args.margin,
    }
}

pub(super) fn ladder(bench: &Bench, joint: &str, names: &Names) -> Result<Outcome, CliError> {
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
        report.text_for(bench.context.detail),
        Document::new("excite", &bench.inputs, &judged.warnings, &judged)?,
    ))
}
