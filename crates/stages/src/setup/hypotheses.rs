//! The mistakes that a person makes with a robot file, as what puts them right.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::channels::Drive;
use super::correction::Change;
use super::finding::ChannelKind::{self, Both, Position, Torque};
use super::problem::Problem;
use cft_ident_core::robot::JointKind;

/// Degrees, radians and turns taken for each other.
const ANGLES: [f64; 4] = [PI / 180.0, 180.0 / PI, TAU, 1.0 / TAU];
/// Thousandths and thousands: mm, mNm, kN.
const THOUSANDS: [f64; 2] = [1e-3, 1e3];
/// Acceleration of free fall \[m/s^2\].
const FREE_FALL: f64 = 9.81;
const SIDES: [ChannelKind; 3] = [Torque, Position, Both];
/// Largest gear ratio of the list.
pub(super) const LARGEST: f64 = 200.0;

/// The list, the simplest first. One joint alone shows its signs and no factor.
pub(super) fn all(problem: &Problem) -> Vec<Change> {
    let moving = problem.channels_that_move();
    let mut out = Vec::new();
    for side in SIDES {
        out.extend(moving.iter().map(|j| Change::Scale(side, vec![*j], -1.0)));
    }
    if moving.len() < 2 {
        return out;
    }
    out.push(Change::Scale(Torque, moving.clone(), -1.0));
    out.push(Change::Scale(Position, moving.clone(), -1.0));
    for side in SIDES {
        for (i, a) in moving.iter().enumerate() {
            let others = moving[i + 1..].iter();
            out.extend(others.map(|b| Change::Exchange(side, *a, *b)));
        }
    }
    if moving.len() == problem.robot.joints() && moving.len() > 2 {
        out.push(Change::Reverse);
    }
    out.extend(units(problem, &moving));
    out.extend(zeros(problem, &moving));
    out.extend(velocities(problem, &moving));
    out.extend(gravities(problem));
    out
}

fn units(problem: &Problem, moving: &[usize]) -> Vec<Change> {
    let mut out = Vec::new();
    let kind = |j: usize| match problem.channels.drive {
        Drive::Motors => {
            let kind = problem.robot.transmission().coordinate_kind(j);
            kind.unwrap_or(JointKind::Prismatic)
        }
        _ => problem.robot.joint_kind(j),
    };
    let factors = |j: usize| -> &[f64] {
        match kind(j) {
            JointKind::Revolute => &ANGLES,
            JointKind::Prismatic => &THOUSANDS,
        }
    };
    let scaled = |side, of: &[usize], f: &f64| Change::Scale(side, of.to_vec(), *f);
    for &j in moving {
        out.extend(factors(j).iter().map(|f| scaled(Position, &[j], f)));
        out.extend(THOUSANDS.iter().map(|f| scaled(Torque, &[j], f)));
        let percent = problem.known.torque.get(j).copied().flatten();
        out.extend(percent.map(|most| scaled(Torque, &[j], &(most / 100.0))));
    }
    let alike = |j: &usize| kind(*j) == kind(moving[0]);
    let alike: Vec<usize> = moving.iter().copied().filter(alike).collect();
    if alike.len() > 1 {
        let factors = factors(moving[0]).iter();
        out.extend(factors.map(|f| scaled(Position, &alike, f)));
    }
    out
}

fn zeros(problem: &Problem, moving: &[usize]) -> Vec<Change> {
    if !problem.has_zeros() {
        return Vec::new();
    }
    let turns = |j: &&usize| problem.robot.joint_kind(**j) == JointKind::Revolute;
    let of = |j: &usize| [FRAC_PI_2, -FRAC_PI_2, PI].map(|angle| Change::Zero(*j, angle));
    moving.iter().filter(turns).flat_map(of).collect()
}

/// Velocities that are taken for positions, about the middle of the travel that the file allows.
fn velocities(problem: &Problem, moving: &[usize]) -> Vec<Change> {
    if problem.channels.drive != Drive::Joints {
        return Vec::new();
    }
    let rows = problem.sample.len().max(1) as f64;
    let of = |j: &usize| {
        let limits = problem.known.position.get(*j).copied().flatten();
        let middle = limits.map_or(0.0, |[low, high]| 0.5 * (low + high));
        let mean = problem.sample.product(|row| row.sum[*j]) / rows;
        Change::Velocity(*j, middle - mean)
    };
    moving.iter().map(of).collect()
}

/// Gravity along the axes of the base but the declared one.
fn gravities(problem: &Problem) -> Vec<Change> {
    if problem.in_gravity.is_none() {
        return Vec::new();
    }
    let now = problem.robot.tree().gravity();
    let size = now.iter().map(|x| x * x).sum::<f64>().sqrt();
    let axes = (0..6).map(|k| {
        let mut g = [0.0; 3];
        g[2 - k / 2] = if k % 2 == 0 { -FREE_FALL } else { FREE_FALL };
        g
    });
    let along = |g: &[f64; 3]| {
        let dot: f64 = g.iter().zip(&now).map(|(a, b)| a * b).sum();
        dot > 0.99 * FREE_FALL * size && dot > 0.0
    };
    axes.filter(|g| !along(g)).map(Change::Gravity).collect()
}

/// How far from what people write a factor is: units and what stands in the robot file, then tens, fives, whole numbers.
pub(super) fn oddity(factor: f64, ratios: &[f64]) -> u32 {
    let ratio = factor.abs().max(factor.abs().recip());
    let whole = |part: f64| (ratio / part - (ratio / part).round()).abs() < 1e-9;
    if is_unit(factor) || ratios.iter().any(|r| (r / ratio - 1.0).abs() < 1e-9) {
        return 0;
    }
    1 + [10.0, 5.0, 1.0].iter().take_while(|p| !whole(**p)).count() as u32
}

/// Whether a factor is that of two units.
pub(super) fn is_unit(factor: f64) -> bool {
    ANGLES.contains(&factor) || THOUSANDS.contains(&factor)
}

/// The factors of a list within an interval; ratios multiply a torque and divide a position.
pub(super) fn round_numbers(side: ChannelKind, ratios: &[f64], [low, high]: [f64; 2]) -> Vec<f64> {
    let halves = (3..=2 * LARGEST as u32).map(|k| f64::from(k) / 2.0);
    let written: Vec<f64> = ratios.iter().copied().filter(|r| *r > 1.0).collect();
    let is_new = |r: &f64| written.iter().all(|w| (w / r - 1.0).abs() > 1e-9);
    let ratios = written.iter().copied().chain(halves.filter(is_new));
    let mut all: Vec<f64> = match side {
        Torque => ratios.flat_map(|r| [r, 1.0 / r]).chain(THOUSANDS).collect(),
        Position => ratios.map(|r| 1.0 / r).chain(ANGLES).collect(),
        Both => ratios.collect(),
    };
    all.retain(|f| (low..=high).contains(f));
    all
}

/// Whether two readings are about the same joints, or both about gravity.
pub(super) fn same_place(a: &Change, b: &Change) -> bool {
    let (a, b) = (a.joints(), b.joints());
    a.is_empty() && b.is_empty() || a.iter().any(|j| b.contains(j))
}

/// Whether two readings turn the same joint: which of its channels it is, a symmetric machine does not show.
pub(super) fn same_line(a: &Change, b: &Change) -> bool {
    match (a, b) {
        (Change::Scale(_, a, -1.0), Change::Scale(_, b, -1.0)) => a == b,
        (Change::Scale(c, a, unit), Change::Scale(d, b, _)) => c == d && a == b && is_unit(*unit),
        (Change::Scale(Torque, a, _), Change::Gear(b, _))
        | (Change::Gear(b, _), Change::Scale(Torque, a, _)) => a.as_slice() == [*b],
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_of_factors_holds_the_ratios_and_units_in_it() {
        assert_eq!(round_numbers(Both, &[], [49.8, 50.2]), [50.0]);
        assert_eq!(round_numbers(Both, &[50.1], [49.8, 50.2]), [50.1, 50.0]);
        assert_eq!(round_numbers(Torque, &[], [0.9e-3, 1.1e-3]), [1e-3]);
        let near = round_numbers(Position, &[], [1.0 / 57.4, 1.0 / 57.2]);
        assert_eq!(near, [PI / 180.0]);
        assert!(round_numbers(Both, &[], [1.86, 1.88]).is_empty());
        let odd = |f: f64| oddity(f, &[50.1]);
        assert!(odd(1.0 / 50.1) < odd(50.0) && odd(50.0) < odd(51.0) && odd(51.0) < odd(50.5));
    }
}
