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
    /// A channel that is on the motor's side of a gear of this ratio, position and torque.
    Gear(usize, f64),
    /// This is to be added to a joint's position \[m or rad\].
    Zero(usize, f64),
    /// Acceleration of free fall in the base frame \[m/s^2\].
    Gravity([f64; 3]),
    /// One mistake, then another.
    Two(Box<Change>, Box<Change>),
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
        if let Change::Two(first, second) = change {
            return self.with(first).with(second);
        }
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
            Change::Gear(j, ratio) => {
                out.position_factor[*j] /= ratio;
                out.torque_factor[*j] *= ratio;
            }
            Change::Zero(joint, angle) => out.zero[*joint] += angle,
            Change::Gravity(gravity) => out.gravity = Some(*gravity),
            Change::Two(..) => {}
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
}

impl Change {
    /// Joints that it is about; none where it concerns all.
    pub fn joints(&self) -> Vec<usize> {
        match self {
            Self::Sign(_, joints) | Self::Scale(_, joints, _) => joints.clone(),
            Self::Exchange(_, a, b) => vec![*a, *b],
            Self::Zero(joint, _) | Self::Gear(joint, _) => vec![*joint],
            Self::Reverse | Self::Gravity(_) => Vec::new(),
            Self::Two(a, b) => [a.joints(), b.joints()].concat(),
        }
    }

    /// The mistakes that it is made of.
    pub fn single(&self) -> Vec<&Change> {
        match self {
            Self::Two(a, b) => vec![a, b],
            one => vec![one],
        }
    }

    /// Whether only torques change: the columns are those of the set-up as it is.
    pub(super) fn is_of_torques(&self) -> bool {
        match self {
            Self::Sign(channel, _) | Self::Exchange(channel, ..) | Self::Scale(channel, ..) => {
                *channel == ChannelKind::Torque
            }
            Self::Two(a, b) => a.is_of_torques() && b.is_of_torques(),
            _ => false,
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
        assert!(turned.is_of_torques() && !moved.is_of_torques());
        assert_eq!(both.with(&moved).with(&turned), none);
    }
}
