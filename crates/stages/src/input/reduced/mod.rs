//! Reduced logs: what a linear fit needs of each log, in a small file.
//!
//! Of each log stand there the R factor of every joint and block of time, by no weight but each joint's own
//! units; the factor of a narrower position filter and of shifted encoder grids, by which deviations are widened;
//! and what the first look found. A set of reduced logs is the logs themselves side by side, so that merging
//! is associative and a fit does not depend on how they were grouped.

pub(crate) mod error;
mod factors;
mod file;
mod matrix;
pub(crate) mod reduced_log;

pub use error::ReducedError;
pub use file::{FORMAT, is_reduced};
pub(crate) use reduced_log::ReducedRows;
pub use reduced_log::{FrictionGiven, MadeWith, ReducedLog, ReducedLogs};
