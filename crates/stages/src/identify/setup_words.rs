//! What a search of the set-up found, as the user reads it and as the robot file has it.

use super::log::Log;
use super::logged_robot::LoggedRobot;
use crate::setup::{
    Alternative, Change, ChannelKind, Correction, Drive, Evidence, Finding, FindingKind,
    FindingSeverity, Found, FrictionPower, Hint, Problem, Searched, Setting, SetupReport, Small,
};
use cft_ident_core::number;
use cft_ident_core::robot::JointKind;
use cft_ident_core::robot::cft::COORDINATES;
use cft_ident_files::config::RobotFile;
use cft_ident_files::config::correction::Edit;
use cft_ident_logs::log::{ActuatorChannels, ColumnName, JointChannels, PositionUnit};

/// The entries of the key `setup`, and the joints whose friction drives them.
pub(super) fn report(
    machine: &LoggedRobot,
    logs: &[Log],
    problem: &Problem,
    searched: &Searched,
) -> SetupReport {
    let words = Words {
        file: &machine.file,
        names: match problem.channels.drive {
            Drive::Motors => COORDINATES.map(str::to_owned).to_vec(),
            _ => machine.robot.joint_names().to_vec(),
        },
        motors: problem.channels.drive == Drive::Motors,
        gravity: machine.robot.tree().gravity(),
    };
    let findings = searched
        .found
        .iter()
        .flat_map(|found| words.findings(found))
        .chain(searched.hint.iter().map(|hint| words.hint(hint, logs)))
        .collect();
    let power = |negative: &crate::setup::Negative| FrictionPower {
        joint: machine.robot.joint_names()[negative.joint].clone(),
        power: negative.power,
        std: negative.std,
        unit: power_unit(machine, negative.joint),
        cause: cause(problem, negative.joint).to_owned(),
    };
    SetupReport {
        findings,
        friction_power: searched.negative.iter().map(power).collect(),
    }
}

/// Unit of a torque times a speed: where the torque is a current it is no power.
fn power_unit(machine: &LoggedRobot, joint: usize) -> String {
    match machine.file.torque_unit(joint) {
        "N" | "Nm" => "W".to_owned(),
        other => format!(
            "{other} {}/s",
            machine.robot.joint_kind(joint).position_unit()
        ),
    }
}

/// Why a friction may come out negative.
fn cause(problem: &Problem, joint: usize) -> &'static str {
    match problem.tells_friction(joint) {
        false => {
            "the log has too few reversals or speeds to tell friction from a constant torque; log the joint at several speeds in both directions"
        }
        true => {
            "the sign of its torque or position may be turned, or the model lacks a torque that grows with speed; compare the robot file with the machine"
        }
    }
}

struct Words<'a> {
    file: &'a RobotFile,
    names: Vec<String>,
    motors: bool,
    gravity: [f64; 3],
}

impl Words<'_> {
    /// One entry for each joint whose sign or scale is wrong.
    fn findings(&self, found: &Found) -> Vec<Finding> {
        let split = |change: &Change| -> Vec<Change> {
            match change {
                Change::Sign(channel, joints) => joints
                    .iter()
                    .map(|j| Change::Sign(*channel, vec![*j]))
                    .collect(),
                Change::Scale(channel, joints, f) => joints
                    .iter()
                    .map(|j| Change::Scale(*channel, vec![*j], *f))
                    .collect(),
                other => vec![other.clone()],
            }
        };
        let tied: Vec<Alternative> = found
            .tied
            .iter()
            .map(|change| self.alternative(change))
            .collect();
        let finding = |change: Change| {
            let (kind, channel, joint, with) = self.place(&change);
            let (declared, value) = self.values(&change);
            Finding {
                kind,
                channel,
                joint,
                with,
                declared,
                found: value,
                found_std: found.std,
                error_before: found.error[0].is_finite().then_some(found.error[0]),
                error_after: Some(found.error[1]),
                remedy: self.remedy(&change),
                severity: match found.sure {
                    true => FindingSeverity::Error,
                    false => FindingSeverity::Warning,
                },
                sure: found.sure,
                evidence: Evidence {
                    held_out_gain: found.gain,
                    needed: found.needed,
                    tried: found.tried,
                    violated_before: found.violated[0].clone(),
                    violated_after: found.violated[1].clone(),
                },
                tied_with: tied.clone(),
                meaning: self.meaning(&change, found),
            }
        };
        split(&found.change).into_iter().map(finding).collect()
    }

    /// A small thing, which is no fault.
    fn hint(&self, hint: &Hint, logs: &[Log]) -> Finding {
        let names: Vec<String> = logs.iter().map(Log::name).collect();
        let remedy = format!("cft-ident diagnose {} -m MODEL.toml", names.join(" "));
        let (kind, channel, joint, [declared, found]) = self.small(&hint.small);
        let alternative = |small: &Small| {
            let (kind, channel, joint, [_, found]) = self.small(small);
            Alternative {
                kind,
                channel,
                joint,
                with: None,
                found,
                remedy: remedy.clone(),
            }
        };
        let looks = |small: &Small| match small {
            Small::Zero(j, angle, _) => format!(
                "a zero of {} that is off by {} degrees",
                self.names[*j],
                number::significant(angle.to_degrees(), 2)
            ),
            Small::Tilt(g) => {
                let dot = g.iter().zip(&self.gravity).map(|(a, b)| a * b).sum::<f64>();
                let square = |x: &[f64; 3]| x.iter().map(|x| x * x).sum::<f64>();
                let lean = (dot / (square(g) * square(&self.gravity)).sqrt()).acos();
                format!(
                    "a base that leans by {} degrees",
                    number::significant(lean.to_degrees(), 2)
                )
            }
            Small::Delay(late, _) => format!(
                "torques {} ms {} the positions",
                number::significant(1e3 * late.abs(), 2),
                if *late < 0.0 { "ahead of" } else { "behind" }
            ),
        };
        let like: Vec<String> = [&hint.small]
            .into_iter()
            .chain(&hint.tied)
            .map(looks)
            .collect();
        let [before, after] = hint.error.map(number::percent);
        let meaning = format!(
            "the misfit looks like {}: the model misses {before} of the torque without it, {after} with it",
            like.join(", or as well like ")
        );
        Finding {
            channel,
            found_std: match hint.small {
                Small::Zero(_, _, std) | Small::Delay(_, std) => Some(std),
                Small::Tilt(_) => None,
            },
            error_before: Some(hint.error[0]),
            error_after: Some(hint.error[1]),
            severity: FindingSeverity::Hint,
            evidence: Evidence {
                held_out_gain: hint.gain,
                needed: hint.needed,
                tried: hint.tried,
                ..Evidence::default()
            },
            tied_with: hint.tied.iter().map(alternative).collect(),
            ..Finding::new(
                kind,
                joint,
                [declared, found],
                meaning,
                remedy.clone(),
                false,
            )
        }
    }

    /// Kind, channel, joint, and what is declared and found.
    fn small(
        &self,
        small: &Small,
    ) -> (
        FindingKind,
        Option<ChannelKind>,
        Option<String>,
        [Setting; 2],
    ) {
        match small {
            Small::Zero(j, angle, _) => {
                let offset = Declared::of(self.file, &self.names[*j], self.motors).offset;
                (
                    FindingKind::Zero,
                    Some(ChannelKind::Position),
                    Some(self.names[*j].clone()),
                    [offset, offset + angle].map(Setting::Number),
                )
            }
            Small::Tilt(g) => (
                FindingKind::Gravity,
                None,
                None,
                [self.gravity, *g].map(Setting::Vector),
            ),
            Small::Delay(late, _) => (
                FindingKind::Delay,
                Some(ChannelKind::Torque),
                None,
                [0.0, *late].map(Setting::Number),
            ),
        }
    }

    fn alternative(&self, change: &Change) -> Alternative {
        let (kind, channel, joint, with) = self.place(change);
        Alternative {
            kind,
            channel,
            joint,
            with,
            found: self.values(change).1,
            remedy: self.remedy(change),
        }
    }

    fn place(
        &self,
        change: &Change,
    ) -> (
        FindingKind,
        Option<ChannelKind>,
        Option<String>,
        Option<String>,
    ) {
        let name = |j: &usize| Some(self.names[*j].clone());
        let one = |joints: &[usize]| match joints {
            [j] => name(j),
            _ => None,
        };
        match change {
            Change::Sign(channel, joints) => (FindingKind::Sign, Some(*channel), one(joints), None),
            Change::Scale(channel, joints, _) => {
                (FindingKind::Scale, Some(*channel), one(joints), None)
            }
            Change::Exchange(channel, a, b) => {
                (FindingKind::Order, Some(*channel), name(a), name(b))
            }
            Change::Reverse => (FindingKind::Order, Some(ChannelKind::Both), None, None),
            Change::Zero(j, _) => (
                FindingKind::Zero,
                Some(ChannelKind::Position),
                name(j),
                None,
            ),
            Change::Gravity(_) => (FindingKind::Gravity, None, None, None),
        }
    }

    /// As declared, and as found.
    fn values(&self, change: &Change) -> (Setting, Setting) {
        use ChannelKind::Torque;
        let of = |j: usize| Declared::of(self.file, &self.names[j], self.motors);
        match change {
            Change::Sign(channel, joints) => {
                let sign = joints.first().map_or(1.0, |j| match channel {
                    Torque => of(*j).torque_sign,
                    _ => of(*j).position_sign,
                });
                (Setting::Number(sign), Setting::Number(-sign))
            }
            Change::Scale(channel, joints, f) => {
                let scale = joints.first().map_or(1.0, |j| match channel {
                    Torque => of(*j).torque_scale,
                    _ => of(*j).position_scale,
                });
                (Setting::Number(scale), Setting::Number(scale * f))
            }
            Change::Exchange(_, a, b) => {
                let (a, b) = (self.names[*a].clone(), self.names[*b].clone());
                (
                    Setting::Names(vec![a.clone(), b.clone()]),
                    Setting::Names(vec![b, a]),
                )
            }
            Change::Reverse => {
                let reversed = self.names.iter().rev().cloned().collect();
                (Setting::Names(self.names.clone()), Setting::Names(reversed))
            }
            Change::Zero(j, angle) => {
                let offset = of(*j).offset;
                (Setting::Number(offset), Setting::Number(offset + angle))
            }
            Change::Gravity(g) => (Setting::Vector(self.gravity), Setting::Vector(*g)),
        }
    }

    /// The lines to write into the robot file.
    fn remedy(&self, change: &Change) -> String {
        let correction = Correction::none(self.names.len()).with(change);
        let edits = edits(self.file, &correction, self.motors);
        let lines: Vec<String> = edits
            .iter()
            .map(|edit| format!("`{}` in {}", edit.line(), edit.table()))
            .collect();
        lines.join(", ")
    }

    fn meaning(&self, change: &Change, found: &Found) -> String {
        let joint = |j: &usize| self.names[*j].clone();
        let joints = |of: &[usize]| of.iter().map(joint).collect::<Vec<_>>().join(", ");
        let what = match change {
            Change::Sign(channel, of) => {
                format!(
                    "the {} of {} has the other sign",
                    word(*channel),
                    joints(of)
                )
            }
            Change::Scale(channel, of, f) => format!(
                "the {} of {} is {} times what is declared",
                word(*channel),
                joints(of),
                number::significant(*f, 4)
            ),
            Change::Exchange(ChannelKind::Both, a, b) => {
                format!("{} and {} have changed places", joint(a), joint(b))
            }
            Change::Exchange(channel, a, b) => format!(
                "the {}s of {} and {} have changed places",
                word(*channel),
                joint(a),
                joint(b)
            ),
            Change::Reverse => "the joints are listed from the tip to the base".to_owned(),
            Change::Zero(j, angle) => format!(
                "the zero of {} is off by {} degrees",
                joint(j),
                number::significant(angle.to_degrees(), 3)
            ),
            Change::Gravity(g) => format!(
                "free fall is along ({}) in the base frame",
                g.map(|x| number::significant(x, 3)).join(", ")
            ),
        };
        let [before, after] = found.error.map(number::percent);
        let mut out = match found.error[0].is_finite() {
            true => format!(
                "{what}: as declared the model misses {before} of the torque, with that put right {after}"
            ),
            false => format!(
                "{what}: as declared the positions belong to no pose of the robot, with that put right the model misses \
                 {after} of the torque"
            ),
        };
        if !found.violated[0].is_empty() && found.violated[1].is_empty() {
            out += &format!(
                "; as declared these are negative: {}",
                found.violated[0].join(", ")
            );
        }
        out
    }
}

fn word(channel: ChannelKind) -> &'static str {
    match channel {
        ChannelKind::Torque => "torque",
        ChannelKind::Position => "position",
        ChannelKind::Both => "channel",
    }
}

/// What the file says of a channel.
struct Declared {
    torque_sign: f64,
    torque_scale: f64,
    position_sign: f64,
    position_scale: f64,
    offset: f64,
}

impl Declared {
    fn of(file: &RobotFile, name: &str, motors: bool) -> Self {
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
