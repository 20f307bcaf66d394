//! One effect that was found, in words.

use crate::report::words::{listed, scaled};
use cft_ident_core::diagnose::{FoundEffect, StepStatus};
use cft_ident_core::effect::Added;
use cft_ident_core::number;
use cft_ident_stages::identify::{LoggedRobot, numbers_of};

/// The joints that an effect makes worse on held-out data, with the change of their errors.
pub(super) fn worsened(step: &FoundEffect) -> String {
    let joints = step.joints.iter().filter(|j| j.worsened).map(|j| {
        let [low, high] = j.interval_95.map(|x| format!("{:+.2}", 100.0 * x));
        let [before, after] = [j.before, j.after].map(number::percent);
        format!(
            "{} from {before} to {after} (95 % CI of the change {low}..{high} points)",
            j.joint,
        )
    });
    match listed(joints).as_str() {
        "" => String::new(),
        joints => format!("; worse on {joints}"),
    }
}

/// How firm an effect is, in a word, and whether it is written.
pub(super) fn grade(step: &FoundEffect) -> &'static str {
    match (step.status, step.written) {
        _ if step.accepted_by_user => "written because you asked for it",
        (StepStatus::Confirmed, _) => "confirmed",
        (StepStatus::Indicated, Some(_)) => "indicated",
        (StepStatus::Indicated, None) => "indicated, not written",
        (StepStatus::Seen, _) => "nothing",
    }
}

/// How far the parts of the data agree on an effect, and how much of it is written for that.
pub(super) fn agreement(step: &FoundEffect) -> String {
    let of_parts = format!(
        "s = {} by {} parts of the data",
        number::significant(step.shrinkage, 2),
        step.parts.len()
    );
    let measurable = step.estimate.law.entry.measurable;
    match (step.status, step.written) {
        _ if step.accepted_by_user => of_parts,
        (StepStatus::Seen, _) => "the parts of the data do not agree on its size".to_owned(),
        (_, Some(_)) if measurable => format!("{of_parts}, written as estimated"),
        (_, Some(_)) => format!(
            "{of_parts}, written with {} of it",
            number::percent(step.shrinkage)
        ),
        (_, None) if step.vetoed() => format!("{of_parts}; held-out data are worse with it"),
        (_, None) if measurable => {
            format!("{of_parts}; it can be measured, and is written from s = 0.8 on")
        }
        (_, None) => format!("{of_parts}; the model is worse with all that was found"),
    }
}

/// The name of an effect where it was found.
pub(super) fn titled(machine: &LoggedRobot, effect: &Added) -> String {
    let unit = machine.file.torque_unit(effect.place.joint().unwrap_or(0));
    effect.said_and_named(&machine.robot, unit)
}

/// Estimated parameters of an effect in words: `order = 14.0 1/m, ..`.
pub(super) fn in_words(machine: &LoggedRobot, step: &FoundEffect) -> String {
    let words = numbers_of(machine, step).into_iter().map(|t| {
        let (scale, unit) = scaled(t.unit.as_ref(), [t.value]);
        let value = match t.std {
            Some(std) if std > 0.0 => number::plus_minus(scale * t.value, scale * std),
            _ => number::significant(scale * t.value, 4),
        };
        let shown = format!("{} = {value} {unit}", t.key);
        shown.trim_end().to_owned()
    });
    listed(words)
}

/// Names of the effects that these data do not separate from it, and how that can be done.
pub(super) fn alternatives(machine: &LoggedRobot, step: &FoundEffect) -> Option<String> {
    let names = listed(step.alternatives.iter().map(|c| c.title(&machine.robot)));
    let by = step.estimate.law.entry.separate_by;
    (!names.is_empty())
        .then(|| format!("these data do not separate it from {names}; to tell them apart, {by}"))
}
