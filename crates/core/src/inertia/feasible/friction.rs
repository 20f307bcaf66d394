//! Friction that takes power, beside links that can exist.

use nalgebra::DMatrix;

/// Where the friction of a joint stands among the unknowns, and up to which speed it is asked to take power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionColumns {
    pub viscous: usize,
    pub coulomb: usize,
    /// Infinite where it is to take power at every speed \[m/s or rad/s\].
    pub speed: f64,
}

/// Friction levels before data: so much of the torque, and of one row's noise, that they neither stand against data nor
/// are left without a size where data say nothing.
const PLAIN_SHARE: f64 = 0.01;

/// A level of friction that is above zero: its parts in the unknowns, and what it is before data.
pub(super) struct FrictionLevel {
    pub parts: Vec<(usize, f64)>,
    pub plain: f64,
}

/// The friction of a joint by levels: that as the joint begins to move, and that at its greatest speed.
pub(super) struct FrictionLevels {
    at_rest: Option<FrictionLevel>,
    at_speed: Option<FrictionLevel>,
}

impl FrictionLevels {
    /// Of every joint; a level that no row shows is not asked for, and its unknowns stay at nothing.
    pub fn of(friction: &[FrictionColumns], factor: &DMatrix<f64>) -> Vec<Self> {
        let target = factor.column(factor.ncols() - 1).norm();
        let level = |parts: Vec<(usize, f64)>| {
            let mut column = factor.column(0) * 0.0;
            for (unknown, part) in &parts {
                column.axpy(*part, &factor.column(*unknown), 1.0);
            }
            let size = column.norm();
            let plain = (1.0 + PLAIN_SHARE * target) / size;
            (size > 0.0 && plain.is_finite()).then_some(FrictionLevel { parts, plain })
        };
        let of = |of: &FrictionColumns| {
            let FrictionColumns {
                viscous,
                coulomb,
                speed,
            } = *of;
            let seen = [viscous, coulomb].map(|k| factor.column(k).amax() > 0.0);
            match (seen, speed.is_finite()) {
                // f_c = level at rest, f_v = (level at speed - level at rest) / speed
                ([true, true], true) if speed > 0.0 => FrictionLevels {
                    at_rest: level(vec![(coulomb, 1.0), (viscous, -1.0 / speed)]),
                    at_speed: level(vec![(viscous, 1.0 / speed)]),
                },
                // whatever the level at rest, the slope decides
                ([_, true], false) | ([false, true], _) => FrictionLevels {
                    at_rest: level(vec![(coulomb, 1.0)]),
                    at_speed: level(vec![(viscous, 1.0)]),
                },
                _ => FrictionLevels {
                    at_rest: level(vec![(coulomb, 1.0)]),
                    at_speed: None,
                },
            }
        };
        friction.iter().map(of).collect()
    }

    pub fn levels(&self) -> impl Iterator<Item = &FrictionLevel> {
        self.at_rest.iter().chain(&self.at_speed)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ConsistencyProblem, feasible};
    use super::*;
    use crate::robot::{JointKind, Robot};

    /// What a single joint makes of rows that want this friction, each number to a deviation of 1 / `size`, asked to take
    /// power up to `speed`.
    fn found(wanted: [f64; 2], speed: f64, size: f64) -> Vec<f64> {
        let robot = Robot::single_joint("q1", JointKind::Revolute);
        let map = robot.standard_map();
        let mut factor = DMatrix::identity(4, 4) * size;
        for (k, value) in [0.5, wanted[0], wanted[1]].into_iter().enumerate() {
            factor[(k, 3)] = size * value;
        }
        let columns = [FrictionColumns {
            viscous: 1,
            coulomb: 2,
            speed,
        }];
        let task = ConsistencyProblem {
            map: &map,
            bodies: &[None],
            factor: &factor,
            effective: 1.0,
            friction: &columns,
        };
        let found = feasible(&task).unwrap();
        found.theta.iter().copied().collect()
    }

    #[test]
    fn friction_takes_power_up_to_its_speed_and_every_number_is_finite() {
        let signs = [
            [1.0, 1.0],
            [-1.0, 1.0],
            [1.0, -1.0],
            [-1.0, -1.0],
            [0.0, 0.0],
        ];
        for wanted in signs.map(|[viscous, coulomb]| [0.3 * viscous, 0.2 * coulomb]) {
            for speed in [0.0, 1.0, 1e3, f64::INFINITY] {
                let theta = found(wanted, speed, 1e3);
                assert!(theta.iter().all(|x| x.is_finite()), "{wanted:?} {speed}");
                let (viscous, coulomb) = (theta[1], theta[2]);
                let fast = if speed.is_finite() { speed } else { 1e6 };
                let takes = coulomb >= 0.0 && coulomb + fast * viscous >= -1e-12;
                assert!(takes, "{wanted:?} {speed}: {theta:?}");
            }
        }
    }

    #[test]
    fn friction_that_takes_power_is_left_as_it_is_wanted() {
        // what is left is the pull of the levels before data: a small part of a deviation, and nothing where rows are many
        for (size, off) in [(10.0, 3e-3), (1e3, 1e-5), (1e5, 1e-9)] {
            for speed in [0.5, 3.0, f64::INFINITY] {
                let theta = found([0.3, 0.2], speed, size);
                for (found, wanted) in theta[1..].iter().zip([0.3, 0.2]) {
                    assert!((found - wanted).abs() < off, "{size} {speed} {theta:?}");
                }
            }
        }
        // nothing at the greatest speed is as near as friction comes to one that drives there
        let theta = found([-0.3, 0.2], 2.0, 1e3);
        assert!((theta[2] + 2.0 * theta[1]).abs() < 1e-3, "{theta:?}");
    }
}
