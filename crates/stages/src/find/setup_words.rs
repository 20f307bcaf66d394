//! What a search of the set-up found, as the user reads it.

mod weights;

use crate::input::robot_setup::RobotSetup;
use crate::input::setup_file::ChannelTables;
use crate::setup::{
    Alternative, Cause, Change, ChannelKind, Correction, DecidedBy, Drive, Finding, FindingKind,
    FindingSeverity, Found, FoundTorqueLimit, FrictionPower, LIMITS, Problem, Searched, Setting,
    SetupErrors, SetupEstimate, SetupReport, Undecided,
};
use ChannelKind::{Position, Torque};
use cft_ident_core::number::{percent, significant};

/// The entries of the key `setup`, and the joints whose friction drives them.
pub(crate) fn report(setup: &RobotSetup, problem: &Problem, searched: &Searched) -> SetupReport {
    let motors = problem.channels.drive == Drive::Motors;
    let declared = ChannelTables::new(&setup.file, motors);
    let words = SetupWords {
        joints: setup.robot.joint_names(),
        names: declared.names(),
        declared,
        gravity: setup.robot.tree().gravity(),
    };
    let found = searched.found.iter();
    let mut findings: Vec<Finding> = found.flat_map(|found| words.findings(found)).collect();
    let estimate = searched.estimate.as_ref();
    findings.extend(estimate.map(|(estimate, errors)| words.estimate(estimate, errors)));
    findings.extend(words.weight(&searched.weights, searched.without_gravity.as_ref()));
    findings.extend(words.limits(problem).filter(|_| !motors));
    findings.extend(searched.undecided.iter().map(|u| words.undecided(u)));
    let power = |driven: &crate::setup::Driven| {
        FrictionPower {
        joint: words.joints[driven.joint].clone(),
        power: driven.power,
        std: driven.std,
        unit: power_unit(setup, driven.joint),
        cause: "the sign of its torque or position may be turned, or the model lacks a torque that grows with speed; compare the robot file with the machine".to_owned(),
    }
    };
    let limit = |of: &crate::setup::UndeliveredTorque| FoundTorqueLimit {
        joint: words.joints[of.joint].clone(),
        // what is printed is what is declared
        limit: significant(of.level, 3).parse().unwrap_or(of.level),
        unit: setup.file.torque_unit(of.joint).to_owned(),
        share: of.beyond,
        errors: of.errors,
    };
    SetupReport {
        torque_limits: searched.undelivered.iter().map(limit).collect(),
        friction_power: searched.driven.iter().map(power).collect(),
        findings,
    }
}

/// Unit of a torque times a speed: where the torque is a current it is no power.
fn power_unit(setup: &RobotSetup, joint: usize) -> String {
    match setup.file.torque_unit(joint) {
        "N" | "Nm" => "W".to_owned(),
        other => format!(
            "{other} {}/s",
            setup.robot.joint_kind(joint).position_unit()
        ),
    }
}

struct SetupWords<'a> {
    declared: ChannelTables<'a>,
    joints: &'a [String],
    /// Channels.
    names: Vec<String>,
    gravity: [f64; 3],
}

/// A single change as it is written.
struct ChangeWords {
    entry: Alternative,
    declared: Setting,
    meaning: String,
}

impl SetupWords<'_> {
    /// One entry for each joint whose sign or scale is wrong.
    fn findings(&self, found: &Found) -> Vec<Finding> {
        let tied = found.tied.iter().take(3);
        let tied_with: Vec<Alternative> = tied.map(|change| self.said(change).entry).collect();
        let conditions = found.conditions.iter();
        let decided_by: Vec<DecidedBy> = conditions.map(|c| c.reported(self.joints)).collect();
        let finding = |change: Change| {
            let said = self.said(&change);
            let begin = if found.open {
                "these data cannot tell: perhaps "
            } else {
                ""
            };
            let mut meaning = format!("{begin}{}{}", said.meaning, self.missed(found));
            if let Some(experiment) = experiment(found, |j| &self.names[j]) {
                meaning += &experiment;
            }
            let values = [said.declared, said.entry.found];
            let remedy = said.entry.remedy;
            let plain = Finding::new(
                said.entry.kind,
                said.entry.joint,
                values,
                meaning,
                remedy,
                found.sure,
            );
            Finding {
                channel: said.entry.channel,
                severity: match found.open {
                    true => FindingSeverity::Hint,
                    false => plain.severity,
                },
                with: said.entry.with,
                tied_with: tied_with.clone(),
                decided_by: decided_by.clone(),
                ..self.with_errors(&found.errors, plain)
            }
        };
        found.change.single().into_iter().map(finding).collect()
    }

    /// An entry with the errors of each joint that moves; a rise that no block bears out is none.
    fn with_errors(&self, [before, after]: &[Vec<f64>; 2], finding: Finding) -> Finding {
        let pairs = self.joints.iter().zip(before.iter().zip(after));
        let near = |b: f64, a: f64| {
            if a <= b * (1.0 + LIMITS.same) {
                a.min(b)
            } else {
                a
            }
        };
        let joints = pairs.filter(|(_, (_, after))| **after > 0.0);
        let of = |(joint, (before, after)): (&String, (&f64, &f64))| SetupErrors {
            joint: joint.clone(),
            before: before.is_finite().then_some(*before),
            after: near(*before, *after),
        };
        Finding {
            error_before: overall(before),
            error_after: overall(after),
            joints: joints.map(of).collect(),
            ..finding
        }
    }

    /// What is said of a change.
    fn said(&self, change: &Change) -> ChangeWords {
        let name = |j: &usize| self.names[*j].clone();
        let one = |joints: &[usize]| match joints {
            [j] => Some(name(j)),
            _ => None,
        };
        let joints = |of: &[usize]| of.iter().map(name).collect::<Vec<_>>().join(", ");
        let number = |j: &usize, channel: ChannelKind, of: &str| {
            self.declared.number(&self.names[*j], channel == Torque, of)
        };
        let names = |of: [&usize; 2]| Setting::Names(of.map(name).to_vec());
        use FindingKind::{Gravity, Order, Scale, Sign, Zero};
        let both = Some(ChannelKind::Both);
        let (kind, channel, joint, with, values, meaning) = match change {
            Change::Scale(channel, of, f) => {
                let sign = *f == -1.0;
                let value = of.first().map_or(1.0, |j| {
                    number(j, *channel, if sign { "sign" } else { "scale" })
                });
                let meaning = match sign {
                    true => format!(
                        "the {} of {} has the other sign",
                        word(*channel),
                        joints(of)
                    ),
                    false => format!(
                        "the {} of {} is {} times what is declared",
                        word(*channel),
                        joints(of),
                        significant(*f, 4)
                    ),
                };
                let kind = if sign { Sign } else { Scale };
                let values = [value, value * f].map(Setting::Number);
                (kind, Some(*channel), one(of), None, values, meaning)
            }
            Change::Exchange(channel, a, b) => {
                let of = match channel {
                    ChannelKind::Both => String::new(),
                    channel => format!("the {}s of ", word(*channel)),
                };
                let meaning = format!("{of}{} and {} have changed places", name(a), name(b));
                let values = [names([a, b]), names([b, a])];
                (
                    Order,
                    Some(*channel),
                    Some(name(a)),
                    Some(name(b)),
                    values,
                    meaning,
                )
            }
            Change::Reverse => {
                let reversed = self.names.iter().rev().cloned().collect();
                let values = [self.names.clone(), reversed].map(Setting::Names);
                let meaning = "the joints are listed from the tip to the base".to_owned();
                (Order, both, None, None, values, meaning)
            }
            Change::Zero(j, angle) => {
                let offset = number(j, Position, "offset");
                let meaning = format!(
                    "the zero of {} is off by {} degrees",
                    name(j),
                    significant(angle.to_degrees(), 3)
                );
                let values = [offset, offset + angle].map(Setting::Number);
                (Zero, Some(Position), Some(name(j)), None, values, meaning)
            }
            Change::Gear(j, ratio) => {
                let meaning = format!(
                    "{} is logged on the motor's side of a gear of {}, position and torque",
                    name(j),
                    significant(*ratio, 4)
                );
                (
                    Scale,
                    both,
                    Some(name(j)),
                    None,
                    [1.0, *ratio].map(Setting::Number),
                    meaning,
                )
            }
            Change::Gravity(g) => {
                let meaning = format!(
                    "free fall is along ({}) in the base frame",
                    g.map(|x| significant(x, 3)).join(", ")
                );
                (
                    Gravity,
                    None,
                    None,
                    None,
                    [self.gravity, *g].map(Setting::Vector),
                    meaning,
                )
            }
            Change::Velocity(j, _) => {
                let meaning = format!("the position of {} is its velocity", name(j));
                let values = ["position", "velocity"].map(|of| Setting::Names(vec![of.to_owned()]));
                (Order, Some(Position), Some(name(j)), None, values, meaning)
            }
            Change::Two(a, _) => return self.said(a),
        };
        let [declared, found] = values;
        let remedy = self.remedy(change);
        ChangeWords {
            entry: Alternative {
                kind,
                channel,
                joint,
                with,
                found,
                remedy,
            },
            declared,
            meaning,
        }
    }

    /// The lines to write into the robot file.
    fn remedy(&self, change: &Change) -> String {
        if let Change::Velocity(j, _) = change {
            return format!(
                "the column of positions in `position = ..` in [log.joint.{}]",
                self.names[*j]
            );
        }
        let edits = self
            .declared
            .edits(&Correction::none(self.names.len()).with(change));
        let line = |edit: &cft_ident_files::config::correction::KeyEdit| {
            format!("`{}` in {}", edit.line(), edit.table())
        };
        edits.iter().map(line).collect::<Vec<_>>().join(", ")
    }

    /// What the model misses, as declared and put right.
    fn missed(&self, found: &Found) -> String {
        let [before, after] = &found.errors;
        let joints = |of: &[usize]| {
            let names = of.iter().map(|j| self.joints[*j].as_str());
            names.collect::<Vec<_>>().join(", ")
        };
        let right = overall(after).map(percent).unwrap_or_default();
        let Some(declared) = overall(before) else {
            return format!(
                ": as declared the positions belong to no pose of the robot, with that put right the model misses {right} of the torque"
            );
        };
        let pairs = self.joints.iter().zip(before.iter().zip(after));
        let changed = pairs.filter(|(_, (b, a))| **a < **b * (1.0 - LIMITS.same));
        let each: Vec<String> = changed
            .map(|(joint, (b, a))| format!("{joint} {} -> {}", percent(*b), percent(*a)))
            .collect();
        if !found.beyond_limits.is_empty() {
            return format!(
                ": as declared the positions of {} go beyond the limits in the robot file, with that put right none do; the model misses {} of the torque as declared and {right} with it",
                joints(&found.beyond_limits),
                percent(declared)
            );
        }
        let each = match each.is_empty() {
            true => ", and friction drives no joint any more".to_owned(),
            false => format!(" ({})", each.join(", ")),
        };
        format!(
            ": as declared the model misses {} of the torque, with that put right {right}{each}",
            percent(declared)
        )
    }

    /// A value that is on no list.
    fn estimate(&self, estimate: &SetupEstimate, errors: &[Vec<f64>; 2]) -> Finding {
        let said = self.said(&estimate.change);
        let joint = said.entry.joint.clone();
        let [before, after] = errors
            .each_ref()
            .map(|e| overall(e).map(percent).unwrap_or_default());
        let angle = matches!(estimate.change, Change::Zero(..) | Change::Gravity(_));
        let shown = |x: f64| match angle {
            true => format!("{} degrees", significant(x.to_degrees(), 3)),
            false => significant(x, 4),
        };
        let value = shown(estimate.value);
        let what = match (&estimate.change, &joint) {
            (Change::Gear(..), Some(joint)) => {
                format!("{joint} fits a motor behind a gear of {value}, position and torque")
            }
            (Change::Zero(..), Some(joint)) => {
                format!("{joint} fits a zero that is off by {value}")
            }
            (Change::Scale(channel, ..), Some(joint)) => {
                format!("{joint} fits {value} times the {}", word(*channel))
            }
            _ => format!(
                "the torques fit a base that leans by {value}, {}",
                said.meaning
            ),
        };
        let [low, high] = estimate.interval_95;
        let meaning = format!(
            "{what} (95 % CI {} to {}; error {before} as declared, {after} with it): an estimate and no mistake of a list; compare it with the machine",
            shown(low),
            shown(high)
        );
        let values = match angle {
            true => [0.0, estimate.value],
            false => [1.0, estimate.value],
        };
        Finding {
            channel: said.entry.channel,
            found_std: Some((high - low) / 3.92),
            ..self.with_errors(
                errors,
                hint(said.entry.kind, joint, values.map(Setting::Number), meaning),
            )
        }
    }

    /// A joint that misses much, and why these data do not say why.
    fn undecided(&self, of: &Undecided) -> Finding {
        let joint = &self.joints[of.joint];
        let why = match of.cause {
            Cause::Proportion(other, ratio) => apart([joint, &self.joints[other]], Some(ratio)),
            Cause::Alone => "one axis alone does not show which of its channels is wrong: a log in which other joints move too, or one with a known weight, tells".to_owned(),
            Cause::Friction(share) => format!(
                "{} of it is friction, which hides signs, zeros and masses: faster motion or a known weight tells",
                percent(share)
            ),
            Cause::Other => "an effect that the model lacks, such as a coupling of wrist gears (`diagnose` looks for it), or several mistakes: logs of each joint alone tell".to_owned(),
        };
        let meaning = format!(
            "these data cannot tell whether the set-up of {joint} is right: the model misses {} of its torque, and no mistake of the list repairs it in all parts of the logs; {why}",
            percent(of.error)
        );
        let values = [0.0, of.error].map(Setting::Number);
        hint(FindingKind::Undecided, Some(joint.clone()), values, meaning)
    }
}

/// What distinguishes readings that fit alike.
fn experiment<'a>(found: &Found, name: impl Fn(usize) -> &'a String) -> Option<String> {
    if let Some([a, b]) = found.together {
        return Some(format!("; {}", apart([name(a), name(b)], None)));
    }
    if found.sure || found.tied.is_empty() {
        return None;
    }
    let scale = |c: &Change| {
        matches!(c, Change::Scale(_, _, f) if *f != -1.0) || matches!(c, Change::Gear(..))
    };
    Some(match scale(&found.change) && found.tied.iter().all(scale) {
        true => "; the data sheet of the gear tells which ratio it is".to_owned(),
        false => "; a log in which these joints move one after the other, each through gravity, tells which reading is right".to_owned(),
    })
}

fn apart([a, b]: [&String; 2], ratio: Option<f64>) -> String {
    let how = ratio.map_or(String::new(), |r| {
        format!(" ({a} = {} {b})", significant(r, 3))
    });
    format!(
        "{a} and {b} move in proportion in these logs{how}, so that their signs, units and places cannot be told apart: a log in which they move apart tells"
    )
}

/// A word on these data, which is no fault.
fn hint(
    kind: FindingKind,
    joint: Option<String>,
    values: [Setting; 2],
    meaning: String,
) -> Finding {
    Finding {
        severity: FindingSeverity::Hint,
        ..Finding::new(kind, joint, values, meaning, String::new(), false)
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
        Torque => "torque",
        Position => "position",
        ChannelKind::Both => "channel",
    }
}
