//! What a search of the set-up found, as the user reads it.

use super::logged_robot::LoggedRobot;
use super::setup_file::{Declared, edits};
use crate::setup::{
    Alternative, Change, ChannelKind, Correction, Drive, Factor, Finding, FindingKind,
    FindingSeverity, Found, FrictionPower, LIMITS, Problem, Searched, Setting, SetupErrors,
    SetupReport, Weight,
};
use cft_ident_core::number;
use cft_ident_core::robot::cft::COORDINATES;
use cft_ident_files::config::RobotFile;

/// The entries of the key `setup`, and the joints whose friction drives them.
pub(super) fn report(machine: &LoggedRobot, problem: &Problem, searched: &Searched) -> SetupReport {
    let motors = problem.channels.drive == Drive::Motors;
    let joints = machine.robot.joint_names();
    let words = Words {
        file: &machine.file,
        joints,
        names: match motors {
            true => COORDINATES.map(str::to_owned).to_vec(),
            false => joints.to_vec(),
        },
        motors,
        gravity: machine.robot.tree().gravity(),
    };
    let mut findings: Vec<Finding> = (searched.found.iter())
        .flat_map(|found| words.findings(found))
        .collect();
    findings.extend(
        searched
            .factor
            .iter()
            .map(|(factor, errors)| words.factor(factor, errors)),
    );
    findings.extend(words.weight(&searched.weights, searched.without_gravity.as_ref()));
    findings.extend(words.limits(problem));
    let power = |driven: &crate::setup::Driven| {
        FrictionPower {
        joint: joints[driven.joint].clone(),
        power: driven.power,
        std: driven.std,
        unit: power_unit(machine, driven.joint),
        cause: "the sign of its torque or position may be turned, or the model lacks a torque that grows with speed; compare the robot file with the machine".to_owned(),
    }
    };
    SetupReport {
        findings,
        friction_power: searched.driven.iter().map(power).collect(),
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

struct Words<'a> {
    file: &'a RobotFile,
    joints: &'a [String],
    /// Channels.
    names: Vec<String>,
    motors: bool,
    gravity: [f64; 3],
}

impl Words<'_> {
    /// One entry for each joint whose sign or scale is wrong.
    fn findings(&self, found: &Found) -> Vec<Finding> {
        let split = |change: &Change| -> Vec<Change> {
            match change {
                Change::Sign(channel, joints) => (joints.iter())
                    .map(|j| Change::Sign(*channel, vec![*j]))
                    .collect(),
                Change::Scale(channel, joints, f) => (joints.iter())
                    .map(|j| Change::Scale(*channel, vec![*j], *f))
                    .collect(),
                other => vec![other.clone()],
            }
        };
        let tied: Vec<Alternative> = found
            .tied
            .iter()
            .take(3)
            .map(|c| self.alternative(c))
            .collect();
        let [before, after] = found.errors.each_ref().map(|e| overall(e));
        let finding = |change: Change| {
            let (kind, channel, joint, with) = self.place(&change);
            let (declared, value) = self.values(&change);
            Finding {
                channel,
                with,
                error_before: before,
                error_after: after,
                joints: self.errors(&found.errors),
                tied_with: tied.clone(),
                ..Finding::new(
                    kind,
                    joint,
                    [declared, value],
                    self.meaning(&change, found),
                    self.remedy(&change),
                    found.sure,
                )
            }
        };
        let single = found.change.single();
        single.into_iter().flat_map(split).map(finding).collect()
    }

    /// Errors of each joint that moves, rounded to what thinned rows resolve.
    fn errors(&self, [before, after]: &[Vec<f64>; 2]) -> Vec<SetupErrors> {
        let pairs = self.joints.iter().zip(before.iter().zip(after));
        pairs
            .filter(|(_, (_, after))| **after > 0.0)
            .map(|(joint, (before, after))| SetupErrors {
                joint: joint.clone(),
                before: before.is_finite().then_some(*before),
                // what no block bears out is no rise
                after: match *after <= *before * (1.0 + LIMITS.same) {
                    true => after.min(*before),
                    false => *after,
                },
            })
            .collect()
    }

    /// A word on these data, which is no fault.
    fn word(
        &self,
        (kind, channel, joint): (FindingKind, Option<ChannelKind>, Option<String>),
        values: [Setting; 2],
        meaning: String,
        severity: FindingSeverity,
    ) -> Finding {
        Finding {
            channel,
            severity,
            ..Finding::new(kind, joint, values, meaning, String::new(), false)
        }
    }

    /// A factor that is on no list.
    fn factor(&self, factor: &Factor, errors: &[Vec<f64>; 2]) -> Finding {
        let joint = &self.names[factor.joint];
        let [low, high] = factor.interval_95.map(|x| number::significant(x, 4));
        let channel = match factor.channel {
            ChannelKind::Both => "the position of a motor behind a gear and its torque, ratio",
            channel => word(channel),
        };
        let [before, after] = errors.each_ref().map(|e| number::percent(e[factor.joint]));
        let meaning = format!(
            "{joint} fits {} times the {channel} (95 % CI {low} to {high}; error of {joint} {before} as declared, {after} with it): an estimate and no unit or ratio of a list; compare the gain of this channel with the machine",
            number::significant(factor.value, 4)
        );
        let place = (
            FindingKind::Scale,
            Some(factor.channel),
            Some(joint.clone()),
        );
        Finding {
            found_std: Some((factor.interval_95[1] - factor.interval_95[0]) / 3.92),
            error_before: overall(&errors[0]),
            error_after: overall(&errors[1]),
            joints: self.errors(errors),
            ..self.word(
                place,
                [1.0, factor.value].map(Setting::Number),
                meaning,
                FindingSeverity::Hint,
            )
        }
    }

    /// What the file's own masses say of the torques, and whether they hold a weight at all.
    fn weight(&self, weights: &[Weight], without: Option<&[Vec<f64>; 2]>) -> Vec<Finding> {
        let told: Vec<&Weight> = weights
            .iter()
            .filter(|w| w.share > LIMITS.doubtful)
            .collect();
        let below = |w: &&&Weight| w.interval_95[1] * LIMITS.yardstick < 1.0;
        let gravity = [self.gravity, [0.0; 3]].map(Setting::Vector);
        let of_masses = !told.is_empty() && told.iter().filter(below).count() == told.len();
        if let Some(errors) = without {
            let none = told.iter().all(|w| w.gain.abs() * LIMITS.yardstick < 1.0);
            let (severity, meaning) = match !told.is_empty() && none {
                true => (
                    FindingSeverity::Warning,
                    "gravity is not in these torques, though the file's own masses ask for it: a driver that takes it off?",
                ),
                false if told.is_empty() => (
                    FindingSeverity::Hint,
                    "gravity hardly shows in these torques: balanced, or taken off by the driver; `gravity = [0.0, 0.0, 0.0]` fits as well with fewer parameters",
                ),
                false => return Vec::new(),
            };
            let mut finding = Finding {
                error_before: overall(&errors[0]),
                error_after: overall(&errors[1]),
                joints: self.errors(errors),
                ..self.word(
                    (FindingKind::Gravity, None, None),
                    gravity,
                    meaning.to_owned(),
                    severity,
                )
            };
            if severity == FindingSeverity::Warning {
                finding.remedy = self.remedy(&Change::Gravity([0.0; 3]));
            }
            return vec![finding];
        }
        let above = |w: &&&Weight| w.interval_95[0] > LIMITS.yardstick;
        let all_above = !told.is_empty() && told.iter().filter(above).count() == told.len();
        if !of_masses && !all_above {
            return Vec::new();
        }
        let of = |w: &&Weight| {
            let [low, high] = w.interval_95.map(|x| number::significant(x, 3));
            let gain = number::significant(w.gain, 3);
            format!(
                "{} {gain} times (95 % CI {low} to {high})",
                self.joints[w.joint]
            )
        };
        let list: Vec<String> = told.iter().map(of).collect();
        let meaning = format!(
            "the torques show another weight than the masses of the robot file: {}; is the channel a current, a percentage, the motor's side of a gear, or in another unit?",
            list.join(", ")
        );
        let mean = told.iter().map(|w| w.gain).sum::<f64>() / told.len() as f64;
        let values = [1.0, mean].map(Setting::Number);
        let place = (FindingKind::Scale, Some(ChannelKind::Torque), None);
        vec![self.word(place, values, meaning, FindingSeverity::Warning)]
    }

    /// Torques beyond what the file says the joints can have.
    fn limits(&self, problem: &Problem) -> Option<Finding> {
        let sample = &problem.sample;
        let rms = sample.rms(&sample.tau);
        let beyond = |j: &usize| {
            let most = problem.known.torque.get(*j).copied().flatten();
            !self.motors && most.is_some_and(|most| rms[*j] > LIMITS.yardstick * most)
        };
        let joints: Vec<usize> = (0..rms.len()).filter(beyond).collect();
        let first = *joints.first()?;
        let most = problem.known.torque[first]?;
        let names: Vec<&str> = joints.iter().map(|j| self.names[*j].as_str()).collect();
        let meaning = format!(
            "the torque of {} is beyond its limit in the robot file ({}: {} on average, limit {}): another unit, such as mNm?",
            names.join(", "),
            names[0],
            number::significant(rms[first], 3),
            number::significant(most, 3)
        );
        let joint = (joints.len() == 1).then(|| names[0].to_owned());
        let place = (FindingKind::Scale, Some(ChannelKind::Torque), joint);
        Some(Finding {
            remedy: self.remedy(&Change::Scale(ChannelKind::Torque, joints, 1e-3)),
            ..self.word(
                place,
                [1.0, 1e-3].map(Setting::Number),
                meaning,
                FindingSeverity::Warning,
            )
        })
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
            Change::Gear(j, _) => (FindingKind::Scale, Some(ChannelKind::Both), name(j), None),
            Change::Two(a, _) => self.place(a),
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
            Change::Gear(_, ratio) => (Setting::Number(1.0), Setting::Number(*ratio)),
            Change::Two(a, _) => self.values(a),
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
            Change::Gear(j, ratio) => format!(
                "{} is logged on the motor's side of a gear of {}, position and torque",
                joint(j),
                number::significant(*ratio, 4)
            ),
            Change::Two(a, _) => return self.meaning(a, found),
            Change::Gravity(g) => format!(
                "free fall is along ({}) in the base frame",
                g.map(|x| number::significant(x, 3)).join(", ")
            ),
        };
        let [before, after] = found
            .errors
            .each_ref()
            .map(|e| overall(e).map(number::percent));
        match (before, after) {
            (Some(before), Some(after)) => format!(
                "{what}: as declared the model misses {before} of the torque, with that put right {after}{}",
                self.by_joint(&found.errors)
            ),
            (_, after) => format!(
                "{what}: as declared the positions belong to no pose of the robot, with that put right the model misses {} of the torque",
                after.unwrap_or_default()
            ),
        }
    }

    /// Errors of the joints that change.
    fn by_joint(&self, [before, after]: &[Vec<f64>; 2]) -> String {
        let pairs = self.joints.iter().zip(before.iter().zip(after));
        let changed = pairs.filter(|(_, (b, a))| **a < **b * (1.0 - LIMITS.same));
        let each: Vec<String> = changed
            .map(|(joint, (b, a))| {
                format!("{joint} {} -> {}", number::percent(*b), number::percent(*a))
            })
            .collect();
        match each.is_empty() {
            true => ", and friction drives no joint any more".to_owned(),
            false => format!(" ({})", each.join(", ")),
        }
    }
}

/// Root mean square over the joints that move.
fn overall(errors: &[f64]) -> Option<f64> {
    let moving: Vec<f64> = errors.iter().copied().filter(|e| *e != 0.0).collect();
    let mean = moving.iter().map(|e| e * e).sum::<f64>() / moving.len().max(1) as f64;
    mean.is_finite().then(|| mean.sqrt())
}

fn word(channel: ChannelKind) -> &'static str {
    match channel {
        ChannelKind::Torque => "torque",
        ChannelKind::Position => "position",
        ChannelKind::Both => "channel",
    }
}
