//! Standard parameters of links from base parameters: of all that give the same torques, those
//! nearest to a prior.
//!
//! Base parameters are theta = B x of the standard ones x. The nearest to x0 is
//! x = x0 + B' (B B')^-1 (theta - B x0); the diagonal of B' (B B')^-1 B is 1 where the data determine
//! a parameter by itself, and 0 where they say nothing of it.

use nalgebra::DVector;

use cft_ident_core::robot::Robot;
use cft_ident_core::robot::standard::STANDARD;
use cft_ident_files::config::serial_section::InertialSection;

/// What torques determine of a standard parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterIdentifiability {
    /// Its value.
    Alone,
    /// Only the sum of it and others.
    InSum,
    /// Nothing.
    Nothing,
}

/// Mass that is taken for a link whose mass nothing says [kg].
const UNTOLD_MASS: f64 = 1.0;

/// Standard parameters of every link, then of the drives, and whether torques determine them.
#[derive(Debug, Clone, PartialEq)]
pub struct StandardParameters {
    pub values: Vec<f64>,
    pub identifiability: Vec<ParameterIdentifiability>,
    /// Whether the priors give these torques as they are.
    pub is_prior: bool,
}

/// A change below this share of the largest number is rounding.
const ROUNDING: f64 = 1e-9;

/// The standard parameters nearest to the priors of the links and drives that give these base
/// parameters. Without a prior a link is 1 kg in its origin, and a drive has no inertia.
pub fn nearest(
    robot: &Robot,
    theta: &[f64],
    priors: &[Option<InertialSection>],
    drives: &[f64],
) -> StandardParameters {
    let p = robot.standard_parameters();
    let links = robot.tree().links().len();
    let mut x = DVector::zeros(p);
    for (x, drive) in x.iter_mut().skip(links * STANDARD).zip(drives) {
        *x = *drive;
    }
    for link in 0..links {
        match priors.get(link).and_then(Option::as_ref) {
            Some(prior) => {
                for (k, value) in prior.body().standard().into_iter().enumerate() {
                    x[link * STANDARD + k] = value;
                }
            }
            None => x[link * STANDARD + STANDARD - 1] = UNTOLD_MASS,
        }
    }
    let prior = x.clone();
    // couplings are no part of a link
    let rows = robot.groupings().len();
    let b = robot.standard_map().matrix.rows(0, rows).into_owned();
    let theta = DVector::from_column_slice(&theta[..rows]);
    // every row has a column of its own, so that B B' is positive definite
    let gram = &b * b.transpose();
    let mut identifiability = vec![ParameterIdentifiability::Nothing; p];
    if let Some(factor) = gram.cholesky() {
        // a second step, for the last digits
        for _ in 0..2 {
            let rest = &theta - &b * &x;
            x += b.transpose() * factor.solve(&rest);
        }
        let shares = factor.solve(&b);
        for (i, identifiability) in identifiability.iter_mut().enumerate() {
            let share = b.column(i).dot(&shares.column(i));
            *identifiability = match share {
                share if share > 1.0 - 1e-9 => ParameterIdentifiability::Alone,
                share if share > 1e-9 => ParameterIdentifiability::InSum,
                _ => ParameterIdentifiability::Nothing,
            };
        }
    }
    let moved = (&x - &prior).amax() / prior.amax().max(f64::MIN_POSITIVE);
    let is_prior = moved < ROUNDING;
    // rounding of a heavy link is much to a light one
    let values = if is_prior { prior } else { x };
    StandardParameters {
        values: values.iter().copied().collect(),
        identifiability,
        is_prior,
    }
}
