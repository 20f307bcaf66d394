//! Friction that takes power, beside links that can exist.

use nalgebra::DMatrix;

use super::{ConsistencyProblem, Feasible, feasible};
use crate::inertia::solution::FitError;

/// Where the friction of a joint stands among the unknowns, and up to which speed it is asked to take power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionColumns {
    pub viscous: usize,
    pub coulomb: usize,
    /// Infinite where it is to take power at every speed \[m/s or rad/s\].
    pub speed: f64,
}

impl FrictionColumns {
    /// What is below zero where the friction drives at its greatest speed.
    fn at_speed(&self, coulomb: f64, viscous: f64) -> f64 {
        match self.speed.is_finite() {
            true => coulomb + self.speed * viscous,
            // whatever the level at rest, the slope decides
            false => viscous,
        }
    }
}

/// What of a joint's friction is held at nothing: that as the joint begins to move, and that at the greatest speed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Held {
    at_rest: bool,
    at_speed: bool,
}

impl Held {
    /// Whether f_c follows f_v: friction is nothing at a speed that the joint reaches, and free below.
    fn ties(self, of: &FrictionColumns) -> bool {
        self.at_speed && !self.at_rest && of.speed.is_finite()
    }
}

/// Least squares over physically consistent links, with friction f_c sgn v + f_v v that takes power from rest to
/// the speeds given: what would drive is held at nothing, and the rest is fitted again.
///
/// # Errors
/// [`FitError`].
pub fn with_friction(
    task: &ConsistencyProblem,
    friction: &[FrictionColumns],
) -> Result<Feasible, FitError> {
    let free = Held {
        at_rest: false,
        at_speed: false,
    };
    let mut held = vec![free; friction.len()];
    loop {
        let factor = restricted(task.factor, friction, &held);
        let restricted = ConsistencyProblem {
            factor: &factor,
            ..*task
        };
        let mut found = feasible(&restricted)?;
        let mut next = held.clone();
        for ((of, held), next) in friction.iter().zip(&held).zip(&mut next) {
            if held.ties(of) {
                found.theta[of.coulomb] = -of.speed * found.theta[of.viscous];
            }
            let (coulomb, viscous) = (found.theta[of.coulomb], found.theta[of.viscous]);
            // one of the two at a time
            if !held.at_rest && coulomb < 0.0 {
                next.at_rest = true;
            } else if !held.at_speed && of.at_speed(coulomb, viscous) < 0.0 {
                next.at_speed = true;
            }
        }
        if next == held {
            return Ok(found);
        }
        held = next;
    }
}

/// The factor of rows without what is held: a column of zeros leaves its unknown at 0.
fn restricted(factor: &DMatrix<f64>, friction: &[FrictionColumns], held: &[Held]) -> DMatrix<f64> {
    let mut out = factor.clone();
    for (of, held) in friction.iter().zip(held) {
        if held.ties(of) {
            // f_c = - f_v times the speed
            let both = out.column(of.viscous) - out.column(of.coulomb) * of.speed;
            out.set_column(of.viscous, &both);
        } else if held.at_speed {
            out.column_mut(of.viscous).fill(0.0);
        }
        if held.at_rest || held.ties(of) {
            out.column_mut(of.coulomb).fill(0.0);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::{JointKind, Robot};

    /// What a single joint makes of rows that want this friction, asked to take power up to `speed`.
    fn found(wanted: [f64; 2], speed: f64) -> Vec<f64> {
        let robot = Robot::single_joint("q1", JointKind::Revolute);
        let map = robot.standard_map();
        let mut factor = DMatrix::identity(4, 4);
        for (k, value) in [0.5, wanted[0], wanted[1]].into_iter().enumerate() {
            factor[(k, 3)] = value;
        }
        let task = ConsistencyProblem {
            map: &map,
            bodies: &[None],
            factor: &factor,
            effective: 1.0,
        };
        let columns = [FrictionColumns {
            viscous: 1,
            coulomb: 2,
            speed,
        }];
        let found = with_friction(&task, &columns).unwrap();
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
                let theta = found(wanted, speed);
                assert!(theta.iter().all(|x| x.is_finite()), "{wanted:?} {speed}");
                let (viscous, coulomb) = (theta[1], theta[2]);
                let fast = if speed.is_finite() { speed } else { 1e6 };
                let takes = coulomb >= 0.0 && coulomb + fast * viscous >= -1e-12;
                assert!(takes, "{wanted:?} {speed}: {theta:?}");
            }
        }
    }
}
