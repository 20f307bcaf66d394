//! Torque channels that are another's, or have the other sign: told before any physics is tried,
//! by the model that is given.

use crate::diagnose::problem::data_split::{DataSplit, Piece, RowRole};
use crate::diagnose::problem::normal_equations::dot;
use crate::effect::AugmentedModel;
use crate::motion::{MotionError, ParallelFilters, Stretch};

/// What is wrong with the torque channel of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Suspicion {
    /// It has the other sign.
    Turned { joint: usize },
    /// It changed places with another joint's.
    Exchanged { joint: usize, with: usize },
}

/// Squared error that is left by the right reading, over that of the channel as it is, at most.
const FAR_BETTER: f64 = 0.2;
/// Squared error that the right reading leaves, over the torque's square, at most: the model knows
/// the joint.
const KNOWN: f64 = 0.25;

/// The first joint whose torque the given model explains far better turned or exchanged.
///
/// # Errors
/// [`MotionError`] of the filter.
pub(crate) fn suspicion(
    model: &AugmentedModel,
    stretches: &[Stretch],
    filters: &ParallelFilters,
    split: &DataSplit,
) -> Result<Option<Suspicion>, MotionError> {
    let n = model.model.robot.joints();
    // products of measured (first n) and reconstructed torques over the fitted rows
    let mut products = vec![vec![0.0; 2 * n]; 2 * n];
    for (index, stretch) in stretches.iter().enumerate() {
        if split.idle(index) {
            continue;
        }
        let hat = model.reconstruct(stretch);
        let channels: Vec<&[f64]> = stretch.tau.iter().chain(&hat).map(Vec::as_slice).collect();
        let rows = filters.of(stretch).run(&channels)?;
        let own = |p: &&Piece| p.stretch == index && RowRole::fitted(p.role);
        for piece in split.pieces.iter().filter(own) {
            for (a, products) in products.iter_mut().enumerate() {
                for (b, sum) in products.iter_mut().enumerate() {
                    if split.ignores(index, a % n) || split.ignores(index, b % n) {
                        continue;
                    }
                    let range = piece.rows.clone();
                    *sum += dot(&rows[a][range.clone()], &rows[b][range]);
                }
            }
        }
    }
    // |tau_i - s hat_j|^2
    let error = |i: usize, j: usize, s: f64| {
        products[i][i] - 2.0 * s * products[i][n + j] + products[n + j][n + j]
    };
    let square = |i: usize| products[i][i].max(f64::MIN_POSITIVE);
    for i in 0..n {
        let (as_is, turned) = (error(i, i, 1.0), error(i, i, -1.0));
        if turned < FAR_BETTER * as_is && turned < KNOWN * square(i) {
            return Ok(Some(Suspicion::Turned { joint: i }));
        }
        for j in i + 1..n {
            let better = |a: usize, b: usize| {
                let e = error(a, b, 1.0);
                e < FAR_BETTER * error(a, a, 1.0) && e < KNOWN * square(a)
            };
            if better(i, j) && better(j, i) {
                return Ok(Some(Suspicion::Exchanged { joint: i, with: j }));
            }
        }
    }
    Ok(None)
}
