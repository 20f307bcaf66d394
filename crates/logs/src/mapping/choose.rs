//! One family of columns each for positions, velocities and torques, and the joints that they are of.

use schemars::JsonSchema;
use serde::Serialize;

use super::column::LogColumn;
use super::family::{ColumnAssignment, temperatures};
use super::fitting::{FamilyMatch, best, external, left, offered, without_common_head};
use super::look::{ClockSource, SeenColumns};
use super::recorder::CalibratedRobot;
use super::shown::shown;
use super::units::{in_degrees, of_positions, of_torques, other_velocity, stated_position};
use super::urdf_joint::UrdfJoint;
use crate::inspect::ChannelRole;
use crate::inspect::words::{NamedDrive, drive, without_joint, words};
use crate::log::{ColumnsOfJoints, FurtherCommand, TORQUES, UnitKind, escape, stated_unit};
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
    pub position_offset: Option<f64>,
    #[serde(skip)]
    pub wrap: Option<f64>,
    #[serde(skip)]
    pub torque_wrap: Option<f64>,
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

impl JointColumns {
    /// Whether its torque is one, by its unit, and not what drives a motor.
    pub fn is_torque(&self) -> bool {
        let of = self
            .torque_unit
            .and_then(|unit| stated_unit(unit, &TORQUES));
        of.is_none_or(|unit| matches!(unit.unit.of, UnitKind::Force | UnitKind::Moment))
    }
}

/// The joints, each with its columns, and what is to be looked at.
#[derive(Debug, Clone, Default, PartialEq)]
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
    pub fn of(known: Option<&[UrdfJoint]>, seen: Option<&SeenColumns>) -> Self {
        let columns: &[LogColumn] = seen.map_or(&[], |seen| &seen.columns);
        let joints = known.map_or_else(|| shown(columns), <[UrdfJoint]>::to_vec);
        let names: Vec<&str> = joints.iter().map(|joint| joint.name.as_str()).collect();
        let mut out = Self {
            joints: joints.iter().map(plain).collect(),
            how: "by their names",
            torque_is: "joint",
            ..Self::default()
        };
        let Some(seen) = seen else {
            return out;
        };
        let mut position = out.measured(columns, 0, &names, None);
        let beside = position.as_ref().map(|taken| taken.pattern.clone());
        let beside = beside.as_deref();
        let velocity = best(columns, ChannelRole::Velocity, false, &names, beside)
            .filter(|taken| taken.how != ColumnAssignment::InPart);
        let mut torque = out.measured(columns, 2, &names, beside);
        let one = position.is_some() != torque.is_some();
        if let Some(taken) = left(columns, &names).filter(|_| one) {
            let (place, what) = match torque.is_none() {
                true => (&mut torque, "torques"),
                false => (&mut position, "positions"),
            };
            out.checks.push(format!(
                "{what}: {} in the order of the joints, for they are what is left and no name says more",
                escape(&taken.pattern)
            ));
            *place = Some(taken);
        }
        let external = external(columns, &names);
        if let (None, [first, ..]) = (&torque, &external[..]) {
            out.warnings.push(format!(
                "{} are estimates of what acts from outside, and no measured torques: they are not taken",
                escape(first)
            ));
        }
        out.others
            .extend(external.iter().map(|pattern| escape(pattern)));
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
        // words of a joint's name are no units
        let short = without_common_head(&names);
        let beside = |columns: &[Option<&LogColumn>]| -> Vec<Option<LogColumn>> {
            let own = |(column, (joint, short)): (&Option<&LogColumn>, (&&str, &String))| {
                let mut column = (*column)?.clone();
                let bare = without_joint(&column.name, joint);
                column.name = match bare == column.name {
                    true => without_joint(&bare, short),
                    false => bare,
                };
                Some(column)
            };
            let pairs = columns.iter().zip(names.iter().zip(&short));
            pairs.map(own).collect()
        };
        let [q, mut dq, tau] = all.map(|taken| match taken {
            Some(taken) => taken.columns,
            None => vec![None; names.len()],
        });
        let recorder = seen.robot_type.as_deref().and_then(CalibratedRobot::of);
        if out.units(
            &joints,
            recorder.as_ref(),
            [&beside(&q), &beside(&dq), &beside(&tau)],
        ) {
            dq.fill(None);
        }
        let warm = temperatures(columns, &names);
        for (k, joint) in out.joints.iter_mut().enumerate() {
            joint.temperature = warm.as_ref().map(|columns| columns[k].clone());
            let name = |column: &LogColumn| column.path.as_ref().unwrap_or(&column.name).clone();
            joint.by_path = q[k].is_some_and(|column| column.path.is_some());
            joint.position = q[k].map(name);
            joint.velocity = dq[k].map(name);
            joint.torque = tau[k].map(name);
            joint.wrap = q[k].and_then(|column| column.wrap);
            joint.torque_wrap = tau[k].and_then(|column| column.torque_wrap);
            if seen.is_recording() {
                let other = q[k].and_then(|column| column.name.strip_prefix("q_"));
                let other = other.filter(|name| *name != joint.joint);
                joint.in_messages = other.map(str::to_owned);
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
    ) -> Option<FamilyMatch<'a>> {
        let (role, what) = ROLES[role];
        best(columns, role, false, names, beside).or_else(|| {
            let taken = best(columns, role, true, names, beside)?;
            let mut check = format!(
                "{what}: no measured ones are found, {} are commanded ones",
                escape(&taken.pattern)
            );
            if role == ChannelRole::Torque {
                self.torque_is = "commanded";
                check += ", which hold what a controller computed or asked for and no friction that it did not know";
                check += &law_line(columns, names, beside).unwrap_or_default();
            }
            self.checks.push(check);
            Some(taken)
        })
    }

    /// Says how a family was taken.
    fn note(&mut self, taken: &FamilyMatch, what: &str, joints: usize, by_content: bool) {
        let pattern = escape(&taken.pattern);
        let check = match taken.how {
            _ if by_content => Some("found by what the columns hold".to_owned()),
            ColumnAssignment::Fits => None,
            ColumnAssignment::InOrder => {
                self.how = "in the order of the columns, for their names say nothing: CHECK IT";
                Some(format!("{pattern} in the order of the joints"))
            }
            ColumnAssignment::InPart => {
                self.how = "as far as their names fit: CHECK IT";
                let found = taken.columns.iter().flatten().count();
                Some(format!(
                    "{pattern} does not fit the {joints} joints in number and order; {found} were mapped; where a URDF has joints that the log has not, --tip LINK ends the arm before them"
                ))
            }
        };
        let others: Vec<String> = taken.others.iter().map(|other| escape(other)).collect();
        // of two that may be the torques the model is as good as the choice
        let tie = taken.tie || (what == "torques" && !others.is_empty());
        let tie = tie.then(|| format!("{pattern} or {}?", others[0]));
        let checks = check.into_iter().chain(tie);
        self.checks
            .extend(checks.map(|check| format!("{what}: {check}")));
        self.others.extend(others);
    }

    /// Units of positions and torques; whether velocities are in units that do not go with those of the positions.
    fn units(
        &mut self,
        known: &[UrdfJoint],
        recorder: Option<&CalibratedRobot>,
        [q, dq, tau]: [&[Option<LogColumn>]; 3],
    ) -> bool {
        fn paired(columns: &[Option<LogColumn>]) -> (Vec<usize>, Vec<&LogColumn>) {
            let all = columns.iter().enumerate();
            all.filter_map(|(k, column)| Some((k, column.as_ref()?)))
                .unzip()
        }
        let (found, columns) = paired(q);
        let joints: Vec<&UrdfJoint> = found.iter().map(|k| &known[*k]).collect();
        let units = match recorder {
            Some(recorder) => recorder.positions(&columns, &joints),
            None => of_positions(&columns, &joints),
        };
        for (k, unit) in found.iter().zip(units) {
            let joint = &mut self.joints[*k];
            (joint.position_unit, joint.position_scale) = (unit.unit, unit.scale);
            joint.position_offset = unit.offset;
            self.check(unit.check.map(|text| format!("positions: {text}")));
        }
        let position = |k: &usize| q[*k].as_ref().and_then(stated_position);
        let (with_velocity, velocities) = paired(dq);
        let mut pairs = with_velocity.iter().zip(velocities);
        let apart = pairs.any(|(k, velocity)| {
            let ratio = q[*k].as_ref().and_then(|column| column.per_velocity);
            other_velocity(velocity, position(k)) || ratio.is_some_and(in_degrees)
        });
        let (found, columns) = paired(tau);
        let limits: Vec<Option<f64>> = found.iter().map(|k| known[*k].torque).collect();
        let units = of_torques(&columns, &limits);
        let mut each = units.iter().zip(&columns);
        let current = each.any(|(unit, column)| match unit.unit {
            Some("A" | "mA" | "uA") => unit.drive,
            _ => unit.drive && drive(&words(&column.name)) == NamedDrive::Current,
        });
        for (k, unit) in found.iter().zip(units) {
            let joint = &mut self.joints[*k];
            (joint.torque_unit, joint.torque_scale) = (unit.unit, unit.scale);
            self.check(unit.check.map(|text| format!("torques: {text}")));
        }
        if current && self.torque_is == "joint" {
            self.torque_is = "current";
            let scaled = |check: &String| check.contains("give torque_scale");
            if self.joints.len() > 1 && !self.checks.iter().any(scaled) {
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
            let taken = joint.kind == JointKind::Revolute
                && joint.position_unit.is_none()
                && joint.position_scale.is_none()
                && !own;
            let unstated = |column: &LogColumn| stated_position(column).is_none();
            taken && column.as_ref().is_some_and(unstated)
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
        // what is no torque by its unit is asked for its gain
        let torque = |joint: &JointColumns| joint.torque.is_some() && joint.is_torque();
        let any = self.joints.iter().any(torque);
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
        let guessed = seen.is_some_and(|seen| match &seen.clock {
            ClockSource::Messages => false,
            ClockSource::Column { guessed, .. } => *guessed,
            ClockSource::Rate { coarse, .. } => coarse.is_some(),
        });
        self.checks.is_empty() && self.torque_check.is_none() && !guessed
    }

    /// Kind of the only joint.
    pub fn kind(&self) -> JointKind {
        self.joints.first().map_or(JointKind::Revolute, |j| j.kind)
    }
}

/// The line by which the law of a drive gives the torques, where a log holds commands of positions.
fn law_line(columns: &[LogColumn], joints: &[&str], beside: Option<&str>) -> Option<String> {
    let asked = |role| -> Option<String> {
        let taken = best(columns, role, true, joints, beside)
            .filter(|taken| taken.how != ColumnAssignment::InPart)?;
        let names: Vec<&str> = taken.columns.iter().flatten().map(|c| &*c.name).collect();
        let pattern = taken.pattern.replace('#', ColumnsOfJoints::JOINT);
        let of = ColumnsOfJoints::Pattern(pattern.clone());
        let named = joints.iter().enumerate().map(|(k, joint)| of.of(k, joint));
        Some(match named.eq(names.iter().copied()) {
            true => format!("{:?}", escape(&pattern)),
            false => format!(
                "{:?}",
                names.iter().map(|name| escape(name)).collect::<Vec<_>>()
            ),
        })
    };
    let command = asked(ChannelRole::Position)?;
    let further = FurtherCommand::ALL.into_iter().filter_map(|command| {
        let column = asked(ChannelRole::of_command(command))?;
        Some(format!(", {} = {column}", command.key()))
    });
    Some(format!(
        "; of a drive that is asked for kp (command - q) + kd (velocity_command - dq) + feed_forward, the torque is `torque = {{ pd = [kp, kd], command = {command}{} }}` in [log], in place of `torque` of the joints",
        further.collect::<String>()
    ))
}

fn plain(known: &UrdfJoint) -> JointColumns {
    JointColumns {
        joint: known.name.clone(),
        kind: known.kind,
        position: None,
        velocity: None,
        torque: None,
        temperature: None,
        position_unit: None,
        position_scale: None,
        position_offset: None,
        wrap: None,
        torque_wrap: None,
        torque_unit: None,
        torque_scale: None,
        in_messages: None,
        by_path: false,
    }
}
