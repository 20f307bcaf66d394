//! Two models of one robot beside each other: their parameters in standard deviations of the
//! difference, and their errors on the same rows of the same logs.

mod errors;
mod parameters;

pub use errors::Difference;
pub(crate) use errors::{ErrorDifferences, differences};
pub(crate) use parameters::side_by_side;
pub use parameters::{
    ParameterEstimate, ParameterPair, SideBySide, UnpairedParameter, UnpairedReason,
};
