//! What the columns of a log are: told by the robot file, or guessed from their names.

use schemars::JsonSchema;
use serde::Serialize;

/// What a channel holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelRole {
    /// Position of a joint or motor.
    Position,
    /// Velocity of a joint or motor.
    Velocity,
    /// Acceleration of a joint or motor.
    Acceleration,
    /// Torque, force, current or voltage.
    Torque,
    /// What was commanded or wanted.
    Command,
    /// Anything else.
    Other,
}

/// A channel: a column as the judge sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct InspectedChannel {
    /// Name of the column.
    pub name: String,
    /// What it holds.
    pub role: ChannelRole,
    /// The joint (or actuator coordinate) that it belongs to.
    pub joint: Option<String>,
    /// Unit of its numbers, where it is known.
    pub unit: Option<String>,
    /// Limits of its numbers by the robot file.
    pub limits: Option<[f64; 2]>,
    /// Whether a number at its limit is what was really applied: the volts of an amplifier.
    pub saturates: bool,
}

impl InspectedChannel {
    /// A channel by its name alone.
    pub fn guessed(name: &str) -> Self {
        let (role, joint) = guess(name);
        Self {
            role,
            joint,
            ..Self::new(name, ChannelRole::Other, None, None)
        }
    }

    /// A channel that is known.
    pub fn new(name: &str, role: ChannelRole, joint: Option<&str>, unit: Option<&str>) -> Self {
        Self {
            name: name.to_owned(),
            role,
            joint: joint.map(str::to_owned),
            unit: unit.map(str::to_owned),
            limits: None,
            saturates: false,
        }
    }
}

/// Whether a column of this name is a time.
pub fn is_time(name: &str) -> bool {
    let lower = name.trim().to_lowercase();
    let base = lower.split(['[', '(']).next().unwrap_or_default().trim();
    let base = ["_s", "_sec", "_ms", "_us", "_ns"]
        .iter()
        .find_map(|unit| base.strip_suffix(unit))
        .unwrap_or(base);
    matches!(
        base,
        "t" | "time" | "timestamp" | "stamp" | "times" | "secs" | "seconds"
    )
}

/// Words that stand for a role where a name begins with one, the longer before the shorter.
const WORDS: [(&str, ChannelRole); 27] = [
    ("acceleration", ChannelRole::Acceleration),
    ("accel", ChannelRole::Acceleration),
    ("acc", ChannelRole::Acceleration),
    ("ddq", ChannelRole::Acceleration),
    ("qdd", ChannelRole::Acceleration),
    ("velocity", ChannelRole::Velocity),
    ("speed", ChannelRole::Velocity),
    ("vel", ChannelRole::Velocity),
    ("omega", ChannelRole::Velocity),
    ("dq", ChannelRole::Velocity),
    ("qd", ChannelRole::Velocity),
    ("position", ChannelRole::Position),
    ("angle", ChannelRole::Position),
    ("pos", ChannelRole::Position),
    ("x_c", ChannelRole::Position),
    ("q", ChannelRole::Position),
    ("torque", ChannelRole::Torque),
    ("effort", ChannelRole::Torque),
    ("force", ChannelRole::Torque),
    ("current", ChannelRole::Torque),
    ("voltage", ChannelRole::Torque),
    ("tau", ChannelRole::Torque),
    ("iq", ChannelRole::Torque),
    ("u", ChannelRole::Torque),
    ("i", ChannelRole::Torque),
    ("f", ChannelRole::Torque),
    ("v", ChannelRole::Velocity),
];

/// Words that make a command of whatever they stand in.
const COMMANDS: [&str; 12] = [
    "ref",
    "reference",
    "cmd",
    "command",
    "commanded",
    "des",
    "desired",
    "target",
    "setpoint",
    "goal",
    "wanted",
    "sp",
];

/// Role and joint by the name of a column: `q_elbow`, `dq1`, `position[elbow]`, `Reference Velocity`.
fn guess(name: &str) -> (ChannelRole, Option<String>) {
    let lower = name.trim().to_lowercase();
    // A unit in brackets is no part of the name; a joint in brackets is.
    let base = match lower.rsplit_once([' ', '_']) {
        Some((head, unit)) if unit.starts_with(['[', '(']) => head,
        _ => lower.as_str(),
    };
    let words = || base.split(|c: char| !c.is_alphanumeric());
    let plain = |word: &str| {
        word.trim_end_matches(|c: char| c.is_ascii_digit())
            .to_owned()
    };
    if words().any(|word| COMMANDS.contains(&plain(word).as_str())) {
        return (ChannelRole::Command, None);
    }
    for (word, role) in WORDS {
        let Some(rest) = base.strip_prefix(word) else {
            continue;
        };
        // A word goes on with a joint's number, a mark and a joint's name, or not at all.
        let joint = rest.trim_matches(|c: char| !c.is_alphanumeric());
        let ends = rest.is_empty() || rest.starts_with(|c: char| !c.is_alphabetic());
        // One letter alone means too much to be believed.
        let numbered = !rest.is_empty() || word.len() > 1;
        if ends && numbered {
            let joint = (!joint.is_empty()).then(|| joint.to_owned());
            return (role, Some(joint.unwrap_or_default()));
        }
    }
    (ChannelRole::Other, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_of_the_contract_and_of_measured_logs_are_understood() {
        for (name, role, joint) in [
            ("q_q1", ChannelRole::Position, Some("q1")),
            ("dq_q1", ChannelRole::Velocity, Some("q1")),
            ("ddq_elbow", ChannelRole::Acceleration, Some("elbow")),
            ("tau_q5", ChannelRole::Torque, Some("q5")),
            ("x_c3", ChannelRole::Position, Some("3")),
            ("u_3", ChannelRole::Torque, Some("3")),
            ("q1", ChannelRole::Position, Some("1")),
            ("dq7", ChannelRole::Velocity, Some("7")),
            ("tau7", ChannelRole::Torque, Some("7")),
            ("u1", ChannelRole::Torque, Some("1")),
            ("q_ref1", ChannelRole::Command, None),
            ("Reference Velocity", ChannelRole::Command, None),
            ("Position", ChannelRole::Position, Some("")),
            ("Velocity", ChannelRole::Velocity, Some("")),
            ("Iq", ChannelRole::Torque, Some("")),
            (
                "position[shoulder_pan_joint]",
                ChannelRole::Position,
                Some("shoulder_pan_joint"),
            ),
            ("effort[0]", ChannelRole::Torque, Some("0")),
            ("q1 [deg]", ChannelRole::Position, Some("1")),
            ("Function Activated", ChannelRole::Other, None),
            ("status_1", ChannelRole::Other, None),
            ("quality", ChannelRole::Other, None),
            ("pulses", ChannelRole::Other, None),
            ("temperature", ChannelRole::Other, None),
            ("v", ChannelRole::Other, None),
        ] {
            let found = InspectedChannel::guessed(name);
            assert_eq!(
                (found.role, found.joint.as_deref()),
                (role, joint),
                "{name}"
            );
        }
    }

    #[test]
    fn times_are_known_by_their_names() {
        for name in ["t", "Time", "time [s]", "t_ms", "timestamp(ns)", "time_s"] {
            assert!(is_time(name), "{name}");
        }
        for name in ["tau", "tau_1", "temperature", "total", "time_constant"] {
            assert!(!is_time(name), "{name}");
        }
    }
}
