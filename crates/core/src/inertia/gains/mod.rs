//! Gains of the torque channels: what one unit of each channel (an ampere, say) is at its joint.
//!
//! A channel y_j counts the torque in a unit of its own, tau_j = g_j y_j, so that with c_j = 1/g_j
//!
//! ```text
//! y_j = c_j Y_j (theta + s P [m, pi]) + f_j psi_j + e_j
//! ```
//!
//! where s is 1 in the log that carries the payload and 0 elsewhere, P the base parameters of a body at
//! the last link, m its known mass, pi its unknown centre and inertia, and psi_j friction in the channel's
//! own unit. Gautier and Briot (2014, "Global identification of joint drive gains and dynamic parameters
//! of robots", J. Dyn. Sys. Meas. Control 136) put the channels among the columns of a total least
//! squares. Here the sum over joints of N log |e_j|^2 is minimised instead: the noise is in the channels,
//! each joint has its own, and this is the likelihood of what was measured. The bilinear problem is
//! solved on R factors of \[Y_j f_j | y_j\]; their total least squares begins it.
//!
//! Without the mass only ratios of gains are left, for all gains and all parameters have one factor in
//! common: the mass that the payload shows on joint j is c_j mu, and g_j = m / (c_j mu).

mod certainty;
mod problem;
mod search;

use nalgebra::{DMatrix, DVector};

use super::accumulate::BlockFactors;
use super::solution::{FitError, joints, solve};
use crate::math::descent::IterationEnding;

use problem::GainProblem;
pub use problem::PayloadColumns;

/// The rows that gains are fitted to.
#[derive(Debug, Clone, Copy)]
pub struct GainRows<'a> {
    pub unloaded: &'a BlockFactors,
    /// Rows of the log with the payload, and what a payload's columns are.
    pub loaded: Option<(&'a BlockFactors, &'a PayloadColumns)>,
}

/// What the rows say of the gains.
#[derive(Debug, Clone)]
pub struct GainFit {
    /// Channel per torque of each joint: with a payload c_j mu, which is 1/g_j for a load of 1 kg;
    /// without one c_j, up to a factor of all. Its sign is that of the channel.
    pub channel: Vec<f64>,
    /// Covariance of the logarithms of `channel`; without a payload that of their differences to the
    /// reference joint.
    pub covariance: DMatrix<f64>,
    /// Whether the rows determine it of this joint: by itself with a payload, else beside the reference.
    pub determined: Vec<bool>,
    /// The joint beside which the others are determined, where there is no payload.
    pub reference: Option<usize>,
    /// Residual of each joint in the channel's unit.
    pub residual_std: Vec<f64>,
    pub iterations: usize,
    pub ending: IterationEnding,
}

/// Fits the gains of all joints.
///
/// # Errors
/// [`FitError`]: too few rows, or nothing that moves.
pub fn fit_gains(rows: &GainRows) -> Result<GainFit, FitError> {
    let problem = GainProblem::new(rows)?;
    let found = search::search(&problem)?;
    certainty::certain(&problem, found)
}

/// Derivatives of the weighted least-squares solution by the logarithm of each joint's gain, unknowns x
/// joints: the solution for the torque of that joint alone. `shift` is what the solution of the rows lacks
/// to the parameters, as for a law that they are linear about.
///
/// # Errors
/// [`FitError`].
pub fn by_gains(
    factors: &BlockFactors,
    weights: &[f64],
    shift: &DVector<f64>,
) -> Result<DMatrix<f64>, FitError> {
    let columns = &factors.columns;
    let triangles = joints(factors)?;
    let inverse = solve(factors, &triangles, weights, None)?.inverse;
    let mut slopes = DMatrix::zeros(columns.unknowns(), columns.joints);
    for (j, r) in triangles.iter().enumerate() {
        let x = r.columns(0, columns.unknowns_of(j));
        let torque = r.column(r.ncols() - 1) + x * factors.own_unknowns(shift, j);
        let mut whole = DVector::zeros(columns.unknowns());
        columns.add_own(j, weights[j] * weights[j], &x.tr_mul(&torque), &mut whole);
        slopes.set_column(j, &(&inverse * whole));
    }
    Ok(slopes)
}
