//! What a generated file says of itself.

/// Words and units for the head of a generated file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Note {
    /// What it was made from and what is not in it, line by line.
    pub lines: Vec<String>,
    /// Unit of each joint's torque.
    pub torque_units: Vec<String>,
}
