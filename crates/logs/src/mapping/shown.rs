//! The joints of a robot: those of a URDF, or those that a log shows.

use super::column::LogColumn;
use super::family::{Family, Key, families};
use super::units::{stated_position, stated_torque};
use super::urdf_joint::UrdfJoint;
use crate::inspect::ChannelRole;
use crate::inspect::words::{joint, slides, words};
use crate::log::{POSITIONS, TORQUES, UnitKind, stated_unit};
use cft_ident_core::robot::JointKind;

/// The joints of the family of positions that has torques beside it and is likeliest measured, else of the largest.
pub(super) fn shown(columns: &[LogColumn]) -> Vec<UrdfJoint> {
    let one = |name: &str, kind| UrdfJoint {
        name: name.to_owned(),
        kind,
        torque: None,
        position: None,
    };
    let of = |role: ChannelRole| -> Vec<&LogColumn> {
        let of_role = |c: &&LogColumn| c.role == role && !c.commanded;
        columns.iter().filter(of_role).collect()
    };
    let (positions, torques) = (of(ChannelRole::Position), of(ChannelRole::Torque));
    let torques = families(&torques, &[]);
    let keys = |family: &Family| -> Vec<Key> {
        let mut keys: Vec<Key> = family.members.iter().map(|(key, _)| key.clone()).collect();
        keys.sort();
        keys
    };
    let rank = |family: &Family| {
        let own = keys(family);
        let partners = || torques.iter().filter(|other| keys(other) == own);
        let partner = partners().next().is_some();
        let contract = family.pattern == "q_#" && partners().any(|other| other.pattern == "tau_#");
        let size = family.members.len() as i32;
        (!contract, !partner, family.penalty - size)
    };
    let found = families(&positions, &[]);
    let Some(best) = found.iter().min_by_key(|family| rank(family)) else {
        return vec![one("q1", JointKind::Revolute)];
    };
    let heads = best.members.iter().map(|(key, _)| match key {
        Key::Name(name) => words(name).into_iter().map(|w| w.text).collect(),
        Key::Number(_) => Vec::new(),
    });
    let heads: Vec<Vec<String>> = heads.collect();
    // `joint_states.elbow` is the elbow: words that all names begin with are none of the joints'
    let same = |head: &Vec<String>, k: usize| head.len() > k + 1 && head[k] == heads[0][k];
    let common = |k: usize| heads.iter().all(|head| same(head, k));
    // `q_<joint>` of the contract has the joint's whole name
    let named = |(_, column): &(Key, &LogColumn)| own_name(&column.name).is_some();
    let whole = best.pattern == "q_#" && best.members.iter().all(named);
    let begins = match whole || heads.len() < 2 {
        true => 0,
        false => (0..).take_while(|k| common(*k)).count(),
    };
    let mut members: Vec<&(Key, &LogColumn)> = best.members.iter().collect();
    if members.iter().all(|(key, _)| matches!(key, Key::Number(_))) {
        members.sort_by(|a, b| a.0.cmp(&b.0));
    }
    let of_member = |(key, column): &&(Key, &LogColumn)| {
        let name = match key {
            // of `q_fer_joint1` the joint is what the contract says, where all of it names a joint
            Key::Number(number) => {
                own_name(&column.name).map_or_else(|| format!("q{number}"), joint_name)
            }
            Key::Name(name) if begins == 0 => joint_name(name),
            Key::Name(name) => {
                let left = words(name).into_iter().skip(begins).map(|w| w.text);
                joint_name(&left.collect::<Vec<_>>().join("_"))
            }
        };
        let torque = torques.iter().find_map(|family| {
            let own = family.members.iter().find(|(other, _)| other == key);
            own.map(|(_, column)| *column)
        });
        one(&name, kind_of(column, torque))
    };
    members.iter().map(of_member).collect()
}

/// The joint of a column `q_<joint>`, where every word of it is of a name and one is no number.
fn own_name(column: &str) -> Option<&str> {
    let rest = column.strip_prefix("q_")?;
    let spoken = words(rest);
    let whole = joint(&spoken).split('_').count() == spoken.len();
    let named = spoken.iter().any(|word| word.number().is_none());
    (whole && named).then_some(rest)
}

/// Metres slide, and so does what a force moves; everything else turns.
fn kind_of(position: &LogColumn, torque: Option<&LogColumn>) -> JointKind {
    let force = torque.and_then(stated_torque);
    let pushed = torque.is_some_and(|torque| slides(&words(&torque.name)));
    // the joint of `q_base_turn` is not in turns
    let mut position = position.clone();
    if own_name(&position.name).is_some() {
        position.name = "q_#".to_owned();
    }
    let of = |unit: Option<&str>, all: &[UnitKind]| Some(stated_unit(unit?, all)?.unit.of);
    let slid = match (
        of(stated_position(&position), &POSITIONS),
        of(force, &TORQUES),
    ) {
        (Some(UnitKind::Length), _) => true,
        (Some(_), _) => false,
        (None, Some(UnitKind::Force)) => true,
        (None, Some(UnitKind::Moment)) => false,
        _ => pushed || slides(&words(&position.name)),
    };
    match slid {
        true => JointKind::Prismatic,
        false => JointKind::Revolute,
    }
}

/// A joint's name as a robot file may hold it: a number alone is `q1`.
fn joint_name(joint: &str) -> String {
    let plain = |c: char| match c.is_alphanumeric() || "_-.".contains(c) {
        true => c,
        false => '_',
    };
    let kept: String = joint.chars().map(plain).take(48).collect();
    match kept.chars().next() {
        None => "q1".to_owned(),
        Some(c) if c.is_ascii_digit() => format!("q{kept}"),
        Some(_) => kept,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(all: &[&str]) -> Vec<String> {
        let columns: Vec<LogColumn> = all.iter().map(|name| LogColumn::named(name)).collect();
        shown(&columns).into_iter().map(|k| k.name).collect()
    }

    #[test]
    fn a_log_of_both_sides_of_the_gears_has_the_joints_that_have_torques() {
        let both = ["x_c1", "x_c2", "q_a", "q_b", "u_1", "u_2", "tau_a", "tau_b"];
        assert_eq!(names(&both), ["a", "b"]);
        // torques of the other side alone: the joints are of that side
        assert_eq!(names(&both[..6]), ["q1", "q2"]);
    }

    #[test]
    fn joints_without_a_urdf_have_the_names_and_numbers_of_the_columns() {
        for (columns, joints) in [
            ("positions_0 positions_1", "q0 q1"),
            ("joint_2_position joint_1_position", "q1 q2"),
            (
                "joint_states.pan.position joint_states.lift.position",
                "pan lift",
            ),
            ("t Position Iq", "q1"),
            (
                "q_fer_joint1 q_fer_joint2 tau_fer_joint1 tau_fer_joint2",
                "fer_joint1 fer_joint2",
            ),
            ("q_meas_1 q_meas_2 tau_meas_1 tau_meas_2", "q1 q2"),
        ] {
            let columns: Vec<&str> = columns.split(' ').collect();
            assert_eq!(names(&columns).join(" "), joints);
        }
        assert_eq!(joint_name("left elbow/[x]"), "left_elbow__x_");
    }
}
