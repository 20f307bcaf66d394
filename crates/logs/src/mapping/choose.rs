//! One family of columns each for positions, velocities and torques, and the joints that they are of.

use schemars::JsonSchema;
use serde::Serialize;

use super::column::LogColumn;
use super::family::{How, temperatures};
use super::fitting::{Taken, best, without_common_head};
use super::left::{left, offered};
use super::look::{ClockSource, SeenColumns};
use super::shown::{Known, shown};
use super::units::{of_positions, of_torques, other_velocity, stated_position};
use crate::inspect::ChannelRole;
use crate::inspect::words::without_joint;
use crate::log::escape;
use cft_ident_core::robot::JointKind;

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
        let mut position = out.measured(columns, 0, &names, None);
        let beside = position.as_ref().map(|taken| taken.pattern.clone());
        let beside = beside.as_deref();
        let velocity = best(columns, ChannelRole::Velocity, false, &names, beside)
            .filter(|taken| taken.how != How::InPart);
        let mut torque = out.measured(columns, 2, &names, beside);
        let one = position.is_some() != torque.is_some();
        if let Some(taken) = left(columns, &names).filter(|_| one) {
            let (place, what) = match torque.is_none() {
                true => (&mut torque, "torques"),
                false => (&mut position, "positions"),
            };
            if what == "torques" && taken.columns.iter().flatten().all(|c| c.commanded) {
                out.torque_is = "commanded";
            }
            out.checks.push(format!(
                "{what}: {} in the order of the joints, for they are what is left and no name says more",
                escape(&taken.pattern)
            ));
            *place = Some(taken);
        }
        let all = [position, velocity, torque];
        for (taken, (_, what)) in all.iter().zip(ROLES) {
            match taken {
                Some(taken) => out.note(taken, what, names.len(), seen.by_content),
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
        if seen.by_content {
            out.how = "by what they hold, for no name says it: CHECK IT";
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

    /// The family of measured columns of a role, else that of commanded ones, which is reported.
    fn measured<'a>(
        &mut self,
        columns: &'a [LogColumn],
        role: usize,
        names: &[&str],
        beside: Option<&str>,
    ) -> Option<Taken<'a>> {
        let (role, what) = ROLES[role];
        best(columns, role, false, names, beside).or_else(|| {
            let taken = best(columns, role, true, names, beside)?;
            if role == ChannelRole::Torque {
                self.torque_is = "commanded";
            }
            self.checks.push(format!(
                "{what}: no measured ones are found, {} are commanded ones",
                escape(&taken.pattern)
            ));
            Some(taken)
        })
    }

    /// Says how a family was taken.
    fn note(&mut self, taken: &Taken, what: &str, joints: usize, by_content: bool) {
        let pattern = escape(&taken.pattern);
        match taken.how {
            _ if by_content => self
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

    /// Says that nothing in a log says where torques were measured, or that efforts are none.
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
