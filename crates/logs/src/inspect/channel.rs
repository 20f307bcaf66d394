//! What the columns of a log are: named by the robot file, or guessed from their names.

use super::words::{self, ChannelRole};

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
    /// Largest speed of a position by the robot file [unit/s].
    pub speed: Option<f64>,
    /// Whether a number at its limit is what was really applied: the volts of an amplifier.
    pub saturates: bool,
    /// Largest torque that acts, whatever the channel says.
    pub delivers: Option<f64>,
    /// Whether its numbers are commands of positions, of which torques are made.
    pub commands: bool,
    /// What a 0 of the column stands for.
    pub zero: f64,
    /// Unit of its numbers per unit of the column, so that what is to be written into a robot file
    /// can be given in the column's.
    pub factor: f64,
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
            speed: None,
            saturates: false,
            delivers: None,
            commands: false,
            zero: 0.0,
            factor: 1.0,
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
    let base = base.trim_start_matches(['_', '%', '/', '.']);
    words::lists(TIMES, base)
}

/// Names of times.
const TIMES: &str = "\
    t time timestamp timestamps time_stamp stamp stamps times sec secs seconds elapsed elapsed_time rosbagtimestamp ipoc \
    zeit clock simtime sim_time rostime datenum header.stamp field.header.stamp";

/// Words that stand for a role where a name begins with one, the longer before the shorter.
const WORDS: [(ChannelRole, &str); 5] = [
    (ChannelRole::Acceleration, "acceleration accel acc ddq qdd"),
    (ChannelRole::Velocity, "velocity speed vel omega dq qd"),
    (ChannelRole::Position, "position angle pos x_c q"),
    (
        ChannelRole::Torque,
        "torque effort force current voltage tau iq u i f",
    ),
    (ChannelRole::Velocity, "v"),
];

/// Role and joint by the name of a column: `q_elbow`, `dq1`, `position[elbow]`, `Reference Velocity`.
fn guess(name: &str) -> (ChannelRole, Option<String>) {
    // A unit in brackets is no part of the name; a joint in brackets is.
    let base = match name.trim().rsplit_once([' ', '_']) {
        Some((head, unit)) if unit.starts_with(['[', '(']) => head,
        _ => name.trim(),
    };
    let spoken = words::words(base);
    let base = base.to_lowercase();
    if words::is_command(&spoken) {
        return (ChannelRole::Command, None);
    }
    let shown = words::role(&spoken);
    // `position_error` and `q_dot` are what their other words say
    let contract = ["q_", "dq_", "ddq_", "tau_"];
    let contract = contract.iter().any(|prefix| base.starts_with(prefix));
    let listed = WORDS.iter().flat_map(|(role, words)| {
        let each = words.split_whitespace();
        each.map(move |word| (word, *role))
    });
    for (word, role) in listed {
        let Some(rest) = base.strip_prefix(word) else {
            continue;
        };
        // A word goes on with a joint's number, a mark and a joint's name, or not at all.
        let joint = rest.trim_matches(|c: char| !c.is_alphanumeric());
        let ends = rest.is_empty() || rest.starts_with(|c: char| !c.is_alphabetic());
        // One letter alone means too much to be believed.
        let numbered = !rest.is_empty() || word.len() > 1;
        let agrees =
            shown.is_none_or(|shown| shown == role || (shown == ChannelRole::Other && contract));
        if ends && numbered && agrees {
            return (role, Some(joint.to_owned()));
        }
    }
    let role = shown.unwrap_or(ChannelRole::Other);
    let joint = (role != ChannelRole::Other).then(|| words::joint(&spoken));
    (role, joint)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_of_the_contract_and_of_measured_logs_are_understood() {
        use ChannelRole::*;
        for (name, role, joint) in [
            ("q_q1", Position, Some("q1")),
            ("dq_q1", Velocity, Some("q1")),
            ("ddq_elbow", Acceleration, Some("elbow")),
            ("tau_q5", Torque, Some("q5")),
            ("x_c3", Position, Some("3")),
            ("u_3", Torque, Some("3")),
            ("q1", Position, Some("1")),
            ("dq7", Velocity, Some("7")),
            ("tau7", Torque, Some("7")),
            ("u1", Torque, Some("1")),
            ("q_ref1", Command, None),
            ("Reference Velocity", Command, None),
            ("Position", Position, Some("")),
            ("Velocity", Velocity, Some("")),
            ("Iq", Torque, Some("")),
            (
                "position[shoulder_pan_joint]",
                Position,
                Some("shoulder_pan_joint"),
            ),
            ("effort[0]", Torque, Some("0")),
            ("q1 [deg]", Position, Some("1")),
            ("Function Activated", Other, None),
            ("status_1", Other, None),
            ("quality", Other, None),
            ("pulses", Other, None),
            ("temperature", Other, None),
            ("positions_0", Position, Some("0")),
            ("actual_qd_3", Velocity, Some("3")),
            ("joint_1_position", Position, Some("joint_1")),
            ("act_torque_abs_nm_1", Torque, Some("abs_1")),
            ("position_error_1", Other, None),
            ("q_dot_1", Velocity, Some("1")),
            ("v", Other, None),
        ] {
            let (found_role, found_joint) = guess(name);
            assert_eq!(
                (found_role, found_joint.as_deref()),
                (role, joint),
                "{name}"
            );
        }
    }

    #[test]
    fn times_are_known_by_their_names() {
        for name in [
            "t",
            "Time",
            "time [s]",
            "t_ms",
            "timestamp(ns)",
            "time_s",
            "timestamps",
        ] {
            assert!(is_time(name), "{name}");
        }
        for name in ["tau", "tau_1", "temperature", "total", "time_constant"] {
            assert!(!is_time(name), "{name}");
        }
    }
}
