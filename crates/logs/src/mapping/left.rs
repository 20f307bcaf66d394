//! Families of columns whose names do not say what they hold, and which of them may be what a robot lacks.

use super::column::LogColumn;
use super::family::{Family, How, families, fit};
use super::fitting::Taken;

/// Families that are offered at most.
const OFFERED: usize = 6;

/// Families of as many columns as joints whose names say nothing.
fn unsaid<'a>(
    columns: &'a [LogColumn],
    joints: usize,
    may_be: &dyn Fn(&LogColumn) -> bool,
) -> Vec<Family<'a>> {
    let unsaid = |c: &&LogColumn| c.is_unsaid() && may_be(c);
    let unsaid: Vec<&LogColumn> = columns.iter().filter(unsaid).collect();
    let mut found = families(&unsaid, &[]);
    found.retain(|family| family.members.len() == joints);
    found
}

/// Their names, for the user to choose from.
pub(super) fn offered(columns: &[LogColumn], joints: usize) -> Vec<String> {
    let found = unsaid(columns, joints, &|_| true).into_iter();
    found.take(OFFERED).map(|family| family.pattern).collect()
}

/// The only one whose columns change, where there are several joints: what they lack, if they lack one kind alone.
pub(super) fn left<'a>(columns: &'a [LogColumn], joints: &[&str]) -> Option<Taken<'a>> {
    let mut found = unsaid(columns, joints.len(), &|column| column.span() > 0.0);
    found.sort_by_key(|family| std::cmp::Reverse(family.pattern.len()));
    let (only, others) = found.split_first().filter(|_| joints.len() > 1)?;
    let of_only = |column: &LogColumn| only.members.iter().any(|(_, own)| own.name == column.name);
    // another reading of the same columns is no other family
    let same = |other: &Family| other.members.iter().all(|(_, column)| of_only(column));
    let (_, columns) = fit(only, joints).filter(|_| others.iter().all(same))?;
    // what is said of it says the order too
    Some(Taken::new(only.pattern.clone(), How::Fits, columns))
}
