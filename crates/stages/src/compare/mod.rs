//! Two models of one robot beside each other: their parameters in standard deviations of the
//! difference, and their errors on the same rows of the same logs. Two runs of a command beside each
//! other, by the JSON documents that they wrote.

mod errors;
mod parameters;
mod runs;

pub use errors::Difference;
pub(crate) use errors::{ErrorDifferences, differences};
pub(crate) use parameters::side_by_side;
pub use parameters::{Apart, ParameterEstimate, ParameterPair, Reason, SideBySide};
pub use runs::{DiffError, ErrorChange, InputChange, RunDifference, VerdictChange, runs};
