//! The first screen of the page of a diagnosis: errors per joint as bars, and the next thing to do.

use super::diagnose_words::{errors as errors_of, is_exact, worst};
use crate::report::figure::{ErrorBar, ErrorFigure, JointBars};
use crate::report::{Report, Writer, usual};
use cft_ident_core::diagnose::{FoundEffect, UseErrors};
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_stages::identify::{Diagnosed, RobotSetup, narrowing_command, separating_command};

/// Errors per joint as bars.
pub(super) fn show(page: &mut Writer, setup: &RobotSetup, found: &Diagnosed) {
    page.figure(bars(setup, found).svg());
}

/// The next step, for a terminal and for a page.
pub(super) fn write_next(
    report: &mut Report,
    (setup, found): (&RobotSetup, &Diagnosed),
    (file, path, logs): (&ModelFile, &str, &str),
) {
    let of = (setup, found);
    let (text, command) = next(of, file, (path, logs));
    report.terminal().next(&text, command);
    let (text, command) = next(of, file, (&*local(path), &*local(logs)));
    report.page().next(&text, command);
}

/// Paths of a command as a page has them: an absolute one by its last part, for a page is the same on every machine.
pub(super) fn local(words: &str) -> String {
    let words = words.split(' ').map(|word| match word.starts_with('/') {
        true => word.rsplit('/').next().unwrap_or(word),
        false => word,
    });
    words.collect::<Vec<_>>().join(" ")
}

/// Errors of every joint before and after: held-out ones where there are any.
fn bars(setup: &RobotSetup, found: &Diagnosed) -> ErrorFigure {
    let d = &found.diagnosis;
    let data = match d.after.holdout {
        Some(_) => "held-out data",
        None => "the fitted data",
    };
    let errors = [&d.before, &d.after].map(|split| errors_of(split).1);
    let bar = |errors: &UseErrors, j: usize| ErrorBar {
        error: errors.joints[j].headline(),
        interval_95: Some(errors.joints[j].interval_95),
    };
    let joints = setup.robot.joint_names().iter().enumerate();
    let joints = joints.map(|(j, joint)| JointBars {
        joint: joint.clone(),
        before: d.changes_model().then(|| bar(errors[0], j)),
        after: bar(errors[1], j),
    });
    ErrorFigure {
        title: format!("Relative torque error on {data}"),
        names: ["before", "after"].map(str::to_owned),
        joints: joints.collect(),
        limit: None,
        usual: (!is_exact(d)).then(|| usual::drawn(setup.file.log.torque_is)),
    }
}

/// The first effect of the written model that the data do not separate from another.
fn unclear(found: &Diagnosed) -> Option<&FoundEffect> {
    let mut written = found.diagnosis.written();
    written.find(|step| !step.alternatives.is_empty())
}

/// The motion that narrows the weak parameters of a model, where there are some.
pub(super) fn narrowing(writer: &mut Writer, file: &ModelFile, path: &str) {
    if let Some(([open, all], command)) = narrowing_command(file, path) {
        let words =
            format!("{open} of {all} parameters are not identified. A motion that narrows them:");
        writer.note("", &words, 2);
        writer.code(&command);
    }
}

/// The next step, and the command for it where there is one; the paths of the model and of the logs are those that a
/// shell takes.
fn next(
    (setup, found): (&RobotSetup, &Diagnosed),
    file: &ModelFile,
    (path, logs): (&str, &str),
) -> (String, Option<String>) {
    let d = &found.diagnosis;
    let alone = |text: String| (text, None);
    if let Some(contact) = found.contacts.first() {
        return alone(format!(
            "Next: see whether something touched the robot. {contact}."
        ));
    }
    if !d.determined {
        return alone(
            "Next: move the joints faster and farther, or log a torque with less noise.".to_owned(),
        );
    }
    if !d.long_enough() && d.written().next().is_none() {
        return alone(format!(
            "Next: log for at least {} s ({} blocks of {} s).",
            number::significant(d.block_s * d.least_blocks as f64, 2),
            d.least_blocks,
            number::significant(d.block_s, 2)
        ));
    }
    if let Some(step) = unclear(found) {
        let effect = &step.estimate;
        let like = &step.alternatives[0];
        let (name, other) = match effect.place == like.place {
            // the joint is said once
            true => (effect.name().to_owned(), like.title(&setup.robot)),
            false => (effect.title(&setup.robot), like.title(&setup.robot)),
        };
        // limits of the motion are the positions and speeds of the logs
        let command = match file.held_out.is_empty() {
            true => None,
            false => separating_command(effect, &setup.robot, path),
        };
        return match command {
            Some(command) => (
                format!("Next: log the motion that separates {name} from {other}:"),
                Some(command),
            ),
            None => alone(format!(
                "Next: {}. That separates {name} from {other}.",
                effect.law.entry.separate_by
            )),
        };
    }
    match worst(d).map(|j| &setup.robot.joint_names()[j]) {
        Some(joint) if !found.searched => (
            format!("Next: search a formula for the residual of {joint}:"),
            Some(format!("cft-ident diagnose {logs} -m {path} --search")),
        ),
        Some(joint) => alone(format!(
            "Next: look at the residual of {joint} in the report, and log it at other speeds and loads."
        )),
        None if !d.changes_model() => (
            "Next: use the model:".to_owned(),
            Some(format!("cft-ident export -m {path} --c model.h")),
        ),
        None => (
            "Next: test the new model on a log of another motion:".to_owned(),
            Some(format!("cft-ident validate LOG -m {path}")),
        ),
    }
}
