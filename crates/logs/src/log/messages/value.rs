//! A number as a message holds it, before it is scaled.

/// One field of a message.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Value {
    /// The message does not have it.
    #[default]
    Absent,
    /// A whole number.
    Int(i64),
    /// A whole number that may be beyond `i64`.
    Unsigned(u64),
    /// Any other number, NaN and infinities included.
    Float(f64),
}

impl Value {
    /// The number; `None` where it is absent.
    pub(crate) fn number(self) -> Option<f64> {
        match self {
            Self::Absent => None,
            Self::Int(value) => Some(value as f64),
            Self::Unsigned(value) => Some(value as f64),
            Self::Float(value) => Some(value),
        }
    }

    /// The number, where it is whole and stored as such.
    pub(crate) fn integer(self) -> Option<i128> {
        match self {
            Self::Int(value) => Some(i128::from(value)),
            Self::Unsigned(value) => Some(i128::from(value)),
            Self::Absent | Self::Float(_) => None,
        }
    }
}

/// Seconds and nanoseconds as one number \[ns\]; `None` where one of them is no whole number.
pub(super) fn stamp_ns(seconds: Value, nanoseconds: Value) -> Option<i128> {
    Some(seconds.integer()? * 1_000_000_000 + nanoseconds.integer()?)
}
