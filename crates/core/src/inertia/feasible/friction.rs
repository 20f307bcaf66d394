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

/// What of a joint's friction is held at nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Held {
    /// Nothing.
    Free,
    /// Friction as the joint begins to move.
    AtRest,
    /// Friction at the greatest speed.
    AtSpeed,
    /// All of it.
    Whole,
}

impl Held {
    /// What is to be held where the friction of a fit that held this would drive.
    fn after(self, at_rest: f64, at_speed: f64) -> Self {
        match self {
            Self::Free if at_rest < 0.0 => Self::AtRest,
            Self::Free if at_speed < 0.0 => Self::AtSpeed,
            Self::AtRest if at_speed < 0.0 => Self::Whole,
            Self::AtSpeed if at_rest < 0.0 => Self::Whole,
            held => held,
        }
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
    let mut held = vec![Held::Free; friction.len()];
    loop {
        let factor = restricted(task.factor, friction, &held);
        let restricted = ConsistencyProblem {
            factor: &factor,
            ..*task
        };
        let mut found = feasible(&restricted)?;
        let mut next = held.clone();
        for ((of, held), next) in friction.iter().zip(&held).zip(&mut next) {
            if *held == Held::AtSpeed && of.speed.is_finite() {
                found.theta[of.coulomb] = -of.speed * found.theta[of.viscous];
            }
            let at_rest = found.theta[of.coulomb];
            // exactly nothing where it is held there
            let at_speed = match held {
                Held::AtSpeed => 0.0,
                _ => of.at_speed(at_rest, found.theta[of.viscous]),
            };
            *next = held.after(at_rest, at_speed);
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
        match held {
            Held::AtSpeed if of.speed.is_finite() => {
                // f_c = - f_v times the speed
                let both = out.column(of.viscous) - out.column(of.coulomb) * of.speed;
                out.set_column(of.viscous, &both);
                out.column_mut(of.coulomb).fill(0.0);
            }
            Held::AtSpeed => out.column_mut(of.viscous).fill(0.0),
            Held::AtRest | Held::Whole => out.column_mut(of.coulomb).fill(0.0),
            Held::Free => {}
        }
        if *held == Held::Whole {
            out.column_mut(of.viscous).fill(0.0);
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
        for wanted in [
            [0.3, 0.2],
            [-0.3, 0.2],
            [0.3, -0.2],
            [-0.3, -0.2],
            [0.0, 0.0],
        ] {
            for speed in [0.0, 1.0, 1e3, f64::INFINITY] {
                let theta = found(wanted, speed);
                assert!(theta.iter().all(|x| x.is_finite()), "{wanted:?} {speed}");
                let (viscous, coulomb) = (theta[1], theta[2]);
                let fast = if speed.is_finite() { speed } else { 1e6 };
                assert!(coulomb >= 0.0, "{wanted:?} {speed}: {theta:?}");
                assert!(
                    coulomb + fast * viscous >= -1e-12,
                    "{wanted:?} {speed}: {theta:?}"
                );
            }
        }
    }
}
