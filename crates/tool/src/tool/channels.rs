//! Which columns of a table are force, moment, orientation, place and time: by their names, and of a table without
//! names by what stands in them.

use cft_ident_logs::log::{escape, unit_of};

use super::NUMBERS;
use super::error::ToolError;
use super::orientation::{OrientationColumns, families};
use super::table::WrenchTable;
use super::units;

/// Columns of a table, with the factor to SI.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct WrenchColumns {
    pub force: Option<[(usize, f64); 3]>,
    pub moment: Option<[(usize, f64); 3]>,
    /// As they stand for x y z w by their names, or in their order.
    pub quaternion: Option<[usize; 4]>,
    /// What an orientation is that is no quaternion.
    pub orientation: Option<OrientationColumns>,
    pub position: Option<[(usize, f64); 3]>,
    /// Whether names say which is which.
    pub named: bool,
    /// Whether a unit of the forces is stated.
    pub unit_is_stated: bool,
}

/// What a number is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ChannelKind {
    Force,
    Moment,
    Quaternion,
    Position,
}

/// Kind and axis (x y z w) by a name.
fn kind_of(name: &str) -> Option<(ChannelKind, usize)> {
    let plain = name
        .split(['[', '('])
        .next()
        .unwrap_or(name)
        .trim()
        .to_lowercase();
    let tokens: Vec<&str> = plain
        .split(|c: char| !c.is_alphanumeric())
        .filter(|t| !t.is_empty())
        .collect();
    let last = *tokens.last()?;
    let axis = "xyzw".find(last.chars().last()?)?;
    let head = &last[..last.len() - 1];
    let before = tokens.len().checked_sub(2).map_or("", |k| tokens[k]);
    let word = if head.is_empty() { before } else { head };
    let kind = match word {
        "f" | "force" | "forces" => ChannelKind::Force,
        "t" | "m" | "torque" | "moment" | "tau" | "n" => ChannelKind::Moment,
        "q" | "quat" | "quaternion" | "orientation" | "rotation" | "o" => ChannelKind::Quaternion,
        "p" | "pos" | "position" | "translation" | "" => ChannelKind::Position,
        _ => return None,
    };
    (axis < 3 || kind == ChannelKind::Quaternion).then_some((kind, axis))
}

/// Whether a name is that of a clock.
pub(super) fn is_time(name: &str) -> bool {
    let plain = name
        .split(['[', '('])
        .next()
        .unwrap_or(name)
        .trim()
        .to_lowercase();
    let known = [
        "t",
        "time",
        "timestamp",
        "stamp",
        "secs",
        "sec",
        "seconds",
        "time_s",
        "t_s",
    ];
    known.contains(&plain.as_str()) || plain.ends_with("timestamp") || plain.ends_with("time")
}

/// Columns by their names.
fn by_names(table: &WrenchTable) -> Result<WrenchColumns, ToolError> {
    let mut places: [[Option<usize>; 4]; 4] = [[None; 4]; 4];
    for (column, name) in table.names.iter().enumerate() {
        if let Some((kind, axis)) = kind_of(name) {
            places[kind as usize][axis].get_or_insert(column);
        }
    }
    let stated = |column: usize| unit_of(&table.names[column]);
    let scaled = |kind: ChannelKind,
                  of: fn(&str) -> Option<f64>,
                  what: &'static str,
                  known: &'static str| {
        let [Some(x), Some(y), Some(z), _] = places[kind as usize] else {
            return Ok::<_, ToolError>(None);
        };
        let mut out = [(x, 1.0), (y, 1.0), (z, 1.0)];
        for (column, factor) in &mut out {
            if let Some(unit) = stated(*column) {
                *factor = of(unit).ok_or_else(|| ToolError::Unit {
                    file: table.file.clone(),
                    column: escape(&table.names[*column]),
                    unit: escape(unit),
                    kind: what,
                    known,
                })?;
            }
        }
        Ok(Some(out))
    };
    let force = scaled(ChannelKind::Force, units::force, "a force", units::FORCES)?;
    let moment = scaled(
        ChannelKind::Moment,
        units::moment,
        "a moment",
        units::MOMENTS,
    )?;
    let position = scaled(
        ChannelKind::Position,
        units::length,
        "a length",
        "m, cm or mm",
    )?;
    let unit_is_stated = force.is_some_and(|all| all.iter().all(|(c, _)| stated(*c).is_some()));
    let quaternion = match places[ChannelKind::Quaternion as usize] {
        [Some(x), Some(y), Some(z), Some(w)] => Some([x, y, z, w]),
        _ => None,
    };
    let mut out = WrenchColumns {
        force,
        moment,
        quaternion,
        position,
        orientation: three_named(table).map(OrientationColumns::Three),
        named: true,
        unit_is_stated,
    };
    out.complete(table);
    Ok(out)
}

/// Names of three numbers that are an orientation: a rotation vector, or angles.
const TURNS: [[&str; 3]; 5] = [
    ["rx", "ry", "rz"],
    ["roll", "pitch", "yaw"],
    ["a", "b", "c"],
    ["rotx", "roty", "rotz"],
    ["alpha", "beta", "gamma"],
];
/// Positions beyond this are in millimetres: no arm reaches so far in metres.
const MOST_M: f64 = 20.0;

/// Three columns with such names, whatever stands before or, in brackets, behind them.
fn three_named(table: &WrenchTable) -> Option<[usize; 3]> {
    let last = |name: &String| {
        let plain = name.split(['[', '(']).next().unwrap_or(name).to_lowercase();
        let mut tokens = plain.split(|c: char| !c.is_alphanumeric());
        let last = tokens.rfind(|token| !token.is_empty());
        last.unwrap_or_default().to_owned()
    };
    let ends: Vec<String> = table.names.iter().map(last).collect();
    TURNS.iter().find_map(|names| {
        let place = |name: &str| ends.iter().position(|end| end == name);
        let [Some(x), Some(y), Some(z)] = names.map(place) else {
            return None;
        };
        Some([x, y, z])
    })
}

impl WrenchColumns {
    /// Adds what numbered columns hold, as interfaces of robots write them: six of a wrench, six of a pose, a matrix of
    /// nine or sixteen; places in millimetres are told by their size.
    fn complete(&mut self, table: &WrenchTable) {
        let mut all = families(&table.names);
        // what was measured stands before what was wanted
        let wanted = |head: &str| {
            ["target", "desired", "_d", "cmd"]
                .iter()
                .any(|word| head.contains(word))
        };
        all.sort_by_key(|(head, _)| wanted(&head.to_lowercase()));
        for (head, columns) in &all {
            let words: Vec<String> = head
                .split(|c: char| !c.is_alphanumeric())
                .map(str::to_lowercase)
                .collect();
            let says = |known: &[&str]| words.iter().any(|word| known.contains(&word.as_str()));
            let plain = |from: usize| std::array::from_fn(|k| (columns[from + k], 1.0));
            let is_wrench = says(&["force", "wrench", "ft", "f"]);
            match columns.len() {
                6 if is_wrench && !self.has_wrench() => {
                    (self.force, self.moment) = (Some(plain(0)), Some(plain(3)));
                }
                6 if says(&["pose", "vector", "cartesian"])
                    && !is_wrench
                    && !self.has_orientation() =>
                {
                    self.position = Some(plain(0));
                    let three = std::array::from_fn(|k| columns[3 + k]);
                    self.orientation = Some(OrientationColumns::Three(three));
                }
                count @ (9 | 16) if !self.has_orientation() => {
                    let width = if count == 9 { 3 } else { 4 };
                    let nine = std::array::from_fn(|k| columns[width * (k / 3) + k % 3]);
                    let found = OrientationColumns::Nine(nine);
                    if found.readings(table).is_some() {
                        self.orientation = Some(found);
                    }
                }
                _ => {}
            }
        }
        let size = |of: &[(usize, f64); 3]| {
            let all = of.iter().flat_map(|(column, _)| &table.columns[*column]);
            all.fold(0.0_f64, |most, x| most.max(x.abs()))
        };
        if let Some(of) = self.position.as_mut().filter(|of| size(of) > MOST_M) {
            of.iter_mut().for_each(|(_, factor)| *factor = 1e-3);
        }
    }

    /// Whether orientations are among them.
    pub fn has_orientation(&self) -> bool {
        self.quaternion.is_some() || self.orientation.is_some()
    }
}

/// Four neighbouring columns that are of length one in all rows, the first ones.
fn unit_quaternion(table: &WrenchTable) -> Option<usize> {
    let last = table.columns.len().checked_sub(4)?;
    let rows = 0..table.rows();
    (0..=last).find(|from| {
        let length = |row: usize| {
            let four = &table.columns[*from..from + 4];
            four.iter()
                .map(|column| column[row].powi(2))
                .sum::<f64>()
                .sqrt()
        };
        rows.clone()
            .all(|row| (length(row) - 1.0).abs() <= NUMBERS.quaternion)
    })
}

fn three(from: usize) -> [(usize, f64); 3] {
    std::array::from_fn(|k| (from + k, 1.0))
}

/// Whether the first column runs on as a clock does.
pub(super) fn first_is_clock(table: &WrenchTable) -> bool {
    let first = table.columns.first();
    first.is_some_and(|t| t.len() > 2 && t.windows(2).all(|pair| pair[1] > pair[0]))
}

/// Columns of a table without names: x y z, four numbers of length one, six of a wrench, with or without a clock.
fn by_content(table: &WrenchTable) -> WrenchColumns {
    let width = table.columns.len();
    let quaternion = unit_quaternion(table);
    let others = width - if quaternion.is_some() { 4 } else { 0 };
    // numbers besides a clock come in threes
    let clock = usize::from(others % 3 == 1 && first_is_clock(table));
    let mut out = WrenchColumns::default();
    let mut free: Vec<usize> = (clock..width).collect();
    if let Some(from) = quaternion {
        out.quaternion = Some(std::array::from_fn(|k| from + k));
        free.retain(|column| !(from..from + 4).contains(column));
        let beside = from.checked_sub(3).filter(|start| free.contains(start));
        if let (Some(start), true) = (beside, free.len() % 6 == 3) {
            out.position = Some(three(start));
            free.retain(|column| !(start..start + 3).contains(column));
        }
    }
    if let [first, .., last] = free[..]
        && free.len() == 6
        && last - first == 5
    {
        out.force = Some(three(first));
        out.moment = Some(three(first + 3));
    }
    out
}

impl WrenchColumns {
    /// What a table holds.
    pub fn of(table: &WrenchTable) -> Result<Self, ToolError> {
        match table.names.iter().all(|name| name.starts_with('#')) {
            true => Ok(by_content(table)),
            false => by_names(table),
        }
    }

    pub fn has_wrench(&self) -> bool {
        self.force.is_some() && self.moment.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_many_makers_say_what_a_column_is() {
        use ChannelKind::{Force, Moment, Position, Quaternion};
        for (name, expected) in [
            ("fx", Some((Force, 0))),
            ("Fy [N]", Some((Force, 1))),
            ("wrench.force.z", Some((Force, 2))),
            ("/ft:wrench.torque.x", Some((Moment, 0))),
            ("Mz (Nm)", Some((Moment, 2))),
            ("qw", Some((Quaternion, 3))),
            ("pose.orientation.x", Some((Quaternion, 0))),
            ("transform.rotation.w", Some((Quaternion, 3))),
            ("z", Some((Position, 2))),
            ("pose.position.y", Some((Position, 1))),
            ("w", None),
            ("max", None),
            ("", None),
        ] {
            assert_eq!(kind_of(name), expected, "{name}");
        }
    }
}
