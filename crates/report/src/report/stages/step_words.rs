//! What is said of one effect that was added.

use cft_ident_core::diagnose::{AcceptedEffect, Diagnosis, PLACEBOS, StepStatus};
use cft_ident_core::effect::Added;
use cft_ident_core::number;
use cft_ident_stages::identify::{Diagnosed, LoggedRobot};

/// The joints that a step makes noticeably worse on held-out data, with the change of their errors; nothing where there
/// is none.
pub(super) fn worsened(step: &AcceptedEffect) -> String {
    let joints = (step.joints.iter())
        .filter(|j| j.noticeably_worse())
        .map(|j| {
            let [low, high] = j.interval_95.map(|x| format!("{:+.2}", 100.0 * x));
            let [before, after] = [j.before, j.after].map(number::percent);
            format!(
                "{} from {before} to {after} (95 % CI of the change {low}..{high} points)",
                j.joint,
            )
        });
    let joints: Vec<String> = joints.collect();
    match joints.is_empty() {
        true if step.worse_over_joints() => ": worse".to_owned(),
        true => String::new(),
        false => format!("; worse on {}", joints.join(", ")),
    }
}

/// Why the name of a step's effect is tentative; none where it is not.
pub(super) fn tentative(d: &Diagnosis, step: &AcceptedEffect) -> Option<String> {
    if d.status(step) != StepStatus::Tentative {
        return None;
    }
    let mut why = Vec::new();
    if !step.alternatives.is_empty() {
        why.push("these data do not separate it from others");
    }
    if step.joints.is_empty() {
        why.push("there are no held-out data");
    } else if !step.confirmed() {
        why.push("held-out data do not confirm it");
    }
    if !d.assured() {
        why.push("the remaining residual is more than noise");
    }
    Some(why.join("; "))
}

/// What an effect is called where it was found.
pub(super) fn titled(machine: &LoggedRobot, effect: &Added) -> String {
    let unit = machine.file.torque_unit(effect.place.joint().unwrap_or(0));
    effect.said_and_named(&machine.robot, unit)
}

/// A p-value by placebos in words: the least that they can show is an upper bound.
pub(super) fn chance(p: f64) -> String {
    let least = 1.0 / (1 + PLACEBOS) as f64;
    match p <= least * (1.0 + 1e-9) {
        true => format!("p <= {least:.3}, the least that {PLACEBOS} placebos can show"),
        false => format!("p = {p:.3}"),
    }
}

/// Parameters of an accepted effect in words: `order = 14.0 +- 0.1 1/m, ..`.
pub(super) fn in_words(machine: &LoggedRobot, found: &Diagnosed, effect: usize) -> String {
    let words = found.told(machine, effect).into_iter().map(|t| {
        let (scale, unit) = match t.unit == "m" && t.value.abs() < number::MILLIMETRES {
            true => (1e3, "mm"),
            false => (1.0, t.unit.as_ref()),
        };
        let value = match t.std {
            Some(std) if std > 0.0 => number::plus_minus(scale * t.value, scale * std),
            _ => number::significant(scale * t.value, 4),
        };
        let told = format!("{} = {value} {unit}", t.key);
        match t.bound {
            true => format!("{} (held at a bound)", told.trim_end()),
            false => told.trim_end().to_owned(),
        }
    });
    words.collect::<Vec<_>>().join(", ")
}
