//! The words that names of columns are made of, and what they say of a channel: `act_torque_abs_nm_1`,
//! `joint_1_position`, `actual_q_0`, `JointPos2`.

use std::ops::Range;

use schemars::JsonSchema;
use serde::Serialize;

use crate::log::FurtherCommand;

/// What a channel holds.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, JsonSchema)]
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
    #[default]
    Other,
}

impl ChannelRole {
    /// What a further command of a controller asks for.
    pub const fn of_command(command: FurtherCommand) -> Self {
        match command {
            FurtherCommand::Velocity => Self::Velocity,
            FurtherCommand::Torque => Self::Torque,
        }
    }

    /// Whether it is the motion or what drives it, whose shape is looked at.
    pub(super) fn has_shape(self) -> bool {
        matches!(self, Self::Position | Self::Velocity | Self::Torque)
    }

    /// Whether a fit reads it.
    pub(super) fn is_fitted(self) -> bool {
        matches!(self, Self::Position | Self::Torque)
    }
}

/// A word of a name: letters alone in lower case, or digits alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NameWord {
    /// Its letters or digits.
    pub text: String,
    /// Where it stands in the name [bytes].
    pub at: Range<usize>,
}

impl NameWord {
    /// The number that it is.
    pub fn number(&self) -> Option<u32> {
        self.text.parse().ok()
    }
}

/// Whether a capital with what follows it begins a word of its own: `Pos` in `AIPos`, `In` in `qIn`; not `Nm` in `mNm`.
fn begins_word(rest: &str) -> bool {
    let mut letters = rest.chars();
    let first = letters.next().is_some_and(char::is_uppercase);
    let unit = rest.strip_prefix("Nm").or(rest.strip_prefix("Hz"));
    let unit = unit.is_some_and(|rest| !rest.starts_with(char::is_alphabetic));
    first && letters.next().is_some_and(char::is_lowercase) && !unit
}

/// The words of a name: they end where letters and digits meet, at every other sign, before a capital behind
/// two small letters, and before a capital that a small letter follows.
pub fn words(name: &str) -> Vec<NameWord> {
    let mut out: Vec<NameWord> = Vec::new();
    let (mut before, mut small) = (None::<char>, 0);
    for (at, c) in name.char_indices() {
        if !c.is_alphanumeric() {
            before = None;
            small = 0;
            continue;
        }
        let goes_on = before.is_some_and(|b| {
            let both_digits = b.is_ascii_digit() == c.is_ascii_digit();
            let capital = c.is_uppercase() && (small >= 2 || begins_word(&name[at..]));
            both_digits && !capital
        });
        let end = at + c.len_utf8();
        match out.last_mut().filter(|_| goes_on) {
            Some(word) => {
                word.text.extend(c.to_lowercase());
                word.at.end = end;
            }
            None => {
                small = 0;
                out.push(NameWord {
                    text: c.to_lowercase().collect(),
                    at: at..end,
                });
            }
        }
        small = if c.is_lowercase() { small + 1 } else { 0 };
        before = Some(c);
    }
    out
}

/// Words that make a command of whatever they stand in; an arm that leads is no measurement of the one that follows.
const COMMANDS: &str = "\
    ref refs reference cmd cmds command commands commanded des desired target setpoint goal \
    wanted sp leader master operator teleop action actions ctrl soll sollwert setp demand ip ff feedforward";

/// Words of what is about a channel and no channel itself.
const ASIDE: &str = "\
    error err errors deviation limit limits max min std var variance temp temperature status \
    flag fault warning enabled mode gain kp kd counter id power energy stiffness";

/// Words of what is measured in the space of the tool, and of no joint.
const CARTESIAN: &str = "tcp eef cartesian cart wrench fts";

/// Words of torques that were made from a model or are the world's, and that no drive was measured to give.
const NOT_MEASURED: &str = "ext external hat contact disturbance residual et";

const ACCELERATIONS: &str = "acceleration accelerations accel acc ddq qdd qddot ddtheta qacc";
const VELOCITIES: &str = "\
    velocity velocities vel vels speed speeds omega dq qd qdot dtheta thetadot thetad jvel rpm \
    qvel spd geschwindigkeit";
const POSITIONS: &str = "\
    position positions pos angle angles ang q theta thetas jpos encoder enc posn winkel poz qpos \
    stroke strokes extension extensions travel displacement elongation hub weg lage fbpos mp";
const TORQUES: &str = "\
    jtrq torque torques effort efforts force forces tau taus moment moments trq tq mom jtau qfrc \
    frc kraft drehmoment jnttrq trqs mt et";
/// What makes torques; `current` is an adjective where another of these words stands beside it.
const CURRENTS: &str = "\
    current currents curr cur iq amps amp ampere strom voltage voltages volts volt spannung";
const VOLTAGES: &str = "voltage voltages volts volt spannung";
/// Words of what slides.
const SLIDING: &str = "\
    stroke strokes extension extensions travel displacement elongation hub weg force forces \
    kraft slide rail";

/// What makes a torque, as words name it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NamedDrive {
    /// A force or torque by name.
    Torque,
    Current,
    Voltage,
    /// No word says it.
    Unsaid,
}

/// What words call a torque channel. `current` before a torque is an adjective, behind it a noun.
pub fn drive(words: &[NameWord]) -> NamedDrive {
    let last = |known: &str| words.iter().rposition(|word| lists(known, &word.text));
    let (torque, current) = (last(TORQUES), last(CURRENTS));
    match (torque, current) {
        (torque, Some(current)) if torque.is_none_or(|torque| torque < current) => {
            match lists(VOLTAGES, &words[current].text) {
                true => NamedDrive::Voltage,
                false => NamedDrive::Current,
            }
        }
        (Some(_), _) => NamedDrive::Torque,
        _ => match words.first().map(|word| &*word.text) {
            Some("i") => NamedDrive::Current,
            Some("u") => NamedDrive::Voltage,
            _ => NamedDrive::Unsaid,
        },
    }
}

/// Whether words are of a joint that slides.
pub fn slides(words: &[NameWord]) -> bool {
    has(words, SLIDING) && !has(words, "actuator")
}

/// Whether a list, whose words are parted by spaces, has this one.
pub fn lists(known: &str, word: &str) -> bool {
    known.split_whitespace().any(|one| one == word)
}

/// Whether one of these words is in a list.
pub fn has(words: &[NameWord], known: &str) -> bool {
    words.iter().any(|word| lists(known, &word.text))
}

/// Whether words name what was commanded: `q_ref`, `target`, `q_d` of a desired one, a leader's.
pub fn is_command(words: &[NameWord]) -> bool {
    let desired = |pair: &[NameWord]| {
        let of = &pair[0].text;
        let short = [POSITIONS, VELOCITIES, TORQUES, "j"];
        pair[1].text == "d" && short.iter().any(|known| lists(known, of))
    };
    // mc_rtc has qIn and qOut, KUKA's sensor interface AIPos and ASPos
    let out = |pair: &[NameWord]| match &*pair[1].text {
        "out" => lists("q alpha tau pos vel", &pair[0].text),
        "pos" => pair[0].text == "as",
        _ => false,
    };
    let ahead = |pair: &[NameWord]| [&*pair[0].text, &*pair[1].text] == ["feed", "forward"];
    let pairs = words.windows(2);
    has(words, COMMANDS)
        || pairs
            .into_iter()
            .any(|pair| desired(pair) || out(pair) || ahead(pair))
}

/// What a name says was commanded; `None` of what was measured.
pub fn commanded_role(name: &str) -> Option<ChannelRole> {
    let spoken = words(name);
    is_command(&spoken).then(|| role(&spoken).unwrap_or(ChannelRole::Other))
}

/// Whether words are of what is about a channel and no channel itself, or of the tool and no joint.
pub fn is_aside(words: &[NameWord]) -> bool {
    // UR's `tool_vector`, KUKA's `RIst.X`
    let of_tool = |pair: &[NameWord]| match &*pair[0].text {
        "tool" => lists("vector force accelerometer pose", &pair[1].text),
        "ri" | "rs" => lists("st ist sol soll", &pair[1].text),
        _ => false,
    };
    has(words, ASIDE) || has(words, CARTESIAN) || words.windows(2).any(of_tool)
}

/// Whether words of a torque say that it is an estimate of what acts from outside, and no measured torque.
pub fn is_external(words: &[NameWord]) -> bool {
    has(words, NOT_MEASURED)
}

/// What words say a channel holds, whether or not it was commanded; `None` where nothing.
pub fn role(words: &[NameWord]) -> Option<ChannelRole> {
    if is_aside(words) {
        return Some(ChannelRole::Other);
    }
    if has(words, ACCELERATIONS) || has(words, "ddot") {
        return Some(ChannelRole::Acceleration);
    }
    let alpha = |pair: &[NameWord]| pair[0].text == "alpha" && lists("in out", &pair[1].text);
    if has(words, VELOCITIES) || has(words, "dot") || words.windows(2).any(alpha) {
        return Some(ChannelRole::Velocity);
    }
    // tau_q1 is the torque of q1
    let short = |word: &NameWord| word.text == "q";
    let position = words.iter().any(|w| !short(w) && lists(POSITIONS, &w.text));
    // a dataset of LeRobot says what it observed before the names of its motors, and calls positions the state
    let observed = words.windows(2).find(|pair| pair[0].text == "observation");
    let observed = observed.map_or("", |pair| &pair[1].text);
    let current = has(words, CURRENTS);
    match (position, has(words, TORQUES)) {
        _ if lists("effort torque current load", observed) => Some(ChannelRole::Torque),
        (true, _) => Some(ChannelRole::Position),
        (_, true) => Some(ChannelRole::Torque),
        _ if words.iter().any(short) || (observed == "state" && !current) => {
            Some(ChannelRole::Position)
        }
        _ if current => Some(ChannelRole::Torque),
        _ => None,
    }
}

/// Words that distinguish no joint from another: how it was measured, in which unit.
const NOISE: &str = "\
    act actual meas measured msr state states deg degs degree degrees rad rads nm mnm knm ncm kn \
    n mm cm m per s percent pct feedback fbk fb current the of value data sensor ist in out \
    alpha ai ma jnt actuator counts count ticks turn turns rev revs revolutions mrad milliamps \
    newton amperes";

/// Where the words of a joint stand in those of a name, in a row [bytes].
pub fn place_of(spoken: &[NameWord], joint: &str) -> Option<Range<usize>> {
    let joint = words(joint);
    let same = |at: &&[NameWord]| at.iter().zip(&joint).all(|(a, b)| a.text == b.text);
    let found = spoken.windows(joint.len().max(1)).find(same)?;
    Some(found.first()?.at.start..found.last()?.at.end)
}

/// A name with `#` for what stands at a place.
pub fn marked(name: &str, at: Range<usize>) -> String {
    format!("{}#{}", &name[..at.start], &name[at.end..])
}

/// A name without the words of a joint, where it has them in a row.
pub fn without_joint(name: &str, joint: &str) -> String {
    let at = place_of(&words(name), joint);
    at.map_or_else(|| name.to_owned(), |at| marked(name, at))
}

/// The signs of a name without the words of units, `#` kept: columns that differ in their units alone look the same.
pub fn without_units(name: &str) -> String {
    const UNITS: &str = "\
        deg degs degree degrees rad rads mrad m mm cm nm mnm knm ncm n kn a v ma rpm per s turns \
        counts percent pct";
    let part = |part: &str| -> Vec<String> {
        let spoken = words(part).into_iter().map(|word| word.text);
        spoken.filter(|word| !lists(UNITS, word)).collect()
    };
    let parts: Vec<String> = name.split('#').map(|one| part(one).join("_")).collect();
    parts.join("#")
}

/// What is left of a name when the words of its role and of its unit are taken out: the joint.
pub fn joint(words: &[NameWord]) -> String {
    let of_role = [ACCELERATIONS, VELOCITIES, POSITIONS, TORQUES, CURRENTS];
    let said = |word: &str| {
        lists(NOISE, word) || lists("dot ddot", word) || of_role.iter().any(|of| lists(of, word))
    };
    let text = |k: usize| words.get(k).map_or("", |word| word.text.as_str());
    let left = (0..words.len()).filter(|k| {
        // joint_states is the name of a topic
        let of_topic = text(*k) == "joint" && lists("state states", text(k + 1));
        !of_topic && !said(text(*k))
    });
    let left: Vec<&str> = left.map(text).collect();
    left.join("_")
}

#[cfg(test)]
mod tests;
