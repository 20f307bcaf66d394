//! Small general mathematics: the mergeable R factor, rank and singular values, recursive filters,
//! minimisation.

pub mod bootstrap;
pub mod causal;
pub mod cholesky;
pub mod covariance;
pub mod descent;
pub mod formula;
pub mod gram;
pub mod hyperbolic;
pub mod jacobi;
pub mod kept;
pub mod lanes;
pub mod long_run;
pub mod minimise;
pub mod rank;
pub mod rank_revealing;
pub mod rfactor;
pub mod sos;
pub mod zero_phase;

#[cfg(test)]
mod properties;

use crate::explain::Explain;
use thiserror::Error;

/// What the room `math` cannot compute, with the numbers that offend.
#[derive(Debug, Clone, PartialEq, Explain, Error)]
pub enum MathError {
    /// An entry is NaN or infinite; rows and columns count from 0.
    #[explain(
        "matrix entry ({row}, {column}) is {value}: find the row of data that is not finite and leave it out"
    )]
    NotFinite {
        row: usize,
        column: usize,
        value: f64,
    },

    /// Neither method found singular values that reproduce the norm of the matrix.
    #[explain(
        "singular values of a {rows} x {columns} matrix have square sum {found:e}, its entries {expected:e}: scale the columns to norm 1 first"
    )]
    NoConvergence {
        rows: usize,
        columns: usize,
        /// Sum of the squared singular values.
        found: f64,
        /// Sum of the squared entries.
        expected: f64,
    },

    /// Two R factors of different width cannot be merged.
    #[explain(
        "an R factor of {found} columns cannot be merged into one of {expected}: both must come from the same model"
    )]
    ColumnMismatch {
        /// Columns of the factor that is extended.
        expected: usize,
        /// Columns of what is added.
        found: usize,
    },

    /// A cut-off frequency that the sampling rate does not carry.
    #[explain(
        format!(
            "a cut-off of {cutoff_hz} Hz needs a sampling rate of more than {} Hz, found {rate_hz} Hz",
            2.0 * cutoff_hz
        ),
        "lower the cut-off, or correct the times of the log if its rate is another"
    )]
    Cutoff { cutoff_hz: f64, rate_hz: f64 },

    /// A filter order outside 1..=16.
    #[explain("a filter of order {order} is not offered: choose 1 to 16")]
    FilterOrder { order: usize },

    /// A pass-band ripple that is not a positive number of decibels.
    #[explain("a pass-band ripple of {ripple_db} dB is not possible: choose more than 0, 0.05 say")]
    Ripple { ripple_db: f64 },

    /// A signal shorter than the extension at its ends.
    #[explain(
        "{samples} samples are too few for a zero-phase filter that extends each end by {needed}: give a longer record or a filter of lower order"
    )]
    TooShort {
        samples: usize,
        /// Samples of the extension; the signal needs one more.
        needed: usize,
    },
}

/// norm(tau - tau_hat) / norm(tau) from the squares of both; NaN where the torque is one that rounding alone makes, of a
/// motor that is off.
pub(crate) fn relative_error(error: f64, torque: f64) -> f64 {
    match torque > f64::EPSILON * error {
        true => (error / torque).sqrt(),
        false => f64::NAN,
    }
}
