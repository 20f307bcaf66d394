//! A robot file under a correction of its set-up, and the lines by which it differs.

use std::collections::BTreeMap;

use crate::setup::Correction;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::cft::COORDINATES;
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::correction::KeyEdit;
use cft_ident_logs::log::PositionUnit;
use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

/// The keys of a channel in `[log.joint]`, and of a motor in `[log.actuator]`.
struct ChannelKeys {
    table: &'static str,
    torque: &'static str,
    zero: &'static str,
}

const JOINT: ChannelKeys = ChannelKeys {
    table: "joint",
    torque: "torque",
    zero: "position_offset",
};
const MOTOR: ChannelKeys = ChannelKeys {
    table: "actuator",
    torque: "volts",
    zero: "home",
};

/// The channels of a file as tables.
pub(crate) struct ChannelTables<'a> {
    file: &'a RobotFile,
    motors: bool,
}

impl<'a> ChannelTables<'a> {
    pub fn new(file: &'a RobotFile, motors: bool) -> Self {
        Self { file, motors }
    }

    pub fn names(&self) -> Vec<String> {
        match self.motors {
            true => COORDINATES.map(str::to_owned).to_vec(),
            false => self.file.joint_names(),
        }
    }

    fn keys(&self) -> ChannelKeys {
        if self.motors { MOTOR } else { JOINT }
    }

    fn table(&self, name: &str) -> Table {
        match self.motors {
            true => keys_of(self.file.log.actuator.get(name)),
            false => keys_of(self.file.log.joint.get(name)),
        }
    }

    /// A number of a channel: `sign`, `scale` or `offset` of its torque or position.
    pub fn number(&self, name: &str, torque: bool, of: &str) -> f64 {
        let keys = self.keys();
        let (key, plain) = match of {
            "offset" => (keys.zero.to_owned(), 0.0),
            of if torque => (format!("{}_{of}", keys.torque), 1.0),
            of => (format!("position_{of}"), 1.0),
        };
        let value = self.table(name).remove(&key);
        value.and_then(|value| value.as_float()).unwrap_or(plain)
    }

    fn kind(&self, j: usize) -> JointKind {
        if !self.motors {
            return self.file.joint_kind(j);
        }
        let kind = self.file.robot().transmission().coordinate_kind(j);
        kind.unwrap_or(JointKind::Prismatic)
    }

    /// The lines that a correction asks for.
    pub fn edits(&self, by: &Correction) -> Vec<KeyEdit> {
        let mut out = Vec::new();
        if let Some(g) = by.gravity.filter(|g| Some(*g) != self.file.robot.gravity) {
            out.push(KeyEdit::new(&["robot", "gravity"], g.to_vec()));
        }
        let (names, keys) = (self.names(), self.keys());
        for (j, name) in names.iter().enumerate() {
            let mut set = |key: &str, value: Value| {
                out.push(KeyEdit::new(&["log", keys.table, name, key], value));
            };
            let (p, t) = (by.position_from[j], by.torque_from[j]);
            let (pf, tf) = (by.position_factor[j], by.torque_factor[j]);
            if p != j {
                let plain = match self.motors {
                    true => names[p].clone(),
                    false => format!("q_{}", names[p]),
                };
                let mut from = self.table(&names[p]);
                set("position", from.remove("position").unwrap_or(plain.into()));
                for key in ["velocity", "reference"] {
                    if let Some(column) = from.remove(key) {
                        set(key, column);
                    }
                }
            }
            if t != j {
                let plain = match self.motors {
                    true => format!("u_{}", t + 1),
                    false => format!("tau_{}", names[t]),
                };
                let column = self.table(&names[t]).remove(keys.torque);
                set(keys.torque, column.unwrap_or(plain.into()));
            }
            if p != j && p == t && !self.motors {
                let own = self.table(&names[p]).remove("name");
                set("name", own.unwrap_or_else(|| names[p].clone().into()));
            }
            for (torque, factor) in [(false, pf), (true, tf)] {
                let channel = if torque { keys.torque } else { "position" };
                if factor < 0.0 {
                    let sign = -self.number(name, torque, "sign");
                    set(&format!("{channel}_sign"), sign.into());
                }
                if factor.abs() == 1.0 {
                    continue;
                }
                match self.other_unit(j, factor.abs()).filter(|_| !torque) {
                    Some(unit) => set("position_unit", unit.label().into()),
                    None => {
                        let scale = self.number(name, torque, "scale") * factor.abs();
                        set(&format!("{channel}_scale"), scale.into());
                    }
                }
            }
            if by.zero[j] != 0.0 {
                let offset = self.number(name, false, "offset") + by.zero[j];
                set(keys.zero, offset.into());
            }
        }
        out
    }

    /// The unit that a position is in, where a factor is that of units.
    fn other_unit(&self, j: usize, factor: f64) -> Option<PositionUnit> {
        let length = self.kind(j) == JointKind::Prismatic;
        let all = if length {
            &[PositionUnit::METRE, PositionUnit::MILLIMETRE][..]
        } else {
            &[
                PositionUnit::RADIAN,
                PositionUnit::DEGREE,
                PositionUnit::TURN,
            ]
        };
        let mut table = self.table(&self.names()[j]);
        let now = table
            .remove("position_unit")
            .map(|unit| unit.try_into().ok());
        let now = now.unwrap_or(Some(all[0]))?;
        let is = |unit: &&PositionUnit| (now.in_si() * factor / unit.in_si() - 1.0).abs() < 1e-9;
        all.iter().filter(|_| all.contains(&now)).find(is).copied()
    }

    /// The robot file with these lines.
    pub fn corrected(&self, edits: &[KeyEdit], by: &Correction) -> RobotFile {
        let mut out = self.file.clone();
        out.robot.gravity = by.gravity.or(out.robot.gravity);
        for edit in edits.iter().filter(|edit| edit.path.len() == 4) {
            match self.motors {
                true => set(&mut out.log.actuator, edit),
                false => set(&mut out.log.joint, edit),
            }
        }
        out
    }
}

fn set<T: Serialize + DeserializeOwned>(of: &mut BTreeMap<String, T>, edit: &KeyEdit) {
    let (name, key) = (&edit.path[2], &edit.path[3]);
    let mut table = keys_of(of.get(name));
    table.insert(key.clone(), edit.value.clone());
    if let Ok(channels) = table.try_into() {
        of.insert(name.clone(), channels);
    }
}

fn keys_of<T: Serialize>(of: Option<&T>) -> Table {
    of.and_then(|of| Table::try_from(of).ok())
        .unwrap_or_default()
}

/// The keys of channels by which two files differ.
pub(crate) fn differences<T: Serialize>(
    table: &str,
    new: &BTreeMap<String, T>,
    old: &BTreeMap<String, T>,
    out: &mut Vec<KeyEdit>,
) {
    for (name, channels) in new {
        let before = keys_of(old.get(name));
        for (key, value) in keys_of(Some(channels)) {
            if before.get(&key) != Some(&value) {
                out.push(KeyEdit::new(&["log", table, name, &key], value));
            }
        }
    }
}
