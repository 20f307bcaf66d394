//! The faults, and how each is made from a machine with none.

use serde_json::{Value, json};

use super::fit::rows as entries;
use super::machines::Machine;
use super::robot_text;
use super::rows::{self, Epoch};
use super::table::Table;

/// Which channels of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Torque,
    Position,
    Both,
}

impl Side {
    pub const ALL: [Self; 3] = [Self::Torque, Self::Position, Self::Both];

    pub fn word(self) -> &'static str {
        match self {
            Self::Torque => "torque",
            Self::Position => "position",
            Self::Both => "both",
        }
    }
}

/// One thing that is wrong; joints by their place.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    Sign(Side, Vec<usize>),
    Exchange(Side, usize, usize),
    /// All joints from the tip to the base.
    Reverse,
    /// What is logged, in units of what is declared.
    Scale(Side, Vec<usize>, f64),
    /// The encoder reads this much more \[degrees\].
    Zero(usize, f64),
    /// Gravity as it is declared, where it is (0, 0, -9.81) \[m/s^2\].
    Gravity([f64; 3]),
    /// Currents, and no word on what an ampere is.
    Gains,
    /// Angles with so many decimals; in a URDF, or in the robot file.
    Rounded(usize, bool),
    Wrap(usize),
    /// The position jumps by this \[m or rad\] in the middle of the log.
    Step(usize, f64),
    Hold(usize),
    /// Share of rows at rest \[%\].
    Rest(usize),
    /// Share of rows that are missing \[%\].
    Dropped(usize),
    Epoch(Epoch),
}

/// What the tool is given.
#[derive(Debug, Clone)]
pub struct Given {
    pub robot: toml::Table,
    /// Name and text of a URDF beside it.
    pub urdf: Option<(&'static str, String)>,
    pub logs: Vec<Table>,
    pub epoch: Option<Epoch>,
}

impl Given {
    /// The machine as it is.
    pub fn right(machine: &Machine) -> Self {
        Self {
            robot: machine.robot.clone(),
            urdf: machine.urdf.clone().map(|text| ("arm.urdf", text)),
            logs: machine.logs.clone(),
            epoch: None,
        }
    }
}

impl Fault {
    /// Kind of the fault in the table.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Sign(..) => "sign",
            Self::Exchange(..) => "exchange",
            Self::Reverse => "base and tip",
            Self::Scale(..) => "scale",
            Self::Zero(..) => "zero",
            Self::Gravity(_) => "gravity",
            Self::Gains => "currents",
            Self::Rounded(..) => "rounded angles",
            Self::Wrap(_) => "wrap",
            Self::Step(..) => "step",
            Self::Hold(_) => "hold",
            Self::Rest(_) => "rest",
            Self::Dropped(_) => "dropped rows",
            Self::Epoch(_) => "epoch time",
        }
    }

    /// Name of the case, without its machine.
    pub fn name(&self, machine: &Machine) -> String {
        let joint = |j: &usize| machine.joints[*j].name.as_str();
        let joints = |all: &[usize]| match all.len() {
            1 => joint(&all[0]).to_owned(),
            _ => "all".to_owned(),
        };
        match self {
            Self::Sign(side, of) => format!("sign {} {}", side.word(), joints(of)),
            Self::Exchange(side, a, b) => {
                format!("exchange {} {} {}", side.word(), joint(a), joint(b))
            }
            Self::Reverse => "base and tip".to_owned(),
            Self::Scale(side, of, by) => format!("scale {} {} {by}", side.word(), joints(of)),
            Self::Zero(j, degrees) => format!("zero {} {degrees}", joint(j)),
            Self::Gravity(g) => format!("gravity {:.2} {:.2} {:.2}", g[0], g[1], g[2]),
            Self::Gains => "currents".to_owned(),
            Self::Rounded(decimals, true) => format!("urdf with {decimals} decimals"),
            Self::Rounded(decimals, false) => format!("links with {decimals} decimals"),
            Self::Wrap(j) => format!("wrap {}", joint(j)),
            Self::Step(j, size) => format!("step {} {size}", joint(j)),
            Self::Hold(n) => format!("hold {n}"),
            Self::Rest(percent) => format!("rest {percent}"),
            Self::Dropped(percent) => format!("dropped {percent}"),
            Self::Epoch(unit) => format!("epoch {}", unit.word()),
        }
    }

    /// Of which of `n` joints the torque is that joint `j` is declared to have.
    pub fn torque_of(&self, j: usize, n: usize) -> usize {
        match self {
            Self::Exchange(Side::Torque | Side::Both, a, b) if j == *a => *b,
            Self::Exchange(Side::Torque | Side::Both, a, b) if j == *b => *a,
            Self::Reverse => n - 1 - j,
            _ => j,
        }
    }

    /// Whether it is in the rows of a log and not in what is declared of its channels.
    pub fn in_rows(&self) -> bool {
        matches!(
            self,
            Self::Wrap(_)
                | Self::Step(..)
                | Self::Hold(_)
                | Self::Rest(_)
                | Self::Dropped(_)
                | Self::Epoch(_)
        )
    }

    /// By how many deviations parameters may differ once it is put right: a zero that is no multiple
    /// of 45 degrees is estimated.
    pub fn allowed(&self) -> f64 {
        match self {
            Self::Zero(_, degrees) if degrees % 45.0 != 0.0 => 3.0,
            _ => 1.0,
        }
    }

    /// Makes it; nothing where this machine cannot have it. `resting` gives its logs with pauses.
    pub fn make(
        &self,
        machine: &Machine,
        resting: &dyn Fn(usize) -> Option<Vec<Table>>,
    ) -> Option<Given> {
        let mut given = Given::right(machine);
        let joints = &machine.joints;
        let Given {
            robot,
            urdf,
            logs,
            epoch,
        } = &mut given;
        match self {
            Self::Sign(side, of) => scale(machine, logs, *side, of, -1.0),
            Self::Scale(side, of, by) => scale(machine, logs, *side, of, *by),
            Self::Exchange(side, a, b) => exchange(machine, logs, *side, *a, *b),
            Self::Reverse => {
                for a in 0..joints.len() / 2 {
                    exchange(machine, logs, Side::Both, a, joints.len() - 1 - a);
                }
            }
            Self::Zero(j, degrees) => {
                let by = degrees / 360.0 * joints[*j].turn?;
                for log in logs {
                    let column = log.column_mut(&joints[*j].position);
                    column.iter_mut().for_each(|q| *q += by);
                }
            }
            Self::Gravity(g) => robot_text::declare_gravity(robot, *g),
            Self::Gains => robot_text::declare_currents(robot, joints),
            Self::Rounded(decimals, false) => {
                if !robot_text::round_angles(robot, *decimals as i32) {
                    return None;
                }
            }
            Self::Rounded(decimals, true) => match urdf {
                Some((_, text)) => {
                    let digits = format!("{:.decimals$}", std::f64::consts::FRAC_PI_2);
                    *text = text.replace("1.5707963267948966", &digits);
                }
                None => {
                    let (with, text) = robot_text::with_urdf(robot, *decimals)?;
                    (*robot, *urdf) = (with, Some(("machine.urdf", text)));
                }
            },
            Self::Wrap(j) => rows::wrap(logs, &joints[*j].position, joints[*j].turn?),
            Self::Step(j, size) => {
                rows::step(
                    &mut logs[0],
                    &joints[*j].position,
                    size / joints[*j].in_si(),
                );
            }
            Self::Hold(n) => logs.iter_mut().for_each(|log| rows::hold(log, *n)),
            Self::Rest(percent) => *logs = resting(*percent)?,
            Self::Dropped(percent) => logs.iter_mut().for_each(|log| rows::drop(log, *percent)),
            Self::Epoch(unit) => *epoch = Some(*unit),
        }
        Some(given)
    }

    /// How many channels it changes: each may have an entry of its own.
    pub fn channels(&self) -> usize {
        match self {
            Self::Sign(_, of) | Self::Scale(_, of, _) => of.len(),
            _ => 1,
        }
    }

    /// Whether an entry of `setup`, or of what it is tied with, says the truth.
    pub fn is_shown_by(&self, machine: &Machine, entry: &Value) -> bool {
        let joint = |j: usize| machine.joints[j].name.as_str();
        let text = |key: &str| entry[key].as_str();
        let about = |kind: &str, side: Option<Side>, of: &[usize]| {
            let channel = side.is_none_or(|side| text("channel") == Some(side.word()));
            let all = of.len() == machine.joints.len() && of.len() > 1;
            let named = text("joint").is_some_and(|name| of.iter().any(|j| joint(*j) == name));
            let listed = text("joint").is_none()
                && (all || of.iter().all(|j| entry.to_string().contains(joint(*j))));
            text("kind") == Some(kind) && channel && (named || listed)
        };
        match self {
            Self::Sign(side, of) => about("sign", Some(*side), of),
            Self::Scale(side, of, _) => about("scale", Some(*side), of),
            Self::Exchange(side, a, b) => about("order", Some(*side), &[*a, *b]),
            Self::Reverse => text("kind") == Some("order") && text("channel") == Some("both"),
            Self::Zero(j, _) => about("zero", None, &[*j]),
            Self::Gravity(_) => text("kind") == Some("gravity"),
            Self::Gains => text("kind") == Some("gains"),
            Self::Rounded(..) => text("kind") == Some("geometry"),
            _ => false,
        }
    }

    /// Whether an entry is about a joint that has the fault.
    pub fn is_of_joint(&self, machine: &Machine, entry: &Value) -> bool {
        let of: Vec<usize> = match self {
            Self::Sign(_, of) | Self::Scale(_, of, _) => of.clone(),
            Self::Exchange(_, a, b) => vec![*a, *b],
            Self::Zero(j, _) => vec![*j],
            _ => return true,
        };
        let name = entry["joint"].as_str();
        let listed = |j: &usize| entry.to_string().contains(&machine.joints[*j].name);
        match name {
            Some(name) => of.iter().any(|j| machine.joints[*j].name == name),
            None => of.len() == machine.joints.len() || of.iter().any(listed),
        }
    }

    /// Words by which faults of the rows are shown: kinds of `inspect`.
    pub fn kinds_of_rows(&self) -> &'static [&'static str] {
        match self {
            Self::Wrap(_) => &["wrapped-encoder"],
            Self::Step(..) => &["position-step"],
            Self::Hold(_) => &["sample-and-hold", "repeated-rows"],
            Self::Dropped(_) => &["dropout", "irregular-clock"],
            Self::Epoch(_) => &["time"],
            _ => &[],
        }
    }
}

fn scale(machine: &Machine, logs: &mut [Table], side: Side, joints: &[usize], by: f64) {
    for log in logs {
        for joint in joints.iter().map(|j| &machine.joints[*j]) {
            if side != Side::Torque {
                log.column_mut(&joint.position)
                    .iter_mut()
                    .for_each(|q| *q *= by);
            }
            if side != Side::Position {
                log.column_mut(&joint.torque)
                    .iter_mut()
                    .for_each(|tau| *tau *= by);
            }
        }
    }
}

fn exchange(machine: &Machine, logs: &mut [Table], side: Side, a: usize, b: usize) {
    let (a, b) = (&machine.joints[a], &machine.joints[b]);
    for log in logs {
        if side != Side::Torque {
            log.exchange(&a.position, &b.position);
        }
        if side != Side::Position {
            log.exchange(&a.torque, &b.torque);
        }
    }
}

/// An entry of `setup` in a few words, for the list of misses.
pub fn shown(setup: &Value) -> Vec<Value> {
    let short = |entry: &Value| {
        let tied: Vec<String> = entries(&entry["tied_with"]).iter().map(words).collect();
        json!({"told": words(entry), "sure": entry["sure"], "tied": tied})
    };
    entries(setup).iter().map(short).collect()
}

fn words(entry: &Value) -> String {
    let text = |key: &str| entry[key].as_str().unwrap_or("-").to_owned();
    let found = entry["found"].to_string();
    format!(
        "{} {} {} {found}",
        text("kind"),
        text("channel"),
        text("joint")
    )
}
