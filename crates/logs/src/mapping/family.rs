//! Columns whose names differ in a number or in the name of a joint alone, and how they fit the joints.

use std::collections::{BTreeMap, BTreeSet};

use super::column::LogColumn;
use crate::inspect::ChannelRole;
use crate::inspect::words::{NameWord, has, marked, place_of, without_units, words};
use crate::log::nearest;

/// What distinguishes a member of a family from the others.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Key {
    Number(u32),
    Name(String),
}

/// Columns of one kind, one for each joint.
#[derive(Debug, Clone)]
pub(super) struct Family<'a> {
    /// The name that they share, `#` for what differs.
    pub pattern: String,
    pub members: Vec<(Key, &'a LogColumn)>,
    /// How far its words are from a measured quantity of the joint; below 0 where they say `measured`.
    pub penalty: i32,
}

/// How the columns of a family were given to the joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum ColumnAssignment {
    /// Each has the joint's name, or the numbers of all are those of the joints, from 0 or from 1.
    Fits,
    /// As many as joints, in their order: the joints have no numbers.
    InOrder,
    /// Some of them, or more than there are joints.
    InPart,
}

/// Words that say that a quantity is not what a joint's sensor measured, and how much they count.
const PENALTIES: [(&str, i32); 4] = [
    (
        "ext external contact est estimated estimate model predicted sim simulated \
         gravity friction feedforward ff comp computed bias offset error err limit max \
         min temp temperature",
        3,
    ),
    ("se secondary rel relative delta diff voltage volts", 2),
    (
        "raw filt filtered mot motor smooth current currents curr cur amps amp iq u",
        1,
    ),
    ("act actual meas measured feedback fbk follower sensor", -1),
];

pub(super) fn penalty(pattern: &[NameWord], role: ChannelRole) -> i32 {
    let shown = PENALTIES.iter().filter(|(known, _)| has(pattern, known));
    let sum: i32 = shown.map(|(_, count)| *count).sum();
    // `current` beside a position is an adjective
    let adjective = role != ChannelRole::Torque && has(pattern, "current");
    sum - i32::from(adjective)
}

/// The families among columns of one role. A column may be in several.
pub(super) fn families<'a>(columns: &[&'a LogColumn], joints: &[&str]) -> Vec<Family<'a>> {
    let mut found: BTreeMap<String, Vec<(Key, &LogColumn)>> = BTreeMap::new();
    let mut order: Vec<String> = Vec::new();
    let mut add = |pattern: String, key: Key, column: &'a LogColumn| {
        let members = found.entry(pattern.clone()).or_insert_with(|| {
            order.push(pattern);
            Vec::new()
        });
        members.push((key, column));
    };
    for column in columns {
        let name = &column.name;
        if column.by_content {
            // a column without a name: its content gave it a number
            let key = match column.joint.parse() {
                Ok(number) => Key::Number(number),
                Err(_) => Key::Name(column.joint.clone()),
            };
            add("#".to_owned(), key, column);
            continue;
        }
        let spoken = words(name);
        for word in &spoken {
            let Some(number) = word.number() else {
                continue;
            };
            let pattern = marked(name, word.at.clone());
            // `q_1 [rad]` and `q_3 [m]` are of one kind
            let plain = without_units(&pattern);
            if words(&plain).len() != words(&pattern).len() {
                add(plain, Key::Number(number), column);
            }
            add(pattern, Key::Number(number), column);
        }
        // the names of the robot's joints, the longest that is in it
        let named = joints.iter();
        let named = named.filter_map(|joint| Some((*joint, place_of(&spoken, joint)?)));
        let longest = named.max_by_key(|(joint, _)| joint.len());
        if let Some((joint, at)) = longest {
            let pattern = marked(name, at);
            // `J1_pos_deg` and `Z_pos_mm` are of one kind
            let plain = without_units(&pattern);
            if plain != pattern {
                add(plain, Key::Name(joint.to_owned()), column);
            }
            add(pattern, Key::Name(joint.to_owned()), column);
            continue;
        }
        // axes may be called S, L, U or X, Y, Z
        let numbered = |k: usize| spoken.get(k).is_some_and(|word| word.number().is_some());
        for (k, word) in spoken.iter().enumerate() {
            let alone = !numbered(k + 1) && !k.checked_sub(1).is_some_and(numbered);
            let axis = word.text.len() == 1 && word.number().is_none() && k > 0;
            if axis && alone && word.text != column.joint {
                let key = Key::Name(word.text.clone());
                add(marked(name, word.at.clone()), key, column);
            }
        }
        if column.joint.is_empty() {
            add(name.clone(), Key::Name(String::new()), column);
        } else if column.joint.parse::<u32>().is_err()
            && let Some(at) = place_of(&spoken, &column.joint)
        {
            add(marked(name, at), Key::Name(column.joint.clone()), column);
        }
    }
    let family = |pattern: String| {
        let members = found.remove(&pattern)?;
        let keys: BTreeSet<&Key> = members.iter().map(|(key, _)| key).collect();
        let role = members.first()?.1.role;
        // a letter that all names share is no axis
        let letter = matches!(&members[..], [(Key::Name(name), _)] if name.len() == 1);
        let shared = letter && joints.len() != 1;
        (keys.len() == members.len() && !shared).then(|| Family {
            penalty: penalty(&words(&pattern), role),
            pattern,
            members,
        })
    };
    order.into_iter().filter_map(family).collect()
}

/// The numbers of names, one each and no two alike: the last in each, else the first.
fn numbers(names: &[&str]) -> Option<Vec<u32>> {
    let of = |last: bool| -> Option<Vec<u32>> {
        let one = |name: &&str| {
            let spoken = words(name);
            let mut numbers = spoken.iter().filter_map(NameWord::number);
            match last {
                true => numbers.next_back(),
                false => numbers.next(),
            }
        };
        let found = names.iter().map(one).collect::<Option<Vec<u32>>>()?;
        let apart = found.iter().collect::<BTreeSet<_>>().len() == found.len();
        apart.then_some(found)
    };
    of(true).or_else(|| of(false))
}

/// Whether each number is one more than that before it.
fn in_a_row(sorted: &[u32]) -> bool {
    let next = |pair: &[u32]| pair[1].checked_sub(pair[0]) == Some(1);
    sorted.windows(2).all(next)
}

/// The places of `count` joints whose names differ in a number alone, in the order of the numbers, which are in a row.
fn numbered_alike(joints: &[&str], count: usize) -> Option<Vec<usize>> {
    let mut groups: BTreeMap<String, Vec<(u32, usize)>> = BTreeMap::new();
    for (k, joint) in joints.iter().enumerate() {
        for word in words(joint) {
            if let Some(number) = word.number() {
                let pattern = marked(joint, word.at.clone());
                groups.entry(pattern).or_default().push((number, k));
            }
        }
    }
    let mut fitting = groups.into_values().filter_map(|mut group| {
        group.sort_unstable();
        let numbers: Vec<u32> = group.iter().map(|(number, _)| *number).collect();
        let fits = in_a_row(&numbers) && numbers.len() == count;
        fits.then(|| group.iter().map(|(_, k)| *k).collect())
    });
    let found = fitting.next()?;
    fitting.next().is_none().then_some(found)
}

/// A name without the word `joint`.
fn bare(name: &str) -> String {
    let spoken = words(name);
    let left = spoken.iter().filter(|word| word.text != "joint");
    let left: Vec<&str> = left.map(|word| word.text.as_str()).collect();
    match left.is_empty() {
        true => name.to_lowercase(),
        false => left.join("_"),
    }
}

/// The columns of joints from a family, and how they were found.
pub(super) fn fit<'a>(
    family: &Family<'a>,
    joints: &[&str],
) -> Option<(ColumnAssignment, Vec<Option<&'a LogColumn>>)> {
    let by_key = |key: &Key| {
        let found = family.members.iter().find(|(own, _)| own == key);
        found.map(|(_, column)| *column)
    };
    let named = joints.iter().map(|joint| {
        let is = |key: &Key| matches!(key, Key::Name(name) if bare(name) == bare(joint));
        let found = family.members.iter().find(|(key, _)| is(key));
        found.map(|(_, column)| *column)
    });
    let named: Vec<Option<&LogColumn>> = named.collect();
    if named.iter().all(Option::is_some) {
        return Some((ColumnAssignment::Fits, named));
    }
    let keys = family.members.iter();
    let numbered = keys.filter_map(|(key, _)| match key {
        Key::Number(number) => Some(*number),
        Key::Name(_) => None,
    });
    let mut own: Vec<u32> = numbered.collect();
    own.sort_unstable();
    if own.len() == family.members.len() && !own.is_empty() {
        let base = own[0];
        let from_start = in_a_row(&own) && base <= 1;
        let of_joints = numbers(joints);
        let in_order = of_joints.clone().map(|mut of| {
            of.sort_unstable();
            of
        });
        let in_order = in_order.filter(|sorted| in_a_row(sorted));
        let first = in_order.and_then(|sorted| sorted.first().copied());
        let whole = from_start && own.len() == joints.len();
        let of_joint = |at: usize| Some(base + at as u32);
        let (how, numbers): (ColumnAssignment, Vec<Option<u32>>) = match (of_joints, first) {
            // the joints have numbers in a row: the first column is the first joint's
            (Some(of), Some(first)) if whole => (
                ColumnAssignment::Fits,
                of.iter().map(|n| Some(n - first + base)).collect(),
            ),
            (None, _) if whole => {
                let how = match joints.len() {
                    1 => ColumnAssignment::Fits,
                    _ => ColumnAssignment::InOrder,
                };
                (how, (0..joints.len()).map(of_joint).collect())
            }
            // other numbers, or not all: by the same number where the joints have one
            (Some(of), _) if of.iter().all(|n| own.contains(n)) && own.len() == joints.len() => {
                (ColumnAssignment::Fits, of.into_iter().map(Some).collect())
            }
            (Some(of), first) => {
                let first = first.filter(|_| base <= 1);
                let shift = first.map_or(0, |first| i64::from(base) - i64::from(first));
                let shifted = |n: &u32| u32::try_from(i64::from(*n) + shift).ok();
                (ColumnAssignment::InPart, of.iter().map(shifted).collect())
            }
            (None, _) if own.len() >= joints.len() => {
                let numbers = own[..joints.len()].iter().copied();
                (ColumnAssignment::InPart, numbers.map(Some).collect())
            }
            (None, _) => {
                // as many joints as columns have numbers in a row: an arm without its fingers
                let of = numbered_alike(joints, own.len()).filter(|_| from_start)?;
                let place = |k: usize| of.iter().position(|joint| *joint == k);
                let number = |k: usize| place(k).and_then(of_joint);
                (
                    ColumnAssignment::InPart,
                    (0..joints.len()).map(number).collect(),
                )
            }
        };
        let column = |number: Option<u32>| by_key(&Key::Number(number?));
        return Some((how, numbers.into_iter().map(column).collect()));
    }
    // one joint, one column
    if let ([_], [(_, only)]) = (joints, &family.members[..]) {
        return Some((ColumnAssignment::Fits, vec![Some(only)]));
    }
    // a joint's own name first, for the others one that is near and nobody's own
    let own = |column: &LogColumn| {
        let mut own = named.iter().flatten();
        own.any(|taken| taken.name == column.name)
    };
    let names: Vec<&str> = (family.members.iter())
        .filter_map(|(key, column)| match key {
            // one letter is an axis
            Key::Name(name) => Some(name.as_str()).filter(|name| name.len() > 1 && !own(column)),
            Key::Number(_) => None,
        })
        .collect();
    let near = joints.iter().zip(&named).map(|(joint, named)| {
        named.or_else(|| {
            let near = nearest(joint, names.iter().copied())?;
            by_key(&Key::Name(near.to_owned()))
        })
    });
    let near: Vec<Option<&LogColumn>> = near.collect();
    let mut seen = BTreeSet::new();
    let mut columns = near.iter().flatten();
    let twice = columns.any(|column| !seen.insert(&column.name));
    if near.iter().any(Option::is_some) && !twice {
        return Some((ColumnAssignment::InPart, near));
    }
    (family.members.len() == joints.len() && joints.len() > 1).then(|| {
        let all = family.members.iter().map(|(_, column)| Some(*column));
        (ColumnAssignment::InOrder, all.collect())
    })
}

/// A column of temperatures for every joint, where a family of them fits.
pub(super) fn temperatures(columns: &[LogColumn], joints: &[&str]) -> Option<Vec<String>> {
    let warm = "temp temps temperature temperatures";
    let said = |c: &&LogColumn| !c.commanded && has(&words(&c.name), warm);
    let of: Vec<&LogColumn> = columns.iter().filter(said).collect();
    let mut found = families(&of, joints);
    found.sort_by_key(|family| family.penalty);
    let fitting = found.iter().filter_map(|family| fit(family, joints));
    let mut whole = fitting.filter(|(how, _)| *how != ColumnAssignment::InPart);
    let (_, columns) = whole.next()?;
    let name = |column: Option<&LogColumn>| Some(column?.name.clone());
    columns.into_iter().map(name).collect()
}
