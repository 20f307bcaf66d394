//! Changes of a set-up, and their sum.

use super::finding::ChannelKind;

/// One thing that may be wrong with a set-up, as what puts it right. Joints are channels where motors
/// have coordinates of their own.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// These channels have the other sign.
    Sign(ChannelKind, Vec<usize>),
    /// Two channels have changed places.
    Exchange(ChannelKind, usize, usize),
    /// All joints are listed from the tip to the base.
    Reverse,
    /// These channels are to be multiplied by a factor.
    Scale(ChannelKind, Vec<usize>, f64),
    /// This is to be added to a joint's position \[m or rad\].
    Zero(usize, f64),
    /// Acceleration of free fall in the base frame \[m/s^2\].
    Gravity([f64; 3]),
}

/// What a set-up differs by from the declared one.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// Of each channel, whose logged numbers are its position.
    pub position_from: Vec<usize>,
    /// Of each channel, by what its declared factor is multiplied.
    pub position_factor: Vec<f64>,
    /// Of each joint, what is added to its position \[m or rad\].
    pub zero: Vec<f64>,
    /// As for the positions.
    pub torque_from: Vec<usize>,
    pub torque_factor: Vec<f64>,
    /// Acceleration of free fall, where it is not the declared one \[m/s^2\].
    pub gravity: Option<[f64; 3]>,
}

impl Correction {
    /// The set-up as it is declared.
    pub fn none(joints: usize) -> Self {
        Self {
            position_from: (0..joints).collect(),
            position_factor: vec![1.0; joints],
            zero: vec![0.0; joints],
            torque_from: (0..joints).collect(),
            torque_factor: vec![1.0; joints],
            gravity: None,
        }
    }

    /// The same with one change more.
    pub fn with(&self, change: &Change) -> Self {
        let mut out = self.clone();
        let (positions, torques) = match change {
            Change::Sign(channel, _)
            | Change::Exchange(channel, _, _)
            | Change::Scale(channel, _, _) => (
                *channel != ChannelKind::Torque,
                *channel != ChannelKind::Position,
            ),
            _ => (true, true),
        };
        match change {
            Change::Sign(_, joints) => out.multiply(joints, -1.0, positions, torques),
            Change::Scale(_, joints, factor) => out.multiply(joints, *factor, positions, torques),
            Change::Exchange(_, a, b) => {
                if positions {
                    out.position_from.swap(*a, *b);
                }
                if torques {
                    out.torque_from.swap(*a, *b);
                }
            }
            Change::Reverse => {
                out.position_from.reverse();
                out.torque_from.reverse();
            }
            Change::Zero(joint, angle) => out.zero[*joint] += angle,
            Change::Gravity(gravity) => out.gravity = Some(*gravity),
        }
        out
    }

    fn multiply(&mut self, joints: &[usize], factor: f64, positions: bool, torques: bool) {
        for j in joints {
            if positions {
                self.position_factor[*j] *= factor;
            }
            if torques {
                self.torque_factor[*j] *= factor;
            }
        }
    }

    /// Whether positions and gravity are those of another correction: the rows of the regressor are the
    /// same then.
    pub(super) fn moves_as(&self, other: &Self) -> bool {
        self.position_from == other.position_from
            && self.position_factor == other.position_factor
            && self.zero == other.zero
            && self.gravity == other.gravity
    }

    /// Logarithm of the size by which torques are multiplied.
    pub(super) fn torque_size(&self) -> f64 {
        self.torque_factor.iter().map(|f| f.abs().ln()).sum()
    }
}

impl Change {
    /// Joints that it is about; none where it concerns all.
    pub fn joints(&self) -> Vec<usize> {
        match self {
            Self::Sign(_, joints) | Self::Scale(_, joints, _) => joints.clone(),
            Self::Exchange(_, a, b) => vec![*a, *b],
            Self::Zero(joint, _) => vec![*joint],
            Self::Reverse | Self::Gravity(_) => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_add_up_and_undo_themselves() {
        let none = Correction::none(3);
        let turned = Change::Sign(ChannelKind::Torque, vec![1]);
        let moved = Change::Exchange(ChannelKind::Both, 0, 2);
        let both = none.with(&turned).with(&moved);
        assert_eq!(both.torque_factor, [1.0, -1.0, 1.0]);
        assert_eq!(both.position_from, [2, 1, 0]);
        assert_eq!(both.torque_from, [2, 1, 0]);
        assert!(!both.moves_as(&none) && none.with(&turned).moves_as(&none));
        assert_eq!(both.with(&moved).with(&turned), none);
    }
}
