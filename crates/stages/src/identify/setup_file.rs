//! A robot file under a correction of its set-up, and the lines by which it differs.

use crate::setup::Correction;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::cft::COORDINATES;
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::correction::Edit;
use cft_ident_logs::log::{ActuatorChannels, ColumnName, JointChannels, PositionUnit};

/// What the file says of a channel.
pub(super) struct Declared {
    pub torque_sign: f64,
    pub torque_scale: f64,
    pub position_sign: f64,
    pub position_scale: f64,
    pub offset: f64,
}

impl Declared {
    pub fn of(file: &RobotFile, name: &str, motors: bool) -> Self {
        if motors {
            let plain = ActuatorChannels::default();
            let c = file.log.actuator.get(name).unwrap_or(&plain);
            return Self {
                torque_sign: c.volts_sign.unwrap_or(1.0),
                torque_scale: c.volts_scale.unwrap_or(1.0),
                position_sign: c.position_sign.unwrap_or(1.0),
                position_scale: c.position_scale.unwrap_or(1.0),
                offset: c.home.unwrap_or(0.0),
            };
        }
        let plain = JointChannels::default();
        let c = file.log.joint.get(name).unwrap_or(&plain);
        Self {
            torque_sign: c.torque_sign.unwrap_or(1.0),
            torque_scale: c.torque_scale.unwrap_or(1.0),
            position_sign: c.position_sign.unwrap_or(1.0),
            position_scale: c.position_scale.unwrap_or(1.0),
            offset: c.position_offset.unwrap_or(0.0),
        }
    }
}

/// The robot file under a correction.
pub(super) fn corrected(file: &RobotFile, by: &Correction, motors: bool) -> RobotFile {
    let mut out = file.clone();
    out.robot.gravity = by.gravity.or(out.robot.gravity);
    let names = match motors {
        true => COORDINATES.map(str::to_owned).to_vec(),
        false => file.joint_names(),
    };
    let robot = motors.then(|| file.robot());
    let coordinate = |j: usize| robot.as_ref()?.transmission().coordinate_kind(j);
    for (j, name) in names.iter().enumerate() {
        let (p, t) = (by.position_from[j], by.torque_from[j]);
        let (pf, tf) = (by.position_factor[j], by.torque_factor[j]);
        if p == j && t == j && pf == 1.0 && tf == 1.0 && by.zero[j] == 0.0 {
            continue;
        }
        let declared = Declared::of(file, name, motors);
        if motors {
            let of = |k: usize| {
                file.log
                    .actuator
                    .get(&names[k])
                    .cloned()
                    .unwrap_or_default()
            };
            let c = out.log.actuator.entry(name.clone()).or_default();
            if p != j {
                c.position = of(p).position.or(Some(ColumnName(names[p].clone())));
            }
            if t != j {
                c.volts = of(t).volts.or(Some(ColumnName(format!("u_{}", t + 1))));
            }
            if pf < 0.0 {
                c.position_sign = Some(-declared.position_sign);
            }
            if pf.abs() != 1.0 {
                let kind = coordinate(j).unwrap_or(JointKind::Prismatic);
                match other_unit(c.position_unit, kind, pf.abs()) {
                    Some(unit) => c.position_unit = Some(unit),
                    None => c.position_scale = Some(declared.position_scale * pf.abs()),
                }
            }
            if tf < 0.0 {
                c.volts_sign = Some(-declared.torque_sign);
            }
            if tf.abs() != 1.0 {
                c.volts_scale = Some(declared.torque_scale * tf.abs());
            }
            if by.zero[j] != 0.0 {
                c.home = Some(declared.offset + by.zero[j]);
            }
            continue;
        }
        let of = |k: usize| file.log.joint.get(&names[k]).cloned().unwrap_or_default();
        let column = |k: usize, prefix: &str| Some(ColumnName(format!("{prefix}_{}", names[k])));
        let c = out.log.joint.entry(name.clone()).or_default();
        if p != j {
            c.position = of(p).position.or(column(p, "q"));
            // one that the file does not name is optional, and the log may have none
            c.velocity = of(p).velocity;
            c.reference = of(p).reference;
        }
        if t != j {
            c.torque = of(t).torque.or(column(t, "tau"));
        }
        if p != j && p == t {
            c.name = of(p).name.or(Some(names[p].clone()));
        }
        if pf < 0.0 {
            c.position_sign = Some(-declared.position_sign);
        }
        if pf.abs() != 1.0 {
            match other_unit(c.position_unit, file.joint_kind(j), pf.abs()) {
                Some(unit) => c.position_unit = Some(unit),
                None => c.position_scale = Some(declared.position_scale * pf.abs()),
            }
        }
        if by.zero[j] != 0.0 {
            c.position_offset = Some(declared.offset + by.zero[j]);
        }
        if tf < 0.0 {
            c.torque_sign = Some(-declared.torque_sign);
        }
        if tf.abs() != 1.0 {
            c.torque_scale = Some(declared.torque_scale * tf.abs());
        }
    }
    out
}

/// The unit that a position is in, where a factor is that of units.
fn other_unit(now: Option<PositionUnit>, kind: JointKind, factor: f64) -> Option<PositionUnit> {
    let near = |x: f64| (factor / x - 1.0).abs() < 1e-9;
    let si = match kind {
        JointKind::Revolute => PositionUnit::Radian,
        JointKind::Prismatic => PositionUnit::Metre,
    };
    match now.unwrap_or(si) {
        PositionUnit::Radian if near(1.0_f64.to_radians()) => Some(PositionUnit::Degree),
        PositionUnit::Degree if near(1.0_f64.to_degrees()) => Some(PositionUnit::Radian),
        PositionUnit::Metre if near(1e-3) => Some(PositionUnit::Millimetre),
        PositionUnit::Millimetre if near(1e3) => Some(PositionUnit::Metre),
        _ => None,
    }
}

/// The keys by which the corrected file differs from the given one.
pub(super) fn edits(file: &RobotFile, by: &Correction, motors: bool) -> Vec<Edit> {
    let new = corrected(file, by, motors);
    let mut out = Vec::new();
    if let Some(g) = new.robot.gravity.filter(|g| Some(*g) != file.robot.gravity) {
        out.push(Edit::new(&["robot", "gravity"], g.to_vec()));
    }
    differences("joint", &new.log.joint, &file.log.joint, &mut out);
    differences("actuator", &new.log.actuator, &file.log.actuator, &mut out);
    out
}

pub(super) fn differences<T: serde::Serialize>(
    table: &str,
    new: &std::collections::BTreeMap<String, T>,
    old: &std::collections::BTreeMap<String, T>,
    out: &mut Vec<Edit>,
) {
    let keys = |of: Option<&T>| -> toml::Table {
        of.and_then(|of| toml::Table::try_from(of).ok())
            .unwrap_or_default()
    };
    for (name, channels) in new {
        let before = keys(old.get(name));
        for (key, value) in keys(Some(channels)) {
            if before.get(&key) != Some(&value) {
                out.push(Edit::new(&["log", table, name, &key], value));
            }
        }
    }
}
