//! Which families of columns fit the joints of a robot, by their names.

use super::column::LogColumn;
use super::family::{How, families, fit, penalty};
use crate::inspect::ChannelRole;
use crate::inspect::words::{Word, without_joint, words};

/// A family that was taken.
pub(super) struct Taken<'a> {
    pub(super) pattern: String,
    pub(super) how: How,
    pub(super) columns: Vec<Option<&'a LogColumn>>,
    /// Others that fit, best first, and whether the first of them is as good.
    pub(super) others: Vec<String>,
    pub(super) tie: bool,
}

/// Words that two patterns share.
pub(super) fn shared_words(a: &str, b: &str) -> i32 {
    let b = words(b);
    let shared = words(a)
        .into_iter()
        .filter(|word| b.iter().any(|other| other.text == word.text));
    i32::try_from(shared.count()).unwrap_or(0)
}

/// A family that fits, and how well: less is better.
pub(super) struct Fitting<'a> {
    pub(super) rank: (i32, i32),
    pub(super) pattern: String,
    pub(super) how: How,
    pub(super) columns: Vec<Option<&'a LogColumn>>,
}

/// For every joint the column that has its name, whatever else the names say: a joint that slides has a force where
/// others have torques.
pub(super) fn by_names<'a>(columns: &[&'a LogColumn], joints: &[&str]) -> Option<Fitting<'a>> {
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
    let names: Vec<&str> = columns.iter().flatten().map(|c| c.name.as_str()).collect();
    let apart = names
        .iter()
        .collect::<std::collections::BTreeSet<_>>()
        .len()
        == names.len();
    (apart && joints.len() > 1).then(|| Fitting {
        rank: (worst, i32::MAX),
        pattern: names.join(", "),
        how: How::Fits,
        columns,
    })
}

/// The names of joints without the words that all of them begin with: `left/upper` is `upper`.
pub(super) fn without_common_head(joints: &[&str]) -> Vec<String> {
    let all: Vec<Vec<Word>> = joints.iter().map(|joint| words(joint)).collect();
    let common = |k: usize| {
        let first = all.first().and_then(|spoken| spoken.get(k));
        let same = |spoken: &Vec<Word>| {
            spoken.len() > k + 1 && first.is_some_and(|first| spoken[k].text == first.text)
        };
        all.iter().all(same)
    };
    let head = (0..).take_while(|k| joints.len() > 1 && common(*k)).count();
    let short = |(joint, spoken): (&&str, &Vec<Word>)| {
        let from = spoken.get(head).map_or(0, |word| word.at.start);
        joint[from..].to_owned()
    };
    // numbers alone are no names
    let named = |spoken: &Vec<Word>| spoken[head..].iter().any(|word| word.number().is_none());
    match all.iter().all(named) {
        true => joints.iter().zip(&all).map(short).collect(),
        false => joints.iter().map(|joint| (*joint).to_owned()).collect(),
    }
}

/// The family of a role that fits the joints best, by their names, else by what is left of those without the words
/// that all begin with.
pub(super) fn best<'a>(
    columns: &'a [LogColumn],
    role: ChannelRole,
    commanded: bool,
    joints: &[&str],
    beside: Option<&str>,
) -> Option<Taken<'a>> {
    let whole = best_by(columns, role, commanded, joints, beside);
    let short = without_common_head(joints);
    let short: Vec<&str> = short.iter().map(String::as_str).collect();
    if whole.as_ref().is_some_and(|taken| taken.how == How::Fits) || short == joints {
        return whole;
    }
    let by_short = best_by(columns, role, commanded, &short, beside);
    by_short.filter(|taken| taken.how == How::Fits).or(whole)
}

pub(super) fn best_by<'a>(
    columns: &'a [LogColumn],
    role: ChannelRole,
    commanded: bool,
    joints: &[&str],
    beside: Option<&str>,
) -> Option<Taken<'a>> {
    let of_role = |c: &&LogColumn| c.role == role && c.commanded == commanded;
    let of_role: Vec<&LogColumn> = columns.iter().filter(of_role).collect();
    let mut found: Vec<Fitting> = Vec::new();
    for family in families(&of_role, joints) {
        if let Some((how, columns)) = fit(&family, joints)
            && columns.iter().any(Option::is_some)
        {
            let off = match how {
                How::Fits => 0,
                How::InOrder => 1,
                How::InPart => 6,
            };
            let missing = columns.iter().filter(|c| c.is_none()).count() as i32;
            let near = beside.map_or(0, |beside| shared_words(&family.pattern, beside));
            found.push(Fitting {
                rank: (off + family.penalty + missing, -near),
                pattern: family.pattern,
                how,
                columns,
            });
        }
    }
    if let Some(named) = by_names(&of_role, joints) {
        found.push(named);
    }
    // the first of equals
    found.sort_by_key(|fitting| fitting.rank);
    let mut found = found.into_iter();
    let Fitting {
        rank,
        pattern,
        how,
        columns: given,
    } = found.next()?;
    let taken: Vec<&str> = given.iter().flatten().map(|c| c.name.as_str()).collect();
    let (mut others, mut tie) = (Vec::new(), false);
    let mut shown: Vec<Vec<&str>> = Vec::new();
    for other in found {
        // another reading of the same columns is no other family
        let same = |c: &&LogColumn| taken.contains(&c.name.as_str());
        let mut known = |columns: &[Option<&'a LogColumn>]| {
            let names: Vec<&str> = columns.iter().flatten().map(|c| c.name.as_str()).collect();
            let known = shown.contains(&names);
            shown.push(names);
            known
        };
        if other.columns.iter().flatten().all(same)
            || other.how == How::InPart
            || known(&other.columns)
            || others.contains(&other.pattern)
        {
            continue;
        }
        tie |= others.is_empty() && other.rank == rank;
        others.push(other.pattern);
    }
    Some(Taken {
        pattern,
        how,
        columns: given,
        others,
        tie,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(names: &[&str]) -> Vec<LogColumn> {
        names.iter().map(|name| LogColumn::named(name)).collect()
    }

    fn matched(joints: &[&str], names: &[&str]) -> (Vec<Option<String>>, Option<How>) {
        let columns = columns(names);
        let found = best(&columns, ChannelRole::Position, false, joints, None);
        match found {
            None => (vec![None; joints.len()], None),
            Some(taken) => {
                let names = taken.columns.iter().map(|c| c.map(|c| c.name.clone()));
                (names.collect(), Some(taken.how))
            }
        }
    }

    fn some(names: &[&str]) -> Vec<Option<String>> {
        names.iter().map(|n| Some((*n).to_owned())).collect()
    }

    #[test]
    fn columns_go_by_name_before_number_and_by_number_before_order() {
        let (found, how) = matched(&["elbow", "wrist"], &["q_wrist", "q_elbow"]);
        assert_eq!(
            (found, how),
            (some(&["q_elbow", "q_wrist"]), Some(How::Fits))
        );
        let (found, how) = matched(&["joint_2", "joint_1"], &["q1", "q2"]);
        assert_eq!((found, how), (some(&["q2", "q1"]), Some(How::Fits)));
        let (found, how) = matched(&["joint_1", "joint_2"], &["q0", "q1"]);
        assert_eq!((found, how), (some(&["q0", "q1"]), Some(How::Fits)));
        let (found, how) = matched(&["pan", "lift"], &["q1", "q2"]);
        assert_eq!((found, how), (some(&["q1", "q2"]), Some(How::InOrder)));
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
            (&[None, None, None][..], Some(How::InPart))
        );
        // one too many may begin anywhere
        let (found, how) = matched(&["joint_1", "joint_2"], &["q0", "q1", "q2"]);
        assert_eq!(found.len(), 2);
        assert_eq!(how, Some(How::InPart));
    }
}
