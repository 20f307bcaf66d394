//! Words that several reports and figures share.

use std::borrow::Borrow;

use cft_ident_core::number;
use cft_ident_core::verdict::TorqueOff;
use cft_ident_logs::log::escape;

/// Words in a row, with commas between them.
pub(super) fn listed<S: Borrow<str>>(words: impl IntoIterator<Item = S>) -> String {
    let words: Vec<S> = words.into_iter().collect();
    words.join(", ")
}

/// Names of logs as a report may show them.
pub(super) fn escaped(names: &[String]) -> String {
    listed(names.iter().map(|name| escape(name)))
}

/// How far the torques of joints are off: `q1 by 2.4 Nm, q2 by 0.90 Nm`.
pub fn torques_off(off: &[TorqueOff]) -> String {
    listed(off.iter().map(|of| {
        let size = number::significant(of.off, 2);
        format!("{} by {size} {}", escape(&of.joint), of.unit)
    }))
}

/// Name of a parameter, with its joint.
pub(super) fn of_joint(name: &str, joint: Option<&str>) -> String {
    match joint {
        Some(joint) => format!("{} of {}", escape(name), escape(joint)),
        None => escape(name),
    }
}

/// The first few of many names.
pub(super) fn first_of(names: &[String]) -> String {
    const MAX_NAMES: usize = 3;
    match names.len().checked_sub(MAX_NAMES) {
        Some(more @ 1..) => format!("{} and {more} more", names[..MAX_NAMES].join(", ")),
        _ => names.join(", "),
    }
}

/// A number that may not be known.
pub(super) fn significant(value: Option<f64>, digits: usize) -> String {
    number::significant(value.unwrap_or(f64::NAN), digits)
}

/// A fraction that may not be known, as percent.
pub(super) fn percent(fraction: Option<f64>) -> String {
    number::percent(fraction.unwrap_or(f64::NAN))
}

/// A condition number; none where it has no bound.
pub(super) fn condition(condition: Option<f64>) -> String {
    condition.map_or("infinite".to_owned(), |c| number::significant(c, 4))
}

/// The coefficient of determination.
pub(super) fn r2(r2: f64) -> String {
    match r2.is_finite() {
        true => format!("{r2:.5}"),
        false => number::ABSENT.to_owned(),
    }
}

/// Factor and unit with which values are shown: millimetres where all are small lengths.
pub(super) fn scaled(unit: &str, values: impl IntoIterator<Item = f64>) -> (f64, &str) {
    let small = |value: f64| value.abs() < number::MILLIMETRES;
    match unit == "m" && values.into_iter().all(small) {
        true => (1e3, "mm"),
        false => (1.0, unit),
    }
}

/// The name of a quantity with this unit, N or Nm.
pub(super) fn torque_or_force(unit: &str) -> &'static str {
    if unit == "N" { "force" } else { "torque" }
}
