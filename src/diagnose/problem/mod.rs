//! What is fitted: which rows do what, the unknowns, their filtered columns, and the joint fit.

pub mod fit;
pub mod plan;
pub mod rows;
pub mod unknowns;
