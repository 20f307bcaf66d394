//! Which corrections of a set-up are tried.

use std::f64::consts::{FRAC_PI_4, PI};

use super::channels::Drive;
use super::correction::{Change, Correction};
use super::finding::ChannelKind::{Both, Position, Torque};
use super::normal::Problem;
use cft_ident_core::robot::JointKind;

/// Up to so many joints, every set of torques is tried with the other sign.
const ALL_SETS: usize = 7;
/// Units that are taken for each other: degrees and radians, milli, centi and percent.
pub(super) const FACTORS: [f64; 6] = [PI / 180.0, 180.0 / PI, 1e-3, 1e3, 1e-2, 1e2];
/// Acceleration of free fall \[m/s^2\].
const FREE_FALL: f64 = 9.81;

/// The changes whose rows are those of the set-up as it is: signs, order and units of the torques.
pub(super) fn of_torques(problem: &Problem, moving: &[usize]) -> Vec<Change> {
    let mut out = signs(moving);
    out.extend(pairs(moving).map(|(a, b)| Change::Exchange(Torque, a, b)));
    if moving.len() > 1 {
        // a factor that all torques share leaves no trace, nor does that of a joint alone
        for j in moving {
            out.extend(FACTORS.map(|f| Change::Scale(Torque, vec![*j], f)));
        }
        // but where friction is known
        if problem.columns.known.iter().any(Option::is_some) {
            out.extend(FACTORS.map(|f| Change::Scale(Torque, moving.to_vec(), f)));
        }
    }
    out
}

/// Sets of torques with the other sign.
fn signs(moving: &[usize]) -> Vec<Change> {
    let mut out = Vec::new();
    match moving.len() {
        n @ 1..=ALL_SETS => {
            // small sets first: the simplest of those that explain as much is told
            let mut sets: Vec<u32> = (1..1 << n).collect();
            sets.sort_by_key(|set| set.count_ones());
            out.extend(sets.into_iter().map(|set| {
                let of = |(i, j): (usize, &usize)| (set >> i & 1 == 1).then_some(*j);
                Change::Sign(Torque, moving.iter().enumerate().filter_map(of).collect())
            }));
        }
        _ => {
            out.extend(moving.iter().map(|j| Change::Sign(Torque, vec![*j])));
            out.push(Change::Sign(Torque, moving.to_vec()));
        }
    }
    out
}

/// The changes that give other rows: signs, order and units of positions, and the order of joints.
pub(super) fn of_positions(problem: &Problem, moving: &[usize]) -> Vec<Change> {
    let mut out: Vec<Change> = Vec::new();
    let alone = problem.moving().iter().filter(|m| **m).count() < 2;
    if alone && problem.channels.drive == Drive::Motors {
        // another sign is another pose, which one joint's torque does not tell
        return out;
    }
    out.extend(moving.iter().map(|j| Change::Sign(Position, vec![*j])));
    if moving.len() == 1 {
        return out;
    }
    out.push(Change::Sign(Position, moving.to_vec()));
    out.extend(pairs(moving).map(|(a, b)| Change::Exchange(Both, a, b)));
    out.extend(pairs(moving).map(|(a, b)| Change::Exchange(Position, a, b)));
    let joints = problem.robot.joints();
    if joints > 2 && moving.len() == joints {
        out.push(Change::Reverse);
    }
    for f in FACTORS {
        out.push(Change::Scale(Position, moving.to_vec(), f));
        out.extend(moving.iter().map(|j| Change::Scale(Position, vec![*j], f)));
    }
    out
}

/// Zeros by multiples of 45 degrees.
pub(super) fn of_zeros(problem: &Problem) -> Vec<Change> {
    let robot = problem.robot;
    if !robot.knows_links() || problem.channels.drive == Drive::Motors {
        return Vec::new();
    }
    let turning = (0..robot.joints()).filter(|j| robot.joint_kind(*j) == JointKind::Revolute);
    let eighths = [2, -2, 4, 1, -1, 3, -3].map(|k| f64::from(k) * FRAC_PI_4);
    turning
        .flat_map(|j| eighths.map(|angle| Change::Zero(j, angle)))
        .collect()
}

/// Gravity along the axes of the base, between two of them and between three.
pub(super) fn of_gravity(problem: &Problem, base: &Correction) -> Vec<Change> {
    if problem.in_gravity.is_none() {
        return Vec::new();
    }
    let now = base.gravity.unwrap_or(problem.robot.tree().gravity());
    let mut out = Vec::new();
    for k in 0..27 {
        let direction = [k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1].map(f64::from);
        let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length == 0.0 {
            continue;
        }
        let gravity = direction.map(|x| FREE_FALL * x / length);
        if angle(&gravity, &now) > 1e-6 {
            out.push(Change::Gravity(gravity));
        }
    }
    // along an axis first
    out.sort_by_key(|change| match change {
        Change::Gravity(g) => g.iter().filter(|x| **x != 0.0).count(),
        _ => 0,
    });
    out
}

/// Angle between two directions \[rad\]; that of nothing with anything is a half turn.
pub(super) fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let dot = |x: &[f64; 3], y: &[f64; 3]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    if lengths > 0.0 {
        (dot(a, b) / lengths).clamp(-1.0, 1.0).acos()
    } else {
        PI
    }
}

fn pairs(of: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    let pair = |(i, a): (usize, &usize)| of[i + 1..].iter().map(|b| (*a, *b)).collect::<Vec<_>>();
    of.iter()
        .enumerate()
        .flat_map(pair)
        .collect::<Vec<_>>()
        .into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_of_signs_is_tried_once_and_single_ones_first() {
        let signs = signs(&[0, 1, 2]);
        assert_eq!(signs.len(), 7);
        assert_eq!(signs[0], Change::Sign(Torque, vec![0]));
        assert_eq!(signs[6], Change::Sign(Torque, vec![0, 1, 2]));
    }

    #[test]
    fn directions_are_compared_by_their_angle() {
        assert!((angle(&[0.0, 0.0, -9.81], &[9.81, 0.0, 0.0]) - PI / 2.0).abs() < 1e-12);
        assert!(angle(&[1.0, 1.0, 0.0], &[2.0, 2.0, 0.0]) < 1e-7);
    }
}
