//! The joints of a robot: those of a URDF, or those that a log shows.

use super::column::LogColumn;
use super::family::{Family, Key, families};
use super::units::{stated_position, stated_torque};
use crate::inspect::ChannelRole;
use crate::inspect::words::{joint, slides, words};
use cft_ident_core::robot::JointKind;

/// A joint of the robot, where a URDF names it.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    pub name: String,
    pub kind: JointKind,
    /// Its largest torque [N or Nm].
    pub torque: Option<f64>,
}

/// The joints that a log shows: the members of the family of positions that has torques beside it and is
/// the likeliest to have been measured; else the largest one.
pub(super) fn shown(columns: &[LogColumn]) -> Vec<Known> {
    let one = |name: &str, kind| Known {
        name: name.to_owned(),
        kind,
        torque: None,
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
        let partner = torques.iter().any(|other| keys(other) == own);
        let contract = family.pattern == "q_#"
            && torques
                .iter()
                .any(|other| other.pattern == "tau_#" && keys(other) == own);
        let size = family.members.len() as i32;
        (!contract, !partner, family.penalty - size)
    };
    let found = families(&positions, &[]);
    let Some(best) = found.iter().min_by_key(|family| rank(family)) else {
        return vec![one("q1", JointKind::Revolute)];
    };
    let heads: Vec<Vec<String>> = best
        .members
        .iter()
        .map(|(key, _)| match key {
            Key::Name(name) => words(name).into_iter().map(|w| w.text).collect(),
            Key::Number(_) => Vec::new(),
        })
        .collect();
    // `joint_states.elbow` is the elbow: words that all names begin with are none of the joints'
    let common = |k: usize| {
        heads
            .iter()
            .all(|head| head.len() > k + 1 && head[k] == heads[0][k])
    };
    // `q_<joint>` of the contract has the joint's whole name
    let named = |(_, column): &(Key, &LogColumn)| own_name(&column.name).is_some();
    let begins = match heads.len() {
        _ if best.pattern == "q_#" && best.members.iter().all(named) => 0,
        0 | 1 => 0,
        _ => (0..).take_while(|k| common(*k)).count(),
    };
    let mut members: Vec<&(Key, &LogColumn)> = best.members.iter().collect();
    if members.iter().all(|(key, _)| matches!(key, Key::Number(_))) {
        members.sort_by(|a, b| a.0.cmp(&b.0));
    }
    let of_member = |(key, column): &&(Key, &LogColumn)| {
        let name = match key {
            // of `q_fer_joint1` the joint is what the contract says, where all of it names a joint
            Key::Number(_) if own_name(&column.name).is_some() => {
                joint_name(own_name(&column.name).unwrap_or_default())
            }
            Key::Number(number) => format!("q{number}"),
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
    let joints: Vec<Known> = members.iter().map(of_member).collect();
    joints
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
    let bare = |column: &LogColumn| LogColumn {
        name: own_name(&column.name).map_or_else(|| column.name.clone(), |_| "q_#".to_owned()),
        ..column.clone()
    };
    let position = &bare(position);
    let slid = match (stated_position(position), force) {
        (Some("m" | "mm" | "cm"), _) => true,
        (Some(_), _) => false,
        (None, Some("N" | "kN")) => true,
        (None, Some("Nm" | "mNm" | "kNm" | "Ncm")) => false,
        _ => pushed || slides(&words(&position.name)),
    };
    match slid {
        true => JointKind::Prismatic,
        false => JointKind::Revolute,
    }
}

/// A joint's name as a robot file may hold it: a number alone is `q1`.
fn joint_name(joint: &str) -> String {
    let kept: String = joint
        .chars()
        .map(|c| match c.is_alphanumeric() || "_-.".contains(c) {
            true => c,
            false => '_',
        })
        .take(48)
        .collect();
    match kept.chars().next() {
        None => "q1".to_owned(),
        Some(c) if c.is_ascii_digit() => format!("q{kept}"),
        Some(_) => kept,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(names: &[&str]) -> Vec<LogColumn> {
        names.iter().map(|name| LogColumn::named(name)).collect()
    }

    #[test]
    fn a_log_of_both_sides_of_the_gears_has_the_joints_that_have_torques() {
        let names = |all: &[&str]| -> Vec<String> {
            shown(&columns(all)).into_iter().map(|k| k.name).collect()
        };
        let both = ["x_c1", "x_c2", "q_a", "q_b", "u_1", "u_2", "tau_a", "tau_b"];
        assert_eq!(names(&both), ["a", "b"]);
        // torques of the other side alone: the joints are of that side
        assert_eq!(names(&both[..6]), ["q1", "q2"]);
    }

    #[test]
    fn joints_without_a_urdf_have_the_names_and_numbers_of_the_columns() {
        let names = |all: &[&str]| -> Vec<String> {
            shown(&columns(all)).into_iter().map(|k| k.name).collect()
        };
        assert_eq!(names(&["positions_0", "positions_1"]), ["q0", "q1"]);
        assert_eq!(
            names(&["joint_2_position", "joint_1_position"]),
            ["q1", "q2"]
        );
        let dotted = ["joint_states.pan.position", "joint_states.lift.position"];
        assert_eq!(names(&dotted), ["pan", "lift"]);
        assert_eq!(names(&["t", "Position", "Iq"]), ["q1"]);
        let of_messages = [
            "q_fer_joint1",
            "q_fer_joint2",
            "tau_fer_joint1",
            "tau_fer_joint2",
        ];
        assert_eq!(names(&of_messages), ["fer_joint1", "fer_joint2"]);
        let measured = ["q_meas_1", "q_meas_2", "tau_meas_1", "tau_meas_2"];
        assert_eq!(names(&measured), ["q1", "q2"]);
        assert_eq!(joint_name("left elbow/[x]"), "left_elbow__x_");
    }
}
