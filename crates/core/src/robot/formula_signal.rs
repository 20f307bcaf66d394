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
}

impl FormulaSignal {
    const ALL: [(&'static str, Self); 7] = [
        ("q", Self::Position),
        ("v", Self::Speed),
        ("a", Self::Acceleration),
        ("load", Self::Load),
        ("direction", Self::Direction),
        ("temperature", Self::Temperature),
        ("t", Self::Time),
    ];

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
