//! Changes of a set-up, and their sum.

use super::finding::ChannelKind::{self, Both, Position, Torque};

/// One thing that may be wrong with a set-up, as what puts it right; of motors with coordinates, not of joints.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// These channels are to be multiplied by a factor, -1 for a sign.
    Scale(ChannelKind, Vec<usize>, f64),
    /// Two channels have changed places.
    Exchange(ChannelKind, usize, usize),
    /// All joints are listed from the tip to the base.
    Reverse,
    /// A channel that is on the motor's side of a gear of this ratio, position and torque.
    Gear(usize, f64),
    /// This is to be added to a joint's position \[m or rad\].
    Zero(usize, f64),
    /// Acceleration of free fall in the base frame \[m/s^2\].
    Gravity([f64; 3]),
    /// What is taken for a joint's position is its velocity; the position where a log begins \[m or rad\].
    Velocity(usize, f64),
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
    /// Of each joint whose position is a velocity, where it begins \[m or rad\].
    pub begins: Vec<Option<f64>>,
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
            begins: vec![None; joints],
            torque_from: (0..joints).collect(),
            torque_factor: vec![1.0; joints],
            gravity: None,
        }
    }

    /// The same with one change more.
    pub fn with(&self, change: &Change) -> Self {
        let mut out = self.clone();
        match change {
            Change::Two(first, second) => return self.with(first).with(second),
            Change::Scale(channel, joints, factor) => {
                joints
                    .iter()
                    .for_each(|j| out.multiply(*j, *channel, [*factor; 2]));
            }
            Change::Gear(j, ratio) => out.multiply(*j, Both, [ratio.recip(), *ratio]),
            Change::Exchange(channel, a, b) => {
                if *channel != Torque {
                    out.position_from.swap(*a, *b);
                }
                if *channel != Position {
                    out.torque_from.swap(*a, *b);
                }
            }
            Change::Reverse => {
                out.position_from.reverse();
                out.torque_from.reverse();
            }
            Change::Zero(joint, angle) => out.zero[*joint] += angle,
            Change::Velocity(joint, begins) => out.begins[*joint] = Some(*begins),
            Change::Gravity(gravity) => out.gravity = Some(*gravity),
        }
        out
    }

    /// Whether positions and gravity are those of another.
    pub(super) fn moves_as(&self, other: &Self) -> bool {
        self.position_from == other.position_from
            && self.position_factor == other.position_factor
            && self.zero == other.zero
            && self.begins == other.begins
            && self.gravity == other.gravity
    }

    fn multiply(&mut self, j: usize, of: ChannelKind, [position, torque]: [f64; 2]) {
        if of != Torque {
            self.position_factor[j] *= position;
        }
        if of != Position {
            self.torque_factor[j] *= torque;
        }
    }
}

impl Change {
    /// Joints that it is about; none where it concerns all.
    pub fn joints(&self) -> Vec<usize> {
        match self {
            Self::Scale(_, joints, _) => joints.clone(),
            Self::Exchange(_, a, b) => vec![*a, *b],
            Self::Zero(joint, _) | Self::Gear(joint, _) | Self::Velocity(joint, _) => vec![*joint],
            Self::Reverse | Self::Gravity(_) => Vec::new(),
            Self::Two(a, b) => [a.joints(), b.joints()].concat(),
        }
    }

    /// The mistakes that it is made of, those of several joints one by one.
    pub fn single(&self) -> Vec<Change> {
        match self {
            Self::Two(a, b) => [a.single(), b.single()].concat(),
            Self::Scale(channel, joints, f) => (joints.iter())
                .map(|j| Self::Scale(*channel, vec![*j], *f))
                .collect(),
            one => vec![one.clone()],
        }
    }

    /// The joint of a factor, or of where a velocity begins.
    pub(super) fn joint_of_value(&self) -> Option<usize> {
        match self {
            Self::Velocity(j, _) => Some(*j),
            other => other.times(1.0)?.joints().first().copied(),
        }
    }

    /// Whether both are factors or signs of the same channel.
    pub(super) fn is_value_of(&self, other: &Change) -> bool {
        match (self, other) {
            (Self::Scale(a, of, _), Self::Scale(b, also, _)) => a == b && of == also,
            (Self::Gear(a, _), Self::Gear(b, _)) => a == b,
            _ => false,
        }
    }

    /// Whether it is another one in a better value.
    pub(super) fn replaces(&self, other: &Change) -> bool {
        matches!((self, other), (Self::Velocity(a, _), Self::Velocity(b, _)) if a == b)
    }

    /// The same with its factor multiplied, where it has one.
    pub(super) fn times(&self, by: f64) -> Option<Change> {
        match self {
            Self::Scale(_, _, -1.0) => None,
            Self::Scale(channel, joints, f) => Some(Self::Scale(*channel, joints.clone(), f * by)),
            Self::Gear(j, f) => Some(Self::Gear(*j, f * by)),
            _ => None,
        }
    }

    /// Whether only torques change: the columns are those of the set-up as it is.
    pub(super) fn is_of_torques(&self) -> bool {
        match self {
            Self::Exchange(channel, ..) | Self::Scale(channel, ..) => *channel == Torque,
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
        let turned = Change::Scale(Torque, vec![1], -1.0);
        let moved = Change::Exchange(Both, 0, 2);
        let both = none.with(&turned).with(&moved);
        assert_eq!(both.torque_factor, [1.0, -1.0, 1.0]);
        assert_eq!(both.position_from, [2, 1, 0]);
        assert_eq!(both.torque_from, [2, 1, 0]);
        assert_eq!(both.with(&moved).with(&turned), none);
        let geared = none.with(&Change::Gear(1, 4.0));
        assert_eq!(geared.position_factor[1], 0.25);
        assert_eq!(geared.torque_factor[1], 4.0);
    }
}
