//! Which families of columns fit the joints of a robot, by their names, and which may where names say nothing.

use std::collections::BTreeSet;

use super::column::LogColumn;
use super::family::{ColumnAssignment, Family, families, fit, penalty};
use crate::inspect::ChannelRole;
use crate::inspect::words::{NameWord, without_joint, words};

/// A family that fits, and how well: a lower rank is better.
pub(super) struct FamilyMatch<'a> {
    pub(super) rank: (i32, i32),
    pub(super) pattern: String,
    pub(super) how: ColumnAssignment,
    pub(super) columns: Vec<Option<&'a LogColumn>>,
    /// Others that fit, best first, and whether the first of them is as good.
    pub(super) others: Vec<String>,
    pub(super) tie: bool,
}

impl<'a> FamilyMatch<'a> {
    /// The only one so far.
    pub(super) fn new(
        pattern: String,
        how: ColumnAssignment,
        columns: Vec<Option<&'a LogColumn>>,
    ) -> Self {
        Self {
            rank: (0, 0),
            pattern,
            how,
            columns,
            others: Vec::new(),
            tie: false,
        }
    }

    fn names(&self) -> Vec<&'a str> {
        let columns = self.columns.iter().flatten();
        columns.map(|column| column.name.as_str()).collect()
    }
}

/// Words that two patterns share.
fn shared_words(a: &str, b: &str) -> i32 {
    let b = words(b);
    let shared = words(a)
        .into_iter()
        .filter(|word| b.iter().any(|other| other.text == word.text));
    i32::try_from(shared.count()).unwrap_or(0)
}

/// For every joint the column that has its name, whatever else it says: what slides has a force, others have torques.
fn by_names<'a>(columns: &[&'a LogColumn], joints: &[&str]) -> Option<FamilyMatch<'a>> {
    let mut worst = 0;
    let mut own = |joint: &&str| {
        let has = |column: &&LogColumn| {
            let longer = |other: &&str| {
                other.len() > joint.len() && without_joint(&column.name, other) != column.name
            };
            without_joint(&column.name, joint) != column.name && !joints.iter().any(longer)
        };
        let of = columns.iter().copied().filter(has);
        let with = of.map(|column| {
            let bare = without_joint(&column.name, joint);
            (penalty(&words(&bare), column.role), column)
        });
        let mut all: Vec<(i32, &LogColumn)> = with.collect();
        all.sort_by_key(|(penalty, _)| *penalty);
        let (first, column) = *all.first()?;
        // two that are as good are no answer
        let sure = all.get(1).is_none_or(|(second, _)| *second > first);
        worst = worst.max(first);
        sure.then_some(Some(column))
    };
    let columns = joints.iter().map(&mut own).collect::<Option<Vec<_>>>()?;
    let mut taken = FamilyMatch::new(String::new(), ColumnAssignment::Fits, columns);
    let names = taken.names();
    let apart = names.iter().collect::<BTreeSet<_>>().len() == names.len();
    (taken.rank, taken.pattern) = ((worst, i32::MAX), names.join(", "));
    (apart && joints.len() > 1).then_some(taken)
}

/// The names of joints without the words that all of them begin with: `left/upper` is `upper`.
pub(super) fn without_common_head(joints: &[&str]) -> Vec<String> {
    let all: Vec<Vec<NameWord>> = joints.iter().map(|joint| words(joint)).collect();
    let common = |k: usize| {
        let first = all.first().and_then(|spoken| spoken.get(k));
        let same = |spoken: &Vec<NameWord>| {
            spoken.len() > k + 1 && first.is_some_and(|first| spoken[k].text == first.text)
        };
        all.iter().all(same)
    };
    let head = (0..).take_while(|k| joints.len() > 1 && common(*k)).count();
    let short = |(joint, spoken): (&&str, &Vec<NameWord>)| {
        let from = spoken.get(head).map_or(0, |word| word.at.start);
        joint[from..].to_owned()
    };
    // numbers alone are no names
    let named = |spoken: &Vec<NameWord>| spoken[head..].iter().any(|word| word.number().is_none());
    match all.iter().all(named) {
        true => joints.iter().zip(&all).map(short).collect(),
        false => joints.iter().map(|joint| (*joint).to_owned()).collect(),
    }
}

/// The family of a role that fits the joints best, by their names, else by these without the words that all begin with.
pub(super) fn best<'a>(
    columns: &'a [LogColumn],
    role: ChannelRole,
    commanded: bool,
    joints: &[&str],
    beside: Option<&str>,
) -> Option<FamilyMatch<'a>> {
    let whole = best_by(columns, role, commanded, joints, beside);
    let short = without_common_head(joints);
    let short: Vec<&str> = short.iter().map(String::as_str).collect();
    if whole
        .as_ref()
        .is_some_and(|taken| taken.how == ColumnAssignment::Fits)
        || short == joints
    {
        return whole;
    }
    let by_short = best_by(columns, role, commanded, &short, beside);
    by_short
        .filter(|taken| taken.how == ColumnAssignment::Fits)
        .or(whole)
}

fn best_by<'a>(
    columns: &'a [LogColumn],
    role: ChannelRole,
    commanded: bool,
    joints: &[&str],
    beside: Option<&str>,
) -> Option<FamilyMatch<'a>> {
    let of_role = |c: &&LogColumn| c.role == role && c.commanded == commanded && !c.external;
    let of_role: Vec<&LogColumn> = columns.iter().filter(of_role).collect();
    let mut found: Vec<FamilyMatch> = Vec::new();
    for family in families(&of_role, joints) {
        if let Some((how, columns)) = fit(&family, joints)
            && columns.iter().any(Option::is_some)
        {
            let off = match how {
                ColumnAssignment::Fits => 0,
                ColumnAssignment::InOrder => 1,
                ColumnAssignment::InPart => 6,
            };
            let missing = columns.iter().filter(|c| c.is_none()).count() as i32;
            let near = beside.map_or(0, |beside| shared_words(&family.pattern, beside));
            found.push(FamilyMatch {
                rank: (off + family.penalty + missing, -near),
                ..FamilyMatch::new(family.pattern, how, columns)
            });
        }
    }
    found.extend(by_names(&of_role, joints));
    // the first of equals
    found.sort_by_key(|fitting| fitting.rank);
    let mut found = found.into_iter();
    let mut taken = found.next()?;
    let mut shown: Vec<Vec<&str>> = Vec::new();
    for other in found {
        let names = other.names();
        // another reading of the same columns is no other family
        let same = names.iter().all(|name| taken.names().contains(name));
        if same || other.how == ColumnAssignment::InPart {
            continue;
        }
        let known = shown.contains(&names);
        shown.push(names);
        if !known && !taken.others.contains(&other.pattern) {
            taken.tie |= taken.others.is_empty() && other.rank == taken.rank;
            taken.others.push(other.pattern);
        }
    }
    Some(taken)
}

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

/// Families of torques that are estimates of what acts from outside.
pub(super) fn external(columns: &[LogColumn], joints: &[&str]) -> Vec<String> {
    let of: Vec<&LogColumn> = columns.iter().filter(|c| c.external).collect();
    let found = families(&of, joints).into_iter();
    let mut found: Vec<String> = found
        .filter(|family| family.members.len() >= joints.len())
        .map(|family| family.pattern)
        .collect();
    found.truncate(OFFERED);
    found
}

/// The only one whose columns change, where there are several joints: what they lack, if they lack one kind alone.
/// What was commanded is no measurement of it.
pub(super) fn left<'a>(columns: &'a [LogColumn], joints: &[&str]) -> Option<FamilyMatch<'a>> {
    let may_be = |column: &LogColumn| column.span() > 0.0 && !column.commanded;
    let mut found = unsaid(columns, joints.len(), &may_be);
    found.sort_by_key(|family| std::cmp::Reverse(family.pattern.len()));
    let (only, others) = found.split_first().filter(|_| joints.len() > 1)?;
    let of_only = |column: &LogColumn| only.members.iter().any(|(_, own)| own.name == column.name);
    // another reading of the same columns is no other family
    let same = |other: &Family| other.members.iter().all(|(_, column)| of_only(column));
    let (_, columns) = fit(only, joints).filter(|_| others.iter().all(same))?;
    // what is said of it says the order too
    Some(FamilyMatch::new(
        only.pattern.clone(),
        ColumnAssignment::Fits,
        columns,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(names: &[&str]) -> Vec<LogColumn> {
        names.iter().map(|name| LogColumn::named(name)).collect()
    }

    fn matched(joints: &[&str], names: &[&str]) -> (Vec<Option<String>>, Option<ColumnAssignment>) {
        let columns = columns(names);
        let Some(taken) = best(&columns, ChannelRole::Position, false, joints, None) else {
            return (vec![None; joints.len()], None);
        };
        let names = taken.columns.iter().map(|c| c.map(|c| c.name.clone()));
        (names.collect(), Some(taken.how))
    }

    fn some(names: &[&str]) -> Vec<Option<String>> {
        names.iter().map(|n| Some((*n).to_owned())).collect()
    }

    #[test]
    fn columns_go_by_name_before_number_and_by_number_before_order() {
        let numbered = ["joint_1", "joint_2"];
        for (joints, columns, expected, how) in [
            (
                ["elbow", "wrist"],
                ["q_wrist", "q_elbow"],
                ["q_elbow", "q_wrist"],
                ColumnAssignment::Fits,
            ),
            (
                ["joint_2", "joint_1"],
                ["q1", "q2"],
                ["q2", "q1"],
                ColumnAssignment::Fits,
            ),
            (numbered, ["q0", "q1"], ["q0", "q1"], ColumnAssignment::Fits),
            (
                ["pan", "lift"],
                ["q1", "q2"],
                ["q1", "q2"],
                ColumnAssignment::InOrder,
            ),
        ] {
            assert_eq!(matched(&joints, &columns), (some(&expected), Some(how)));
        }
        // one column too few is no order
        let (found, _) = matched(&["pan", "lift"], &["q1"]);
        assert_eq!(found, [None, None]);
        // an arm without its fingers
        let hand = [
            "arm_joint1",
            "arm_joint2",
            "finger_joint1",
            "finger_joint2",
            "finger_joint3",
        ];
        let (found, how) = matched(&hand, &["q1", "q2"]);
        assert_eq!(found[..2], some(&["q1", "q2"]));
        assert_eq!(
            (&found[2..], how),
            (&[const { None }; 3][..], Some(ColumnAssignment::InPart))
        );
        // a torso beside the numbered joints of an arm, and wheels that the log has not
        let torso = ["wheel", "lift", "arm_1", "arm_2"];
        let (found, how) = matched(
            &torso,
            &["lift_position", "arm_1_position", "arm_2_position"],
        );
        assert_eq!(found[0], None);
        assert_eq!(
            found[1..],
            some(&["lift_position", "arm_1_position", "arm_2_position"])
        );
        assert_eq!(how, Some(ColumnAssignment::InPart));
        // one too many may begin anywhere
        let (found, how) = matched(&numbered, &["q0", "q1", "q2"]);
        assert_eq!(found.len(), 2);
        assert_eq!(how, Some(ColumnAssignment::InPart));
    }
}
