//! What formulas of users are in: names of signals, of a joint or of the robot.

/// A signal that a formula may name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FormulaSignal {
    /// Position of a joint \[rad or m\].
    Position,
    /// Its speed \[rad/s or m/s\].
    Speed,
    /// Its acceleration \[rad/s^2 or m/s^2\].
    Acceleration,
    /// Its rigid-body torque \[Nm or N\].
    Load,
    /// Saturating part of its friction over its level, -1 to 1.
    Direction,
    /// Temperature of its drive as logged \[degC\].
    Temperature,
    /// Time since the begin of the log \[s\].
    Time,
    /// Time since the joint last turned \[s\].
    SinceReversal,
    /// Where the joint stands in a play of some width, -1 to 1: it goes from one end to the other after a reversal.
    Play,
    /// Dahl's bristle, -1 to 1: after a reversal it goes to the other end as the way by some way.
    Dahl,
}

impl FormulaSignal {
    const ALL: [(&'static str, Self); 10] = [
        ("q", Self::Position),
        ("v", Self::Speed),
        ("a", Self::Acceleration),
        ("load", Self::Load),
        ("direction", Self::Direction),
        ("temperature", Self::Temperature),
        ("t", Self::Time),
        ("since_reversal", Self::SinceReversal),
        ("play", Self::Play),
        ("dahl", Self::Dahl),
    ];

    /// As formulas name it.
    pub fn name(self) -> &'static str {
        let own = Self::ALL.iter().find(|(_, signal)| *signal == self);
        own.map_or("", |(name, _)| name)
    }

    /// Name of the shape that is its scale, where it has one [m or rad].
    pub fn scale(self) -> Option<&'static str> {
        match self {
            Self::Play => Some("width"),
            Self::Dahl => Some("way"),
            _ => None,
        }
    }

    /// Whether it hangs on what was before.
    pub fn remembers(self) -> bool {
        matches!(self, Self::SinceReversal | Self::Play | Self::Dahl)
    }

    /// The signal that a name stands for, and the joint where it names one: `q` of the formula's own joint, `q_NAME`
    /// of another. The time is nobody's.
    pub fn read(name: &str, joints: &[String]) -> Option<(Self, Option<usize>)> {
        Self::ALL.iter().find_map(|(own, signal)| {
            let rest = name.strip_prefix(own)?;
            if rest.is_empty() {
                return Some((*signal, None));
            }
            let joint = rest.strip_prefix('_').filter(|_| *signal != Self::Time)?;
            let of = joints.iter().position(|j| j == joint)?;
            Some((*signal, Some(of)))
        })
    }

    /// Whether a name is that of a signal on some robot.
    pub fn has_name(name: &str) -> bool {
        Self::ALL.iter().any(|(own, _)| {
            name.strip_prefix(own)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
        })
    }
}
