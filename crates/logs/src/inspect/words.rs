//! The words that names of columns are made of, and what they say of a channel: `act_torque_abs_nm_1`,
//! `joint_1_position`, `actual_q_0`, `JointPos2`.

use std::ops::Range;

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
    /// Temperature of a drive, where the robot file says so.
    Temperature,
    /// What was commanded or wanted.
    Command,
    /// Anything else.
    Other,
}

/// A word of a name: letters alone in lower case, or digits alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    /// Its letters or digits.
    pub text: String,
    /// Where it stands in the name [bytes].
    pub at: Range<usize>,
}

impl Word {
    /// The number that it is.
    pub fn number(&self) -> Option<u32> {
        self.text.parse().ok()
    }
}

/// The words of a name: they end where letters and digits meet, at every other sign, and before a
/// capital behind two small letters.
pub fn words(name: &str) -> Vec<Word> {
    let mut out: Vec<Word> = Vec::new();
    let (mut before, mut small) = (None::<char>, 0);
    for (at, c) in name.char_indices() {
        if !c.is_alphanumeric() {
            before = None;
            small = 0;
            continue;
        }
        let goes_on = before.is_some_and(|b| {
            let both_digits = b.is_ascii_digit() == c.is_ascii_digit();
            both_digits && !(c.is_uppercase() && small >= 2)
        });
        let end = at + c.len_utf8();
        match out.last_mut().filter(|_| goes_on) {
            Some(word) => {
                word.text.extend(c.to_lowercase());
                word.at.end = end;
            }
            None => {
                small = 0;
                out.push(Word {
                    text: c.to_lowercase().collect(),
                    at: at..end,
                });
            }
        }
        small = match c.is_lowercase() {
            true => small + 1,
            false => 0,
        };
        before = Some(c);
    }
    out
}

/// Words that make a command of whatever they stand in; the arm that leads another one is no measurement
/// of the arm that follows.
const COMMANDS: [&str; 20] = [
    "ref",
    "refs",
    "reference",
    "cmd",
    "cmds",
    "command",
    "commands",
    "commanded",
    "des",
    "desired",
    "target",
    "setpoint",
    "goal",
    "wanted",
    "sp",
    "leader",
    "master",
    "operator",
    "teleop",
    "action",
];

/// Words of what is about a channel and no channel itself.
const ASIDE: [&str; 27] = [
    "error",
    "err",
    "errors",
    "deviation",
    "limit",
    "limits",
    "max",
    "min",
    "std",
    "var",
    "variance",
    "temp",
    "temperature",
    "status",
    "flag",
    "fault",
    "warning",
    "enabled",
    "mode",
    "gain",
    "kp",
    "kd",
    "counter",
    "id",
    "power",
    "energy",
    "stiffness",
];

const ACCELERATIONS: [&str; 8] = [
    "acceleration",
    "accelerations",
    "accel",
    "acc",
    "ddq",
    "qdd",
    "qddot",
    "ddtheta",
];
const VELOCITIES: [&str; 15] = [
    "velocity",
    "velocities",
    "vel",
    "vels",
    "speed",
    "speeds",
    "omega",
    "dq",
    "qd",
    "qdot",
    "dtheta",
    "thetadot",
    "thetad",
    "jvel",
    "rpm",
];
const POSITIONS: [&str; 15] = [
    "position",
    "positions",
    "pos",
    "angle",
    "angles",
    "ang",
    "q",
    "theta",
    "thetas",
    "jpos",
    "encoder",
    "enc",
    "posn",
    "winkel",
    "poz",
];
const TORQUES: [&str; 14] = [
    "torque", "torques", "effort", "efforts", "force", "forces", "tau", "taus", "moment",
    "moments", "trq", "tq", "mom", "jtau",
];
/// What makes torques; `current` is an adjective where another of these words stands beside it.
const CURRENTS: [&str; 9] = [
    "current", "currents", "curr", "cur", "iq", "amps", "voltage", "voltages", "volts",
];

fn has(words: &[Word], known: &[&str]) -> bool {
    words.iter().any(|word| known.contains(&word.text.as_str()))
}

/// Whether words name what was commanded: `q_ref`, `target`, `q_d` of a desired one, a leader's.
pub fn is_command(words: &[Word]) -> bool {
    let desired = |pair: &[Word]| {
        let of = &pair[0].text;
        let short = [&POSITIONS[..], &VELOCITIES, &TORQUES].concat();
        pair[1].text == "d" && (short.contains(&of.as_str()) || of == "j")
    };
    has(words, &COMMANDS) || words.windows(2).any(desired)
}

/// What words say a channel holds, whether or not it was commanded; `None` where nothing.
pub fn role(words: &[Word]) -> Option<ChannelRole> {
    if has(words, &ASIDE) {
        return Some(ChannelRole::Other);
    }
    if has(words, &ACCELERATIONS) || has(words, &["ddot"]) {
        return Some(ChannelRole::Acceleration);
    }
    if has(words, &VELOCITIES) || has(words, &["dot"]) {
        return Some(ChannelRole::Velocity);
    }
    // tau_q1 is the torque of q1
    let short = |word: &Word| word.text == "q";
    let position = words
        .iter()
        .any(|w| !short(w) && POSITIONS.contains(&&*w.text));
    match (position, has(words, &TORQUES)) {
        (true, _) => Some(ChannelRole::Position),
        (_, true) => Some(ChannelRole::Torque),
        _ if words.iter().any(short) => Some(ChannelRole::Position),
        _ if has(words, &CURRENTS) => Some(ChannelRole::Torque),
        _ => None,
    }
}

/// Words that tell no joint from another: how it was measured, in which unit.
const NOISE: [&str; 29] = [
    "act", "actual", "meas", "measured", "state", "states", "deg", "degs", "degree", "degrees",
    "rad", "rads", "nm", "mnm", "n", "mm", "m", "per", "s", "percent", "pct", "feedback", "fbk",
    "current", "the", "of", "value", "data", "sensor",
];

/// What is left of a name when the words of its role and of its unit are taken out: the joint.
pub fn joint(words: &[Word]) -> String {
    let said = [
        &ACCELERATIONS[..],
        &VELOCITIES,
        &POSITIONS,
        &TORQUES,
        &CURRENTS,
        &NOISE,
        &["dot", "ddot"],
    ]
    .concat();
    let text = |k: usize| words.get(k).map_or("", |word| word.text.as_str());
    let left = (0..words.len()).filter(|k| {
        // joint_states is the name of a topic
        let of_topic = text(*k) == "joint" && ["state", "states"].contains(&text(k + 1));
        !of_topic && !said.contains(&text(*k))
    });
    let left: Vec<&str> = left.map(text).collect();
    left.join("_")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_fall_into_words_at_digits_signs_and_capitals() {
        let of = |name: &str| -> Vec<String> { words(name).into_iter().map(|w| w.text).collect() };
        assert_eq!(
            of("act_torque_abs_nm_1"),
            ["act", "torque", "abs", "nm", "1"]
        );
        assert_eq!(of("JointPos2"), ["joint", "pos", "2"]);
        assert_eq!(of("dQ1"), ["dq", "1"]);
        assert_eq!(of("tau_J_d[3]"), ["tau", "j", "d", "3"]);
        assert_eq!(of(" /joint_states.q10 "), ["joint", "states", "q", "10"]);
        assert!(of("--").is_empty());
    }

    #[test]
    fn words_tell_roles_and_commands_and_joints() {
        use ChannelRole::*;
        for (name, role_, command, joint_) in [
            ("positions_0", Some(Position), false, "0"),
            ("actual_q_0", Some(Position), false, "0"),
            ("joint_1_position", Some(Position), false, "joint_1"),
            ("act_torque_abs_nm_1", Some(Torque), false, "abs_1"),
            ("act_vel_mot_deg_per_s_3", Some(Velocity), false, "mot_3"),
            ("actual_current_2", Some(Torque), false, "2"),
            ("current_position_2", Some(Position), false, "2"),
            (
                "shoulder_pan_joint.velocity",
                Some(Velocity),
                false,
                "shoulder_pan_joint",
            ),
            ("q_dot_4", Some(Velocity), false, "4"),
            ("tau_J_d_1", Some(Torque), true, "j_d_1"),
            ("q_d_1", Some(Position), true, "d_1"),
            ("target_moment_0", Some(Torque), true, "target_0"),
            ("leader_pos_0", Some(Position), true, "leader_0"),
            ("tracking_error_1", Some(Other), false, "tracking_error_1"),
            (
                "motor_temperature_1",
                Some(Other),
                false,
                "motor_temperature_1",
            ),
            ("gripper", None, false, "gripper"),
        ] {
            let words = words(name);
            let found = (role(&words), is_command(&words), joint(&words));
            assert_eq!(found, (role_, command, joint_.to_owned()), "{name}");
        }
    }
}
