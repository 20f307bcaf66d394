//! A column of a log, as its name and its numbers show it.

use crate::inspect::words::{is_aside, is_command, is_external, joint, role, words};
use crate::inspect::{ChannelRole, InspectedChannel};

/// A column of a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LogColumn {
    /// Its name; `#3` where it has none.
    pub name: String,
    /// The path by which a robot file names it, where that is another than its name.
    pub path: Option<String>,
    /// What it holds, commanded or measured.
    pub role: ChannelRole,
    /// It was commanded, or is of a machine that leads.
    pub commanded: bool,
    /// It is an estimate of torques from outside, and no measured one.
    pub external: bool,
    /// The joint that its name speaks of; empty where it names none.
    pub joint: String,
    /// The unit that its name states.
    pub unit: Option<String>,
    /// Smallest and largest number, in its own unit.
    pub range: [f64; 2],
    /// Every number is a whole one, and not all are 0.
    pub whole: bool,
    /// Range after which it begins anew.
    pub wrap: Option<f64>,
    /// Range of signed numbers that are logged as unsigned ones.
    pub torque_wrap: Option<f64>,
    /// How many times the velocity beside it its derivative is, of a position.
    pub per_velocity: Option<f64>,
    /// What it holds says its role, and no name.
    pub by_content: bool,
}

impl LogColumn {
    /// A column by its name.
    pub fn named(name: &str) -> Self {
        let guessed = InspectedChannel::guessed(name);
        let spoken = words(name);
        let (role, joint) = match guessed.role {
            ChannelRole::Command => (role(&spoken).unwrap_or(ChannelRole::Other), joint(&spoken)),
            role => (role, guessed.joint.unwrap_or_default()),
        };
        Self {
            name: name.to_owned(),
            role,
            commanded: is_command(&spoken),
            external: role == ChannelRole::Torque && is_external(&spoken),
            joint,
            ..Self::default()
        }
    }

    /// Whether its name says neither what it holds nor that it holds no channel.
    pub fn is_unsaid(&self) -> bool {
        let unsaid = matches!(self.role, ChannelRole::Other | ChannelRole::Command);
        unsaid && !is_aside(&words(&self.name))
    }

    /// Width of what it went through, in its own unit.
    pub fn span(&self) -> f64 {
        self.range[1] - self.range[0]
    }

    /// Largest size of a number in it.
    pub fn largest(&self) -> f64 {
        self.range[0].abs().max(self.range[1].abs())
    }
}
