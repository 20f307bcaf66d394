//! The first screen of the page of a diagnosis: errors per joint as bars, and the next thing to do.

use super::diagnose_words::{errors as errors_of, is_exact, worst};
use crate::report::figure::{ErrorBar, ErrorFigure, JointBars};
use crate::report::{Writer, usual};
use cft_ident_core::diagnose::{Errors, FoundEffect};
use cft_ident_core::number;
use cft_ident_files::config::ModelFile;
use cft_ident_stages::identify::{Diagnosed, LoggedRobot, narrowing_command, separating_command};

/// Errors per joint as bars, and the next thing to do.
pub(super) fn show(
    page: &mut Writer,
    (machine, found): (&LoggedRobot, &Diagnosed),
    (path, logs): (&str, &str),
) {
    page.figure(bars(machine, found).svg());
    let typed = (&*local(path), &*local(logs));
    page.paragraph(&next(machine, found, typed));
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
fn bars(machine: &LoggedRobot, found: &Diagnosed) -> ErrorFigure {
    let d = &found.diagnosis;
    let data = match d.after.holdout {
        Some(_) => "held-out data",
        None => "the fitted data",
    };
    let errors = [&d.before, d.errors_now()].map(|split| errors_of(split).1);
    let bar = |errors: &Errors, j: usize| ErrorBar {
        error: errors.joints[j].headline(),
        interval_95: Some(errors.joints[j].interval_95),
    };
    let joints = machine.robot.joint_names().iter().enumerate();
    let joints = joints.map(|(j, joint)| JointBars {
        joint: joint.clone(),
        before: d.written().next().map(|_| bar(errors[0], j)),
        after: bar(errors[1], j),
    });
    ErrorFigure {
        title: format!("Relative torque error on {data}"),
        names: ["as given", "after"].map(str::to_owned),
        joints: joints.collect(),
        limit: None,
        usual: (!is_exact(d)).then(|| usual::drawn(machine.file.log.torque_is)),
    }
}

/// The first effect of the written model that the data do not separate from another.
fn unclear(found: &Diagnosed) -> Option<&FoundEffect> {
    let mut written = found.diagnosis.written();
    written.find(|step| !step.alternatives.is_empty())
}

/// The next motion to record, as a command: it separates an effect from its like, or narrows weak parameters.
pub(super) fn next_motion(
    writer: &mut Writer,
    (machine, found): (&LoggedRobot, &Diagnosed),
    (file, path): (&ModelFile, &str),
) {
    let d = &found.diagnosis;
    // limits of the motion are the positions and speeds of the logs
    if !d.determined || file.held_out.is_empty() {
        return;
    }
    let separating =
        unclear(found).and_then(|s| separating_command(&s.estimate, &machine.robot, path));
    match separating {
        Some(command) => writer.code(&command),
        None => narrowing(writer, file, path),
    }
}

/// The motion that narrows the weak parameters of a model, where there are some.
pub(super) fn narrowing(writer: &mut Writer, file: &ModelFile, path: &str) {
    if let Some(([open, all], command)) = narrowing_command(file, path) {
        let words =
            format!("{open} of {all} parameters are weak; a motion to record that narrows them:");
        writer.note("", &words, 2);
        writer.code(&command);
    }
}

/// The next step; the paths of the model and of the logs are those that a shell takes.
pub(super) fn next(machine: &LoggedRobot, found: &Diagnosed, (path, logs): (&str, &str)) -> String {
    let d = &found.diagnosis;
    if let Some(contact) = found.contacts.first() {
        return format!("Next: see whether something touched the robot. {contact}.");
    }
    if !d.determined {
        return "Next: move the joints faster and farther, or log a torque with less noise."
            .to_owned();
    }
    if !d.long_enough() && d.written().next().is_none() {
        return format!(
            "Next: log for longer: {} s at least ({} blocks of {} s).",
            number::significant(d.block_s * d.least_blocks as f64, 2),
            d.least_blocks,
            number::significant(d.block_s, 2)
        );
    }
    if let Some(step) = unclear(found) {
        let effect = &step.estimate;
        return format!(
            "Next: {}. That separates {} from {}.",
            effect.law.entry.separate_by,
            effect.title(&machine.robot),
            step.alternatives[0].title(&machine.robot)
        );
    }
    match worst(d).map(|j| &machine.robot.joint_names()[j]) {
        Some(joint) if !found.searched => format!(
            "Next: search a formula for what is left of {joint}: `cft-ident diagnose {logs} -m {path} --search`."
        ),
        Some(joint) => format!(
            "Next: look at the residual of {joint}, which has a pattern that no known effect explains, and \
             log it at other speeds and loads."
        ),
        None if d.written().next().is_none() => {
            format!("Next: use the model: `cft-ident export -m {path} --c model.h`.")
        }
        None => format!(
            "Next: try the refined model on a log of another motion: `cft-ident validate LOG -m {path}`."
        ),
    }
}
