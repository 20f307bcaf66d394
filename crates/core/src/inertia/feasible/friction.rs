//! Friction that takes power, beside links that can exist.

use nalgebra::DMatrix;

use super::{ConsistencyProblem, Feasible, feasible};
use crate::inertia::solution::FitError;

/// Where the friction of a joint stands among the unknowns, and up to which speed it is asked to take power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionColumns {
    pub viscous: usize,
    pub coulomb: usize,
    /// \[m/s or rad/s\]
    pub speed: f64,
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
            if *held == Held::AtSpeed {
                found.theta[of.coulomb] = -of.speed * found.theta[of.viscous];
            }
            let at_rest = found.theta[of.coulomb];
            // exactly nothing where it is held there
            let at_speed = match held {
                Held::AtSpeed => 0.0,
                _ => at_rest + of.speed * found.theta[of.viscous],
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
        if *held == Held::AtSpeed {
            // f_c = - f_v times the speed
            let both = out.column(of.viscous) - out.column(of.coulomb) * of.speed;
            out.set_column(of.viscous, &both);
        }
        if *held != Held::Free {
            out.column_mut(of.coulomb).fill(0.0);
        }
        if *held == Held::Whole {
            out.column_mut(of.viscous).fill(0.0);
        }
    }
    out
}
