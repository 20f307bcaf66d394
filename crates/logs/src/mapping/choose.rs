//! One family of columns each for positions, velocities and torques, and the joints that they are of.

use schemars::JsonSchema;
use serde::Serialize;

use super::column::LogColumn;
use super::family::{Family, How, Key, families, fit};
use super::fitting::{Taken, best, without_common_head};
use super::look::{ClockSource, SeenColumns};
use super::units::{of_positions, of_torques, other_velocity, stated_position, stated_torque};
use crate::inspect::ChannelRole;
use crate::inspect::words::{Word, joint, slides, without_joint, words};
use crate::log::escape;
use cft_ident_core::robot::JointKind;

/// A joint of the robot, where a URDF told it.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    pub name: String,
    pub kind: JointKind,
    /// Its largest torque [N or Nm].
    pub torque: Option<f64>,
}

/// One joint and its columns.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct JointColumns {
    /// Name of the joint.
    pub joint: String,
    #[serde(skip)]
    pub kind: JointKind,
    /// Column of its position.
    pub position: Option<String>,
    /// Column of its velocity.
    pub velocity: Option<String>,
    /// Column of its torque.
    pub torque: Option<String>,
    /// Column that looks like the temperature of its drive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature: Option<String>,
    #[serde(skip)]
    pub position_unit: Option<&'static str>,
    #[serde(skip)]
    pub position_scale: Option<f64>,
    #[serde(skip)]
    pub wrap: Option<f64>,
    #[serde(skip)]
    pub torque_unit: Option<&'static str>,
    #[serde(skip)]
    pub torque_scale: Option<f64>,
    /// Name of the joint in the messages of a recording, where it is another one.
    #[serde(skip)]
    pub in_messages: Option<String>,
    /// Columns are named by paths in messages.
    #[serde(skip)]
    pub by_path: bool,
}

/// The joints, each with its columns, and what is to be looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapping {
    pub joints: Vec<JointColumns>,
    /// How the columns were found, in words.
    pub how: &'static str,
    /// What is a guess, one sentence each.
    pub checks: Vec<String>,
    /// Families of columns of the same kind that were not taken.
    pub others: Vec<String>,
    /// `torque_is` of the robot file, and what to look at there where it is a guess.
    pub torque_is: &'static str,
    pub torque_check: Option<String>,
    /// Columns that the robot lacks, one sentence each.
    pub warnings: Vec<String>,
    /// Quantities that no column was found for, and families of columns that may be them.
    pub lacking: Vec<&'static str>,
    pub offered: Vec<String>,
}

const ROLES: [(ChannelRole, &str); 3] = [
    (ChannelRole::Position, "positions"),
    (ChannelRole::Velocity, "velocities"),
    (ChannelRole::Torque, "torques"),
];

impl Mapping {
    /// The columns of the joints of a URDF, or of those that the log shows.
    pub fn of(known: Option<&[Known]>, seen: Option<&SeenColumns>) -> Self {
        let columns: &[LogColumn] = seen.map_or(&[], |seen| &seen.columns);
        let joints: Vec<Known> = match known {
            Some(known) => known.to_vec(),
            None => shown(columns),
        };
        let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
        let mut out = Self {
            joints: joints.iter().map(plain).collect(),
            how: "by their names",
            checks: Vec::new(),
            others: Vec::new(),
            torque_is: "joint",
            torque_check: None,
            warnings: Vec::new(),
            lacking: Vec::new(),
            offered: Vec::new(),
        };
        let Some(seen) = seen else {
            return out;
        };
        let position = best(columns, ChannelRole::Position, false, &names, None);
        let beside = position.as_ref().map(|taken| taken.pattern.clone());
        let beside = beside.as_deref();
        let velocity = best(columns, ChannelRole::Velocity, false, &names, beside)
            .filter(|taken| taken.how != How::InPart);
        let mut torque = best(columns, ChannelRole::Torque, false, &names, beside);
        if torque.is_none() {
            torque = best(columns, ChannelRole::Torque, true, &names, beside);
            if let Some(taken) = &torque {
                out.torque_is = "commanded";
                out.checks.push(format!(
                    "torques: no measured ones are found, {} are commanded ones",
                    escape(&taken.pattern)
                ));
            }
        }
        let all = [position, velocity, torque];
        for (taken, (_, what)) in all.iter().zip(ROLES) {
            match taken {
                Some(taken) => out.tell(taken, what, names.len(), seen.headerless),
                None if what == "velocities" => {}
                None => {
                    out.lacking.push(what);
                    out.warnings.push(format!(
                        "no columns look like the {what} of {} joint(s): complete [log.joint]",
                        names.len()
                    ));
                }
            }
        }
        if !out.lacking.is_empty() {
            out.offered = offered(columns, names.len());
        }
        if seen.headerless {
            out.how = "by what they hold, for they have no names: CHECK IT";
        }
        let [position, velocity, torque] = all;
        // words of a joint's name are no units
        let short = without_common_head(&names);
        let beside = |columns: &[Option<LogColumn>]| -> Vec<Option<LogColumn>> {
            let pairs = columns.iter().zip(names.iter().zip(&short));
            pairs
                .map(|(column, (joint, short))| {
                    let mut column = column.clone()?;
                    let bare = without_joint(&column.name, joint);
                    column.name = match bare == column.name {
                        true => without_joint(&bare, short),
                        false => bare,
                    };
                    Some(column)
                })
                .collect()
        };
        let columns_of = |taken: &Option<Taken>| -> Vec<Option<LogColumn>> {
            let none = vec![None; names.len()];
            let cloned = |t: &Taken| t.columns.iter().map(|c| c.cloned()).collect();
            taken.as_ref().map_or(none, cloned)
        };
        let (q, mut dq, tau) = (
            columns_of(&position),
            columns_of(&velocity),
            columns_of(&torque),
        );
        if out.units(&joints, [&beside(&q), &beside(&dq), &beside(&tau)]) {
            dq.iter_mut().for_each(|column| *column = None);
        }
        let warm = temperatures(columns, &names);
        for (k, joint) in out.joints.iter_mut().enumerate() {
            joint.temperature = warm.as_ref().map(|columns| columns[k].clone());
            let name = |column: &Option<LogColumn>| {
                let column = column.as_ref()?;
                Some(column.path.as_ref().unwrap_or(&column.name).clone())
            };
            joint.by_path = q[k].as_ref().is_some_and(|column| column.path.is_some());
            (joint.position, joint.velocity, joint.torque) =
                (name(&q[k]), name(&dq[k]), name(&tau[k]));
            joint.wrap = q[k].as_ref().and_then(|c| c.wrap);
            if seen.is_recording() {
                let in_messages = q[k].as_ref().and_then(|c| c.name.strip_prefix("q_"));
                joint.in_messages = in_messages
                    .filter(|name| *name != joint.joint)
                    .map(str::to_owned);
            }
        }
        out.check_position(seen, &beside(&q));
        out.check_torque(seen);
        out
    }

    /// Says how a family was taken.
    fn tell(&mut self, taken: &Taken, what: &str, joints: usize, headerless: bool) {
        let pattern = escape(&taken.pattern);
        match taken.how {
            _ if headerless => self
                .checks
                .push(format!("{what}: found by what the columns hold")),
            How::Fits => {}
            How::InOrder => {
                self.how = "in the order of the columns, for their names say nothing: CHECK IT";
                self.checks
                    .push(format!("{what}: {pattern} in the order of the joints"));
            }
            How::InPart => {
                self.how = "as far as their names fit: CHECK IT";
                let found = taken.columns.iter().flatten().count();
                self.checks.push(format!(
                    "{what}: {pattern} does not fit the {joints} joints in number and order; {found} were mapped; where a URDF has joints that the log has not, --tip LINK ends the arm before them"
                ));
            }
        }
        if taken.tie {
            self.checks.push(format!(
                "{what}: {pattern} or {}?",
                escape(&taken.others[0])
            ));
        }
        let others = taken.others.iter().map(|other| escape(other));
        self.others.extend(others);
    }

    /// Units of positions and torques; whether velocities are in units that do not go with those of the positions.
    fn units(&mut self, known: &[Known], [q, dq, tau]: [&[Option<LogColumn>]; 3]) -> bool {
        let paired = |columns: &[Option<LogColumn>]| -> Vec<usize> {
            (0..columns.len())
                .filter(|k| columns[*k].is_some())
                .collect()
        };
        let found = paired(q);
        let columns: Vec<&LogColumn> = found.iter().filter_map(|k| q[*k].as_ref()).collect();
        let kinds: Vec<JointKind> = found.iter().map(|k| known[*k].kind).collect();
        for (k, unit) in found.iter().zip(of_positions(&columns, &kinds)) {
            let joint = &mut self.joints[*k];
            (joint.position_unit, joint.position_scale) = (unit.unit, unit.scale);
            self.check(unit.check.map(|text| format!("positions: {text}")));
        }
        let position = |k: &usize| q[*k].as_ref().and_then(stated_position);
        let other = |k: &usize| {
            let velocity = dq[*k].as_ref();
            velocity.is_some_and(|velocity| other_velocity(velocity, position(k)))
        };
        let apart = paired(dq).iter().any(other);
        let found = paired(tau);
        let columns: Vec<&LogColumn> = found.iter().filter_map(|k| tau[*k].as_ref()).collect();
        let limits: Vec<Option<f64>> = found.iter().map(|k| known[*k].torque).collect();
        let units = of_torques(&columns, &limits);
        let current = units
            .iter()
            .any(|unit| unit.drive && unit.unit == Some("A"));
        for (k, unit) in found.iter().zip(units) {
            let joint = &mut self.joints[*k];
            (joint.torque_unit, joint.torque_scale) = (unit.unit, unit.scale);
            self.check(unit.check.map(|text| format!("torques: {text}")));
        }
        if current && self.torque_is == "joint" {
            self.torque_is = "current";
            if self.joints.len() > 1 {
                self.checks.push("torques: motor currents; give torque_scale of each joint, torque constant times gear ratio".to_owned());
            }
        }
        apart
    }

    /// Notes what is to be looked at, once.
    fn check(&mut self, text: Option<String>) {
        if let Some(text) = text.filter(|text| !self.checks.contains(text)) {
            self.checks.push(text);
        }
    }

    /// Asks for the unit of angles whose columns state none and have other names than the tool's own.
    fn check_position(&mut self, seen: &SeenColumns, columns: &[Option<LogColumn>]) {
        let unstated = |(joint, column): (&JointColumns, &Option<LogColumn>)| {
            let own = joint.position.as_deref() == Some(&format!("q_{}", joint.joint));
            let taken = joint.kind == JointKind::Revolute && joint.position_unit.is_none() && !own;
            taken
                && column
                    .as_ref()
                    .is_some_and(|column| stated_position(column).is_none())
        };
        if !seen.is_recording() && self.joints.iter().zip(columns).any(unstated) {
            let text = "positions: rad is taken, for no name states a unit; else position_unit = \"deg\" or \"turns\"";
            self.check(Some(text.to_owned()));
        }
    }

    /// Says that nothing in a log tells where torques were measured, or that efforts are none.
    fn check_torque(&mut self, seen: &SeenColumns) {
        let contract = |joint: &JointColumns| {
            let name = joint.torque.as_deref();
            name.is_none_or(|name| name == format!("tau_{}", joint.joint))
        };
        let any = self.joints.iter().any(|joint| joint.torque.is_some());
        let own = !seen.is_recording() && self.joints.iter().all(contract);
        if any && !own && self.torque_is == "joint" {
            let effort = match seen.is_recording() {
                true => "many drivers publish motor currents as effort",
                false => "no name says it",
            };
            self.torque_check = Some(format!(
                "torques at the joints? {effort}; else torque_is = \"motor\" or \"current\", with torque_scale"
            ));
        }
    }

    /// Whether nothing in the file is a guess.
    pub fn is_sure(&self, seen: Option<&SeenColumns>) -> bool {
        let clock = seen.map(|seen| &seen.clock);
        let guessed = matches!(
            clock,
            Some(
                ClockSource::Column { guessed: true, .. }
                    | ClockSource::Rate {
                        coarse: Some(_),
                        ..
                    }
            )
        );
        self.checks.is_empty() && self.torque_check.is_none() && !guessed
    }

    /// Kind of the only joint.
    pub fn kind(&self) -> JointKind {
        self.joints.first().map_or(JointKind::Revolute, |j| j.kind)
    }
}

fn plain(known: &Known) -> JointColumns {
    JointColumns {
        joint: known.name.clone(),
        kind: known.kind,
        position: None,
        velocity: None,
        torque: None,
        temperature: None,
        position_unit: None,
        position_scale: None,
        wrap: None,
        torque_unit: None,
        torque_scale: None,
        in_messages: None,
        by_path: false,
    }
}

/// Families that are offered where no name says what they are.
const OFFERED: usize = 6;

/// Families of as many columns as joints whose names say nothing.
fn offered(columns: &[LogColumn], joints: usize) -> Vec<String> {
    let unsaid = |c: &&LogColumn| matches!(c.role, ChannelRole::Other | ChannelRole::Command);
    let unsaid: Vec<&LogColumn> = columns.iter().filter(unsaid).collect();
    let found = families(&unsaid, &[]);
    let fitting = found.iter().filter(|family| family.members.len() == joints);
    fitting
        .take(OFFERED)
        .map(|family| family.pattern.clone())
        .collect()
}

/// A column of temperatures for every joint, where a family of them fits.
fn temperatures(columns: &[LogColumn], joints: &[&str]) -> Option<Vec<String>> {
    let said = |c: &&LogColumn| {
        let spoken = words(&c.name);
        let warm =
            |word: &Word| ["temp", "temps", "temperature", "temperatures"].contains(&&*word.text);
        !c.commanded && spoken.iter().any(warm)
    };
    let of: Vec<&LogColumn> = columns.iter().filter(said).collect();
    let mut found = families(&of, joints);
    found.sort_by_key(|family| family.penalty);
    let fitting = found.iter().filter_map(|family| fit(family, joints));
    let mut whole = fitting.filter(|(how, _)| *how != How::InPart);
    let (_, columns) = whole.next()?;
    let name = |column: Option<&LogColumn>| Some(column?.name.clone());
    columns.into_iter().map(name).collect()
}

/// The joints that a log shows: the members of the family of positions that has torques beside it and is
/// the likeliest to have been measured; else the largest one.
fn shown(columns: &[LogColumn]) -> Vec<Known> {
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
