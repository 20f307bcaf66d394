//! One effect that was found, in words.

use crate::report::words::{listed, scaled};
use cft_ident_core::diagnose::{FoundEffect, NotWritten, StepStatus};
use cft_ident_core::effect::ModelEffect;
use cft_ident_core::number;
use cft_ident_stages::identify::{RobotSetup, accept_option, numbers_of};

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

/// How firm an effect is, in a word.
pub(super) fn grade(step: &FoundEffect) -> &'static str {
    match step.status {
        _ if step.accepted_by_user => "written because you asked for it",
        StepStatus::Confirmed => "confirmed",
        StepStatus::Indicated => "indicated",
        StepStatus::Seen => "seen, not written",
    }
}

/// How sure an effect is, and how much of it is written for that.
pub(super) fn certainty(step: &FoundEffect) -> String {
    let by = format!(
        "{} standard deviations by {:.0} blocks",
        number::significant(step.deviations, 2),
        step.blocks
    );
    let measurable = step.estimate.law.entry.measurable;
    match step.left {
        _ if step.accepted_by_user => by,
        None if measurable => format!("{by}, written as estimated"),
        None => format!(
            "{by}, written with {} of it",
            number::percent(step.shrinkage)
        ),
        Some(NotWritten::HeldOut) => format!("{by}; held-out data are worse with it"),
        Some(NotWritten::Bound) => "at a bound beside the other effects".to_owned(),
        Some(NotWritten::Small) => format!("{by}; it changes no error noticeably"),
        Some(NotWritten::Unsure) if measurable && step.shrinkage > 0.0 => {
            format!("{by}; it can be measured, and is written from 11 on")
        }
        Some(NotWritten::Unsure) => format!("{by}; it is written from 5 on"),
    }
}

/// The torque that an effect makes, root mean square, with its 95 % CI.
pub(super) fn torque(setup: &RobotSetup, effect: &ModelEffect, [torque, std]: [f64; 2]) -> String {
    let unit = setup.torque_unit_at(effect.place);
    format!("{} {unit}", number::plus_minus(torque, 1.96 * std))
}

/// An effect that is not written, in a line: its torque, what it would gain, and what writes it.
pub(super) fn seen(setup: &RobotSetup, step: &FoundEffect) -> Option<String> {
    let option = accept_option(&step.estimate, &setup.robot);
    (step.status == StepStatus::Seen && !step.accepted_by_user).then(|| {
        format!(
            "seen: {} {}, {} of the squared error; `{option}`",
            step.estimate.title(&setup.robot),
            torque(setup, &step.estimate, step.torque),
            number::percent(step.share.max(0.0)),
        )
    })
}

/// The name of an effect where it was found.
pub(super) fn titled(setup: &RobotSetup, effect: &ModelEffect) -> String {
    let unit = setup.torque_unit_at(effect.place);
    effect.said_and_named(&setup.robot, unit)
}

/// Estimated parameters of an effect in words: `order = 14.0 1/m, ..`.
pub(super) fn in_words(setup: &RobotSetup, step: &FoundEffect) -> String {
    let words = numbers_of(setup, step).into_iter().map(|t| {
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
pub(super) fn alternatives(setup: &RobotSetup, step: &FoundEffect) -> Option<String> {
    let names = listed(step.alternatives.iter().map(|c| c.title(&setup.robot)));
    let by = step.estimate.law.entry.separate_by;
    (!names.is_empty())
        .then(|| format!("these data do not separate it from {names}; to tell them apart, {by}"))
}
