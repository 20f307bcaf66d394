//! The verdict of a diagnosis in a breath: the effects that were confirmed and their gain, how good the model now is,
//! and where most is left.

use super::step_words::titled;
use crate::report::usual;
use crate::report::words::listed;
use cft_ident_core::diagnose::{Diagnosis, Errors, FoundEffect, SplitErrors, StepStatus};
use cft_ident_core::number;
use cft_ident_stages::identify::{Diagnosed, DiagnosisVerdict, LoggedRobot, signal_words};
use cft_ident_stages::open_loop::JointFreeRun;

/// Effects that the verdict names; it counts the others.
const NAMED: usize = 3;

/// The verdict in words, and whether nothing calls for attention.
pub(super) fn words(machine: &LoggedRobot, found: &Diagnosed) -> (String, bool) {
    let d = &found.diagnosis;
    let lacking = found.verdict();
    let mut text = match lacking {
        DiagnosisVerdict::EffectsFound => added(machine, d),
        _ if !d.determined => {
            let text = "These data determine nothing: the noise is as large as the torque that the model explains.";
            return (text.to_owned(), false);
        }
        _ if !d.long_enough() => format!(
            "These logs are too short to find an effect: {} blocks of {} s, {} are needed.",
            d.blocks,
            number::significant(d.block_s, 2),
            d.least_blocks
        ),
        DiagnosisVerdict::NothingMissing => "Nothing is missing: what is left is noise.".to_owned(),
        _ => "No effect is sure enough to be written; more than noise is left.".to_owned(),
    };
    let (bought, gains_nothing) = bought(d);
    text += &format!(" {bought}");
    text += &taken_out(machine, d);
    if !is_exact(d) {
        text += &format!(" {}", usual::words(machine.file.log.torque_is));
    }
    let unusual = errors(d.errors_now()).1.overall.mean_relative_error_moving
        > usual::band(machine.file.log.torque_is)[1];
    if unusual {
        text += " That is more than usual.";
    }
    if let Some(left) = most_is_left(machine, d) {
        text += &format!(" {left}");
    }
    let worse = runs_worse(found);
    if !worse.is_empty() {
        text += &format!(
            " Use it for feed-forward and not to simulate: driven by the measured torques, it moves worse than the \
             given model at {worse}."
        );
    }
    let good = !gains_nothing
        && worse.is_empty()
        && !unusual
        && !matches!(lacking, DiagnosisVerdict::UnexplainedResidual);
    (text, good)
}

/// Joints that move worse, driven by the measured torques, where the model moves worse over all joints.
fn runs_worse(found: &Diagnosed) -> String {
    let Some(run) = &found.free_run else {
        return String::new();
    };
    let grows = |joint: &JointFreeRun| Some((joint.after.as_ref()?.rms / joint.given.rms).ln());
    let change: f64 = run.joints.iter().filter_map(grows).sum();
    let worse = run.worse().filter(|_| change > 0.0);
    listed(worse.map(|joint| joint.joint.as_str()))
}

/// Whether the error is so small that no published figure is of use beside it.
pub(super) fn is_exact(d: &Diagnosis) -> bool {
    let [least, _] = usual::band(None);
    errors(d.errors_now()).1.overall.mean_relative_error_moving < 0.5 * least
}

/// The effects of the written model, by how firm they are.
fn added(machine: &LoggedRobot, d: &Diagnosis) -> String {
    let graded = |grade: &str, steps: Vec<&FoundEffect>| {
        let names = steps.iter().take(NAMED);
        let mut names: Vec<String> = names.map(|s| titled(machine, &s.estimate)).collect();
        if steps.len() > NAMED {
            names.push(format!("{} more", steps.len() - NAMED));
        }
        let count = match steps.len() {
            1 => "One effect".to_owned(),
            n => format!("{n} effects"),
        };
        (!steps.is_empty()).then(|| format!("{count} {grade}: {}.", names.join("; ")))
    };
    let by = |status: StepStatus| {
        let steps = d.written().filter(|s| !s.accepted_by_user);
        steps.filter(|s| s.status == status).collect::<Vec<_>>()
    };
    let wanted = d.written().filter(|s| s.accepted_by_user).collect();
    let firm = match d.after.holdout {
        Some(_) => "confirmed, on held-out data too",
        None => "confirmed",
    };
    let all = [
        graded(firm, by(StepStatus::Confirmed)),
        graded("indicated, and written in part", by(StepStatus::Indicated)),
        graded("written because you asked for it", wanted),
    ];
    all.into_iter().flatten().collect::<Vec<_>>().join(" ")
}

/// The errors that count, and of which data they are: held-out ones where there are any.
pub(super) fn errors(of: &SplitErrors) -> (&'static str, &Errors) {
    match &of.holdout {
        Some(errors) => ("held-out error", errors),
        None => ("error of the fitted data", &of.train),
    }
}

/// How the diagnosis changed the error, and whether effects were written that gain nothing.
fn bought(d: &Diagnosis) -> (String, bool) {
    let ((data, before), (_, after)) = (errors(&d.before), errors(d.errors_now()));
    let mean = |e: &Errors| e.overall.mean_relative_error_moving;
    let [from, to] = [before, after].map(|e| number::percent(mean(e)));
    let changed = d.written().next().is_some();
    let rises = mean(after) > mean(before);
    let falls = from != to && !rises;
    let goes = match changed {
        false => format!("is {to}"),
        true if from == to => format!("stays at {to}"),
        true if rises => format!("RISES from {from} to {to}"),
        true => format!("falls from {from} to {to}"),
    };
    let over = if after.joints.len() > 1 {
        " (rms over the joints)"
    } else {
        ""
    };
    (format!("The {data} {goes}{over}."), changed && !falls)
}

/// The effects that held-out data took out of the model.
fn taken_out(machine: &LoggedRobot, d: &Diagnosis) -> String {
    let Some(selected) = &d.selected else {
        return String::new();
    };
    let vetoed = d.steps.iter().filter(|s| s.vetoed());
    let names: Vec<String> = vetoed.map(|s| titled(machine, &s.estimate)).collect();
    let names = names.join("; ");
    let error = |of: &SplitErrors| number::percent(errors(of).1.overall.mean_relative_error_moving);
    if d.written().next().is_none() {
        let after = error(&d.after);
        return format!(" Not written, for held-out data are worse with it ({after}): {names}.");
    }
    format!(
        " Not written, for held-out data are worse with it: {names}. The model as it is written has a {} of {}, \
         which is optimistic, since these data chose.",
        errors(selected).0,
        error(selected)
    )
}

/// The joint with the largest share of its torque left beyond the noise.
pub(super) fn worst(d: &Diagnosis) -> Option<usize> {
    let share = |j: &usize| d.left.unexplained[*j].share;
    let structured = d
        .structured_joints()
        .filter(|j| d.left.unexplained[*j].matters());
    structured.max_by(|a, b| share(a).total_cmp(&share(b)))
}

/// The joint with the largest share of its torque left beyond the noise, and the signals on which that depends.
fn most_is_left(machine: &LoggedRobot, d: &Diagnosis) -> Option<String> {
    let names = machine.robot.joint_names();
    let worst = worst(d)?;
    let error = number::percent(errors(d.errors_now()).1.joints[worst].headline());
    let place = match names.len() {
        1 => format!("More than noise is left ({error} of the torque)"),
        _ => format!(
            "Beyond noise, most is left in {} (its error is {error})",
            names[worst]
        ),
    };
    let dependence = d.left.dependence.iter().find(|of| of.joint == worst);
    let on = dependence.map(|of| {
        let signals = of.signals.iter().map(|s| signal_words(names, worst, *s));
        let signals: Vec<String> = signals.collect();
        format!("; it depends on {}", signals.join(" and "))
    });
    Some(place + &on.unwrap_or_default() + ".")
}
