//! Which columns of a log are which joint, by the likeness of their names.

use schemars::JsonSchema;
use serde::Serialize;

use crate::cli::{CliError, Context, columns};
use crate::inspect::{self, ChannelRole};
use crate::log::{LogSpec, Provenance, RawReader, escape, nearest};
use crate::robot::JointKind;

/// A column of a log.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    pub name: String,
    pub role: ChannelRole,
    /// The joint that its name speaks of; empty where it names none.
    pub joint: String,
    pub unit: Option<String>,
    pub span: f64,
}

/// What a log shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Seen {
    pub columns: Vec<Column>,
    /// Name of the time's column, and seconds per unit of it.
    pub time: Option<(String, f64)>,
    pub rate_hz: Option<f64>,
    pub duration_s: f64,
    pub name: String,
    pub provenance: Provenance,
}

/// Looks at a log, to its end.
pub(super) fn look(spec: &LogSpec, context: &Context) -> Result<Seen, CliError> {
    let mut table = RawReader::open(spec, None)?;
    let (plan, _) = columns::guessed(&mut table)?;
    let bar = context.progress("looking at the log", None);
    let findings = look_at(&mut table, &plan, context)?;
    drop(bar);
    let units: Vec<Option<String>> = plan
        .channels
        .iter()
        .map(|p| table.unit(p.column).map(str::to_owned))
        .collect();
    let facts = findings.channels.iter();
    let columns = plan
        .channels
        .iter()
        .zip(units)
        .map(|(planned, unit)| {
            let fact = facts.clone().find(|f| f.name == planned.channel.name);
            let ends = fact.and_then(|f| f.min.zip(f.max));
            Column {
                name: planned.channel.name.clone(),
                role: planned.channel.role,
                joint: planned.channel.joint.clone().unwrap_or_default(),
                unit,
                span: ends.map_or(0.0, |(low, high)| high - low),
            }
        })
        .collect();
    let time = plan
        .time
        .map(|(column, seconds)| (table.names()[column].clone(), seconds));
    Ok(Seen {
        columns,
        time,
        rate_hz: findings.rate_hz,
        duration_s: findings.duration_s,
        name: escape(&spec.name()),
        provenance: table.provenance()?,
    })
}

fn look_at(
    table: &mut RawReader,
    plan: &inspect::ColumnPlan,
    context: &Context,
) -> Result<inspect::Findings, CliError> {
    let found = inspect::look(table, plan, &|| context.interrupted())?;
    found.ok_or_else(CliError::interrupted)
}

/// One joint and its columns.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub(super) struct Joint {
    #[serde(rename = "joint")]
    pub name: String,
    #[serde(skip)]
    pub kind: JointKind,
    /// Column of its position.
    pub position: Option<String>,
    /// Column of its velocity.
    pub velocity: Option<String>,
    /// Column of its torque.
    pub torque: Option<String>,
    #[serde(skip)]
    pub position_unit: Option<String>,
    #[serde(skip)]
    pub torque_unit: Option<String>,
    /// Width of what the position went through, in its own unit.
    #[serde(skip)]
    pub span: f64,
}

/// The joints, each with its columns.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mapping {
    pub joints: Vec<Joint>,
    /// The log's joints were told apart by their order, not by their names.
    pub by_order: bool,
    pub warnings: Vec<String>,
}

impl Mapping {
    /// Joints of a URDF, or else those that the log's positions name.
    pub(super) fn of(named: Option<&[(String, JointKind)]>, seen: Option<&Seen>) -> Self {
        let of_role = |role: ChannelRole| -> Vec<&Column> {
            let all = seen.into_iter().flat_map(|s| &s.columns);
            all.filter(|c| c.role == role).collect()
        };
        let positions = of_role(ChannelRole::Position);
        let names: Vec<(String, JointKind)> = match named {
            Some(named) => named.to_vec(),
            None if positions.is_empty() => vec![("q1".to_owned(), JointKind::Revolute)],
            None => named_by(&positions, &of_role(ChannelRole::Torque)),
        };
        let labels: Vec<&str> = names.iter().map(|(name, _)| name.as_str()).collect();
        let mut by_order = false;
        let mut warnings = Vec::new();
        let mut columns: Vec<[Option<&Column>; 3]> = vec![[None; 3]; names.len()];
        let sides = [
            ChannelRole::Position,
            ChannelRole::Velocity,
            ChannelRole::Torque,
        ];
        for (side, role) in sides.into_iter().enumerate() {
            let found = of_role(role);
            let matched = match_up(&labels, &found);
            by_order |= matched.by_order;
            for (slot, column) in columns.iter_mut().zip(matched.columns) {
                slot[side] = column;
            }
            if seen.is_some() && !found.is_empty() && found.len() < labels.len() {
                warnings.push(format!(
                    "{} column(s) look like {}, and the robot has {} joints: complete [log.joint]",
                    found.len(),
                    ["positions", "velocities", "torques"][side],
                    labels.len()
                ));
            }
        }
        let joints = names
            .iter()
            .zip(columns)
            .map(|((name, kind), [position, velocity, torque])| {
                let named = |column: Option<&Column>| column.map(|c| c.name.clone());
                Joint {
                    name: name.clone(),
                    kind: *kind,
                    position: named(position),
                    velocity: named(velocity),
                    torque: named(torque),
                    position_unit: position.and_then(|c| c.unit.clone()),
                    torque_unit: torque.and_then(|c| c.unit.clone()),
                    span: position.map_or(0.0, |c| c.span),
                }
            })
            .collect();
        Self {
            joints,
            by_order,
            warnings,
        }
    }

    /// Kind of the only joint.
    pub(super) fn kind(&self) -> JointKind {
        self.joints.first().map_or(JointKind::Revolute, |j| j.kind)
    }
}

/// The joints that positions name, each once. Where some have a torque of the same name (q_elbow,
/// tau_elbow), the others are of another side of the gears, or of no joint.
fn named_by(positions: &[&Column], torques: &[&Column]) -> Vec<(String, JointKind)> {
    let own = |c: &&&Column| {
        let joint = c.name.strip_prefix("q_");
        joint.is_some_and(|joint| torques.iter().any(|t| t.name == format!("tau_{joint}")))
    };
    let partnered: Vec<&Column> = positions.iter().filter(own).copied().collect();
    let chosen = match partnered.is_empty() {
        true => positions,
        false => &partnered,
    };
    let mut names: Vec<(String, JointKind)> = Vec::new();
    for column in chosen {
        let name = plain(&column.joint);
        if names.iter().all(|(other, _)| *other != name) {
            names.push((name, kind_of(column)));
        }
    }
    names
}

/// Metres slide, everything else turns.
fn kind_of(column: &Column) -> JointKind {
    match column.unit.as_deref() {
        Some("m" | "mm" | "cm") => JointKind::Prismatic,
        _ => JointKind::Revolute,
    }
}

/// A joint's name as a robot file may hold it: a number alone is `q1`.
fn plain(joint: &str) -> String {
    let kept: String = joint
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || "_-.".contains(c) {
                c
            } else {
                '_'
            }
        })
        .take(64)
        .collect();
    match kept.chars().next() {
        None => "q1".to_owned(),
        Some(c) if c.is_ascii_digit() => format!("q{kept}"),
        Some(_) => kept,
    }
}

/// The number at the end of a name.
fn number(name: &str) -> Option<u32> {
    let head = name.trim_end_matches(|c: char| c.is_ascii_digit());
    name[head.len()..].parse().ok()
}

struct Matched<'a> {
    columns: Vec<Option<&'a Column>>,
    by_order: bool,
}

/// Columns of the joints: by the same name, by the same number, by likeness, else by their order.
fn match_up<'a>(joints: &[&str], columns: &[&'a Column]) -> Matched<'a> {
    let mut found: Vec<Option<&Column>> = vec![None; joints.len()];
    let mut free: Vec<&Column> = columns.to_vec();
    let mut take = |found: &mut Vec<Option<&'a Column>>, fits: &dyn Fn(&str, &Column) -> bool| {
        for (joint, slot) in joints.iter().zip(found.iter_mut()) {
            if slot.is_none()
                && let Some(at) = free.iter().position(|c| fits(joint, c))
            {
                *slot = Some(free.remove(at));
            }
        }
    };
    take(&mut found, &|joint, c| {
        plain(&c.joint).eq_ignore_ascii_case(joint)
    });
    // joint_1 and q1, where every joint has a number of its own
    let numbers: Vec<Option<u32>> = joints.iter().map(|j| number(j)).collect();
    let apart = numbers
        .iter()
        .enumerate()
        .all(|(i, n)| n.is_some() && !numbers[..i].contains(n));
    if apart {
        take(&mut found, &|joint, c| number(&c.joint) == number(joint));
    }
    take(&mut found, &|joint, c| {
        nearest(&c.joint, joints.iter().copied()).is_some_and(|near| near == joint)
    });
    let mut by_order = false;
    if found.iter().all(Option::is_none) && columns.len() == joints.len() && !joints.is_empty() {
        by_order = joints.len() > 1;
        found = columns.iter().map(|c| Some(*c)).collect();
    }
    Matched {
        columns: found,
        by_order,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(names: &[(&str, &str)]) -> Vec<Column> {
        names
            .iter()
            .map(|(name, joint)| Column {
                name: (*name).to_owned(),
                role: ChannelRole::Position,
                joint: (*joint).to_owned(),
                unit: None,
                span: 1.0,
            })
            .collect()
    }

    fn matched(joints: &[&str], names: &[(&str, &str)]) -> (Vec<Option<String>>, bool) {
        let columns = columns(names);
        let columns: Vec<&Column> = columns.iter().collect();
        let found = match_up(joints, &columns);
        let names = found.columns.iter().map(|c| c.map(|c| c.name.clone()));
        (names.collect(), found.by_order)
    }

    fn some(names: &[&str]) -> Vec<Option<String>> {
        names.iter().map(|n| Some((*n).to_owned())).collect()
    }

    #[test]
    fn columns_go_by_name_before_number_and_by_number_before_order() {
        let (found, by_order) = matched(
            &["elbow", "wrist"],
            &[("q_wrist", "wrist"), ("q_elbow", "elbow")],
        );
        assert_eq!((found, by_order), (some(&["q_elbow", "q_wrist"]), false));
        let (found, by_order) = matched(&["joint_2", "joint_1"], &[("q1", "1"), ("q2", "2")]);
        assert_eq!((found, by_order), (some(&["q2", "q1"]), false));
        let (found, by_order) = matched(&["pan", "lift"], &[("q1", "1"), ("q2", "2")]);
        assert_eq!((found, by_order), (some(&["q1", "q2"]), true));
        // one column too few is no order
        let (found, _) = matched(&["pan", "lift"], &[("q1", "1")]);
        assert_eq!(found, [None, None]);
    }

    #[test]
    fn a_log_of_both_sides_of_the_gears_has_the_joints_that_have_torques() {
        let all = columns(&[
            ("x_c1", "1"),
            ("x_c2", "2"),
            ("q_a", "a"),
            ("q_b", "b"),
            ("q_a", "a"),
        ]);
        let all: Vec<&Column> = all.iter().collect();
        let torques = columns(&[("u_1", "1"), ("tau_a", "a"), ("tau_b", "b")]);
        let torques: Vec<&Column> = torques.iter().collect();
        let names = |t: &[&Column]| -> Vec<String> {
            named_by(&all, t)
                .into_iter()
                .map(|(name, _)| name)
                .collect()
        };
        assert_eq!(names(&torques), ["a", "b"]);
        assert_eq!(names(&torques[..1]), ["q1", "q2", "a", "b"]);
    }

    #[test]
    fn names_of_files_become_names_of_joints() {
        assert_eq!(plain(""), "q1");
        assert_eq!(plain("3"), "q3");
        assert_eq!(plain("left elbow/[x]"), "left_elbow__x_");
    }
}
